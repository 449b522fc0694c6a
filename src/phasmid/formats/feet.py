"""Feet of the legs: from an option, a link of the file, a ball, or the tip of a mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.formats.chains import Chain
from phasmid.formats.findings import Findings, mm
from phasmid.formats.tree import RigidLink
from phasmid.units import plain_number

NAMES = ("foot", "feet", "tip", "toe", "end", "ee")
"""Words that name the end of a leg, as parts of a link's name."""

AT_THE_END = 0.9
"""Part of the way to the tip of a link's shapes at which a ball is at its end."""

TIP = 1e-3
"""Corners of a mesh within this of the farthest one are its tip, and a foot within this of the
centre of a ball is at its centre [m]: drawings state millimetres."""

BEYOND = 0.05
"""Part by which shapes may reach beyond a link that is the foot, such as soles."""

PRINTED = 1e-9
"""Angles and lengths below this are round-off and not mentioned [rad, m]."""

EXAMPLE = 'foot = "1-3=0,0,-0.13; 4-6=0,0,0.13"'


@dataclass(frozen=True, eq=False)
class Foot:
    """The foot of a leg: a point of the tibia's first link [m], and its source in words.

    The radius is that of the ball about it [m]; 0: it is a point.
    """

    point: Float[np.ndarray, "3"]
    source: str
    radius: float = 0.0


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
    tibia = chain.links[2]
    foot = _named(number, tibia, place) if place else _linked(tibia)
    if foot is not None:
        foot = _rounded(number, tibia, foot, findings)
    if foot is None or not (place or foot.radius or _is_at_the_end(number, chain, foot, findings)):
        return _found(number, chain, findings)
    return foot


def _is_at_the_end(number: int, chain: Chain, foot: Foot, findings: Findings) -> bool:
    """Return whether a link is at the end of a leg; a finding where its shapes reach farther.

    Exporters of drawings give all parts of a leg one frame, which may be anywhere in them.
    """
    axis, corners = _axis_and_corners(chain)
    end, own = _distances(axis, corners).max(initial=0.0), _distances(axis, foot.point[None])[0]
    if end <= own * (1 + BEYOND):
        return True
    what = (
        f"the frame of its foot link is {mm(own)} from the tibia's axis, and its shapes reach to "
        f"{mm(end)}: the link was not taken for the foot."
    )
    name = foot.source.removeprefix("link ")
    # What the names of all legs' links end in.
    hint = f"--foot {name[name.rfind('_') :] if '_' in name else name}, to take it"
    findings.suspect(f"leg {number}", what, chain.links[2].links[0].where, hint)
    return False


def _axis_and_corners(chain: Chain) -> tuple[np.ndarray, np.ndarray]:
    """Return the tibia's axis, and the corners of its shapes, in the frame of its first link."""
    axis = chain.joints[2].axis / np.linalg.norm(chain.joints[2].axis)
    parts = [part.vertices for part in chain.links[2].parts]
    return axis, np.concatenate([np.empty((0, 3)), *parts])


def common_radius(feet: Sequence[float], findings: Findings) -> float:
    """Return the radius of all feet [m], the mean where their balls differ."""
    smallest, largest = min(feet), max(feet)
    if largest - smallest <= PRINTED:
        return smallest
    if smallest <= PRINTED:
        what = (
            f"some are balls, of up to {mm(largest)}, and some points; all were taken for points, "
            "the balls at their centres."
        )
        findings.suspect("feet", what, hint='foot = "0,0,-0.13", changed to the foot of all legs')
        return 0.0
    mean = sum(feet) / len(feet)
    error = max(largest - mean, mean - smallest)
    findings.suspect(
        "feet",
        f"their balls have radii of {mm(smallest)} to {mm(largest)}; every foot has the mean, "
        f"{mm(mean)}, which places the ground up to {mm(error)} too high or too low.",
    )
    return mean


def foot_places(option: str, count: int) -> list[str]:
    """Return the part of the option `ImportOptions.foot` for each leg; empty for one without."""
    if "=" not in option:
        return [option] * count
    places = [""] * count
    for entry in filter(None, (part.strip() for part in option.split(";"))):
        legs, _, place = entry.partition("=")
        first, _, last = legs.strip().partition("-")
        last = last or first
        if not (first.isdecimal() and last.isdecimal() and place.strip()):
            what = (
                f'foot is "{entry}"; it must be numbers of legs, =, and a link\'s name or three '
                "numbers."
            )
            raise InvalidInput(what, where="option --foot", hint=EXAMPLE)
        if not 1 <= int(first[:4]) <= int(last[:4]) <= count:
            what = f'there is no leg "{legs.strip()}"; legs are 1 to {count}.'
            raise InvalidInput(what, where="option --foot", hint=EXAMPLE)
        for number in range(int(first), int(last) + 1):
            places[number - 1] = place.strip()
    return places


def names_a_foot(name: str) -> bool:
    """Return whether a word of a name means a foot, such as ``foot_3`` or ``lf_toe``."""
    words = "".join(c if c.isalpha() else " " for c in name.lower()).split()
    return any(word in NAMES or word.endswith(("foot", "tip", "toe")) for word in words)


def _named(number: int, tibia: RigidLink, place: str) -> Foot:
    """Return the foot of an option: a point, or a link by its name or its ending."""
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
                hint='foot = "0,0,-0.13"',
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


def _linked(tibia: RigidLink) -> Foot | None:
    """Return the foot of a link by its name, or of the only massless one."""
    named = [link for link in tibia.ends if names_a_foot(link.name)]
    massless = [
        link
        for link in tibia.ends
        if (link.inertial is None or not link.inertial.mass) and not link.parts
    ]
    for links in (named, massless):
        if len(links) == 1:
            return Foot(tibia.poses[links[0].name][:3, 3], f"link {links[0].name}")
    return None


def _rounded(number: int, tibia: RigidLink, foot: Foot, findings: Findings) -> Foot:
    """Return a foot as the centre of the ball that holds its point, if one does.

    The ball touches the ground, wherever in it the file puts the foot.
    """
    centres, radii = _balls(tibia)
    away = np.linalg.norm(centres - foot.point, axis=1)
    if not (radii - away > -TIP).any():
        return foot
    ball = int(np.argmax(radii - away))
    radius, moved = float(radii[ball]), float(away[ball])
    if moved > TIP:
        findings.note(
            f"leg {number}",
            f"its foot is {mm(moved)} from the centre of a ball of radius "
            f"{mm(radius)}; that centre was taken.",
            tibia.links[0].where,
        )
    return Foot(centres[ball], f"{foot.source}, a ball of radius {mm(radius)}", radius)


def _found(number: int, chain: Chain, findings: Findings) -> Foot:
    """Return the ball at the end of the last link, or the tip of its shapes."""
    tibia = chain.links[2]
    where = tibia.links[0].where
    axis, corners = _axis_and_corners(chain)
    centres, radii = _balls(tibia)
    away, end = _distances(axis, corners), _distances(axis, centres) + radii
    if len(centres) and end.max() >= AT_THE_END * away.max(initial=0.0):
        report, source = findings.note, "ball"
        ball = int(np.argmax(end))
        point, radius = centres[ball], float(radii[ball])
        touches = f", of radius {mm(radius)}"
    elif len(corners):
        report, source, radius = findings.suspect, "tip of the shape", 0.0
        tip = corners[away >= away.max() - TIP]
        point = (tip.min(axis=0) + tip.max(axis=0)) / 2
        touches = ""
    else:
        raise InvalidRobot(
            f"leg {number}: its foot is not given; its last link has neither a fixed link at its "
            "end nor a shape.",
            where=where,
            hint='foot = "0,0,-0.13", changed to where it touches, in metres in each last link',
        )
    what = (
        f"no foot in the file; the {source} of its last link was taken, "
        f"{1000 * _distances(axis, point[None])[0]:.1f} mm from the tibia's axis{touches}."
    )
    shown = ",".join(plain_number(length) for length in np.round(point, 4) + 0.0)
    hint = f'foot = "{shown}", in metres in each last link, changed to where it touches'
    report(f"leg {number}", what, where, hint)
    return Foot(point, f"{source} of {tibia.name}", radius)


def _balls(tibia: RigidLink) -> tuple[np.ndarray, np.ndarray]:
    """Return centres in the tibia's frame and radii of its balls [m]."""
    balls = [
        (*(tibia.poses[link.name] @ [*ball[:3], 1.0])[:3], ball[3])
        for link in tibia.links
        for ball in link.balls
    ]
    rows = np.reshape(balls, (-1, 4))
    return rows[:, :3], rows[:, 3]


def _distances(
    axis: Float[np.ndarray, "3"], points: Float[np.ndarray, "points 3"]
) -> Float[np.ndarray, " points"]:
    """Return distances of points of the tibia's frame from the tibia's axis."""
    return np.asarray(np.linalg.norm(points - np.outer(points @ axis, axis), axis=1))
