"""Feet of the legs: from an option, a link of the file, a sphere, or the tip of a mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.formats.chains import Chain
from phasmid.formats.findings import Findings
from phasmid.formats.tree import RigidLink
from phasmid.units import plain_number

NAMES = ("foot", "feet", "tip", "toe", "end", "ee")
"""Words that name the end of a leg, as parts of a link's name."""

AT_THE_END = 0.9
"""Part of the way to the tip of a link's shapes at which a sphere is at its end."""

TIP = 1e-3
"""Corners of a mesh within this of the farthest one are its tip [m]."""

EXAMPLE = '--foot "1-3=0,0,-0.13; 4-6=0,0,0.13"'


@dataclass(frozen=True, eq=False)
class Foot:
    """The foot of a leg.

    Attributes:
        point: In the frame of the tibia's first link [m], shape (3,).
        source: Its source, in words.
    """

    point: Float[np.ndarray, "3"]
    source: str


def find_foot(number: int, chain: Chain, place: str, findings: Findings) -> Foot:
    """Find the foot of a leg.

    Args:
        number: Number of the leg in the robot, for messages.
        chain: Its three hinges.
        place: A point or a link, as one of `foot_places`; empty to find it in the file.
        findings: Receives what was assumed.

    Raises:
        InvalidInput: There is no such place.
        InvalidRobot: The file has no foot, and nothing to assume one from.
    """
    return _named(number, chain, place) if place else _found(number, chain, findings)


def foot_places(option: str, count: int) -> list[str]:
    """Return the part of the option `ImportOptions.foot` for each leg; empty for one without.

    Raises:
        InvalidInput: The option names no leg.
    """
    if "=" not in option:
        return [option] * count
    places = [""] * count
    for entry in filter(None, (part.strip() for part in option.split(";"))):
        legs, _, place = entry.partition("=")
        first, _, last = legs.strip().partition("-")
        last = last or first
        if not (first.isdecimal() and last.isdecimal() and place.strip()):
            raise InvalidInput(
                f'foot is "{entry}"; it must be numbers of legs, =, and a link\'s name or three '
                "numbers.",
                where="option --foot",
                hint=EXAMPLE,
            )
        if not 1 <= int(first[:4]) <= int(last[:4]) <= count:
            raise InvalidInput(
                f'there is no leg "{legs.strip()}"; legs are 1 to {count}.',
                where="option --foot",
                hint=EXAMPLE,
            )
        for number in range(int(first), int(last) + 1):
            places[number - 1] = place.strip()
    return places


def names_a_foot(name: str) -> bool:
    """Return whether a word of a name means a foot, such as ``foot_3`` or ``lf_toe``."""
    words = "".join(c if c.isalpha() else " " for c in name.lower()).split()
    return any(word in NAMES or word.endswith(("foot", "tip", "toe")) for word in words)


def _named(number: int, chain: Chain, place: str) -> Foot:
    """Return the foot of an option: a point, or a link by its name or its ending."""
    tibia = chain.links[2]
    pieces = place.split(",")
    if len(pieces) == 3:
        try:
            point = np.array([float(piece) for piece in pieces])
        except ValueError:
            point = np.full(3, math.nan)
        if not (np.isfinite(point).all() and np.abs(point).max() <= 2):
            raise InvalidInput(
                f"foot is {place}; it must be a link's name or three numbers in metres, "
                "each of at most 2.",
                where="option --foot",
                hint="--foot 0,0,-0.13",
            )
        return Foot(point, f"the point {place} in {tibia.name}")
    found = [name for name in tibia.poses if name == place]
    found = found or [name for name in tibia.poses if name.endswith(place)]
    if len(found) != 1:
        raise InvalidInput(
            f"leg {number}: {len(found) or 'no'} links at its end have a name that ends in "
            f'"{place}"; 1 is needed.',
            where="option --foot",
            hint=f"its links are {', '.join(list(tibia.poses)[:6])}",
        )
    return Foot(tibia.poses[found[0]][:3, 3], f"link {found[0]}")


def _found(number: int, chain: Chain, findings: Findings) -> Foot:
    """Return the foot of the file: a link, a collision sphere, or the tip of the shapes."""
    tibia = chain.links[2]
    named = [link for link in tibia.ends if names_a_foot(link.name)]
    massless = [
        link
        for link in tibia.ends
        if (link.inertial is None or not link.inertial.mass) and not link.parts
    ]
    for links in (named, massless):
        if len(links) == 1:
            return Foot(tibia.poses[links[0].name][:3, 3], f"link {links[0].name}")
    where = tibia.links[0].where
    axis = chain.joints[2].axis / np.linalg.norm(chain.joints[2].axis)
    corners = np.concatenate([np.empty((0, 3)), *(part.vertices for part in tibia.parts)])
    balls = _ball_ends(tibia, axis)
    away, balls_away = _radii(axis, corners), _radii(axis, balls)
    if len(balls) and balls_away.max() >= AT_THE_END * away.max(initial=0.0):
        report, source = findings.note, "collision sphere"
        point = balls[np.argmax(balls_away)]
    elif len(corners):
        report, source = findings.suspect, "tip of the shape"
        tip = corners[away >= away.max() - TIP]
        point = (tip.min(axis=0) + tip.max(axis=0)) / 2
    else:
        raise InvalidRobot(
            f"leg {number}: its foot is not given; {tibia.name} has neither a fixed link "
            "at its end nor a shape.",
            where=where,
            hint="--foot 0,0,-0.13, in metres in that link's frame",
        )
    what = (
        f"no foot in the file; the {source} of its last link was taken, "
        f"{1000 * _radii(axis, point[None])[0]:.1f} mm from the tibia's axis."
    )
    shown = ",".join(plain_number(length) for length in np.round(point, 4) + 0.0)
    hint = f"--foot {shown}, in metres in each leg's last link, changed to where it touches"
    report(f"leg {number}", what, where, hint)
    return Foot(point, f"{source} of {tibia.name}")


def _ball_ends(tibia: RigidLink, axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "balls 3"]:
    """Return the point of each collision sphere farthest from the tibia's axis."""
    balls = [
        (tibia.poses[link.name] @ [*ball[:3], 1.0], ball[3])
        for link in tibia.links
        for ball in link.balls
    ]
    centres = np.reshape([X[:3] for X, _ in balls], (-1, 3))
    outward = centres - np.outer(centres @ axis, axis)
    length = np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    return centres + np.reshape([radius for _, radius in balls], (-1, 1)) * outward / length


def _radii(
    axis: Float[np.ndarray, "3"], points: Float[np.ndarray, "points 3"]
) -> Float[np.ndarray, " points"]:
    """Return distances of points of the tibia's frame from the tibia's axis."""
    return np.asarray(np.linalg.norm(points - np.outer(points @ axis, axis), axis=1))
