"""Feet of the legs: from an option, a link of the file, a sphere, or the tip of a mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, InvalidRobot, PhasmidError
from phasmid.formats.chains import Chain
from phasmid.formats.findings import Finding, Severity
from phasmid.units import plain_number

NAMES = ("foot", "feet", "tip", "toe", "end", "ee")
"""Words that name the end of a leg, as parts of a link's name."""

AT_THE_END = 0.9
"""Part of the way to the tip of a link's shapes at which a sphere is at its end."""

TIP = 1e-3
"""Corners of a mesh within this of the farthest one are its tip [m]."""

UNLIKE = 0.25
"""Part of a tibia's length by which one point for all legs may move one foot more than another."""

EXAMPLE = '--foot "1-3=0,0,-0.13; 4-6=0,0,0.13"'


@dataclass(frozen=True, eq=False)
class Foot:
    """The foot of a leg.

    Attributes:
        point: In the frame of the tibia's first link [m], shape (3,).
        source: Its source, in words.
        finding: A note or suspicion about it; None without one.
    """

    point: Float[np.ndarray, "3"]
    source: str
    finding: Finding | None = None


def feet_of(chains: Sequence[Chain], option: str) -> list[Foot | PhasmidError]:
    """Find the feet of all legs.

    Args:
        chains: Hinges of the legs, in the robot's order.
        option: As `ImportOptions.foot`.

    Returns:
        The foot of each leg, or the reason why there is none.

    Raises:
        InvalidInput: The option names no leg, or one point for all legs fits only some of them.
    """
    places = _places(option, len(chains))
    feet = [
        _foot_or_error(number, chain, place)
        for number, (chain, place) in enumerate(zip(chains, places, strict=True), 1)
    ]
    if option and "=" not in option and "," in option:
        _check_one_point(chains, feet, option)
    return feet


def _places(option: str, count: int) -> list[str]:
    """Return the part of the option for each leg; empty for a leg without one."""
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


def _foot_or_error(number: int, chain: Chain, place: str = "") -> Foot | PhasmidError:
    try:
        return _named(number, chain, place) if place else _found(number, chain)
    except PhasmidError as error:
        return error


def _check_one_point(
    chains: Sequence[Chain], feet: Sequence[Foot | PhasmidError], option: str
) -> None:
    """Refuse a point that moves some feet much farther than others from their place in the file."""
    own = [_foot_or_error(number, chain) for number, chain in enumerate(chains, 1)]
    pairs = [
        (foot.point, other.point)
        for foot, other in zip(feet, own, strict=True)
        if isinstance(foot, Foot) and isinstance(other, Foot)
    ]
    if len(pairs) < len(chains):
        return
    moved = [float(np.linalg.norm(a - b)) for a, b in pairs]
    length = max(float(np.linalg.norm(b)) for _, b in pairs)
    near, far = int(np.argmin(moved)), int(np.argmax(moved))
    if moved[far] - moved[near] > UNLIKE * length:
        points = "; ".join(f"{i}={_text(b)}" for i, (_, b) in enumerate(pairs, 1))
        raise InvalidInput(
            f"one foot for all legs, {option}, is {plain_number(1000 * moved[near], 3)} mm from "
            f"the file's on leg {near + 1} and {plain_number(1000 * moved[far], 3)} mm on leg "
            f"{far + 1}; the frames of their last links differ.",
            where="option --foot",
            hint=f'--foot "{points}"',
        )


def _text(point: Float[np.ndarray, "3"]) -> str:
    return ",".join(plain_number(length) for length in np.round(point, 4) + 0.0)


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


def _found(number: int, chain: Chain) -> Foot:
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
    corners = np.concatenate([np.empty((0, 3)), *(part.vertices for part in tibia.parts)])
    away = _radii(chain, corners)
    ball = _ball(chain)
    if ball is not None and _radii(chain, ball)[0] >= AT_THE_END * away.max(initial=0.0):
        severity, point, source = Severity.NOTE, ball[0], "collision sphere"
    elif len(corners):
        tip = corners[away >= away.max() - TIP]
        point = (tip.min(axis=0) + tip.max(axis=0)) / 2
        severity, source = Severity.SUSPECT, "tip of the shape"
    else:
        raise InvalidRobot(
            f"leg {number}: its foot is not given; {tibia.name} has neither a fixed link "
            "at its end nor a shape.",
            where=where,
            hint="--foot 0,0,-0.13, in metres in that link's frame",
        )
    what = (
        f"no foot in the file; the {source} of its last link was taken, "
        f"{1000 * _radii(chain, point[None])[0]:.1f} mm from the tibia's axis."
    )
    hint = f"--foot {_text(point)}, in metres in each leg's last link, changed to where it touches"
    return Foot(
        point,
        f"{source} of {tibia.name}",
        Finding(severity, f"leg {number}", what, where, hint),
    )


def _ball(chain: Chain) -> Float[np.ndarray, "1 3"] | None:
    """Return the outermost point of the tibia's collision spheres; None without one."""
    tibia, axis = chain.links[2], _axis(chain)
    ends = []
    for link in tibia.links:
        X = tibia.poses[link.name]
        for *centre, radius in link.balls:
            point = X[:3, :3] @ np.array(centre) + X[:3, 3]
            outward = point - (point @ axis) * axis
            distance = float(np.linalg.norm(outward))
            if distance > 0:
                ends.append((distance + radius, point + radius * outward / distance))
    return max(ends, key=lambda end: end[0])[1][None] if ends else None


def _axis(chain: Chain) -> Float[np.ndarray, "3"]:
    axis = chain.joints[2].axis
    return np.asarray(axis / np.linalg.norm(axis))


def _radii(chain: Chain, points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, " points"]:
    """Return distances of points of the tibia's frame from the tibia's axis."""
    axis = _axis(chain)
    return np.asarray(np.linalg.norm(points - np.outer(points @ axis, axis), axis=1))
