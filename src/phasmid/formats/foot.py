"""Feet of the legs: from an option, a frame of the file, a sphere, or the tip of a mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

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

MOVED = 0.1
"""Part of a tibia's length from which on a foot that an option moves is noted."""

EXAMPLE = '--foot "1-3=0,0,-0.13; 4-6=0,0,0.13"'


@dataclass(frozen=True, eq=False)
class Foot:
    """The foot of a leg.

    Attributes:
        point: In the frame of the tibia's first link [m], shape (3,).
        source: Where it comes from, in words.
        notes: Findings about it.
    """

    point: Float[np.ndarray, "3"]
    source: str
    notes: tuple[Finding, ...] = ()


def feet_of(
    names: Sequence[str], chains: Sequence[Chain], option: str, findings: list[Finding]
) -> list[Foot | PhasmidError]:
    """Find the feet of all legs.

    Args:
        names: Of the legs, in the robot's order.
        chains: Their hinges, in that order.
        option: As `ImportOptions.foot`.
        findings: Receives assumptions.

    Returns:
        The foot of each leg, or the reason why there is none.

    Raises:
        InvalidInput: The option names no leg, or one point for all legs fits only some of them.
    """
    places = _places(option, names)
    feet = [
        _foot_or_error(chain, place, number)
        for number, (chain, place) in enumerate(zip(chains, places, strict=True), 1)
    ]
    if "=" not in option and len(option.split(",")) == 3:
        _check_one_point(chains, feet, option, findings)
    for number, (chain, place, foot) in enumerate(zip(chains, places, feet, strict=True), 1):
        if isinstance(foot, Foot) and len(place.split(",")) == 3:
            findings += _moved(chain, foot, number)
    hint = feet_hint([None if isinstance(foot, PhasmidError) else foot.point for foot in feet])
    for foot in feet:
        if isinstance(foot, Foot):
            hint_of = f"{hint}, in metres in each leg's last link, changed to where it touches"
            findings += [replace(note, hint=hint_of) for note in foot.notes]
    return feet


def feet_hint(points: Sequence[Float[np.ndarray, "3"] | None]) -> str:
    """Write feet as an option: one point where it fits all legs, else one for each.

    Args:
        points: Foot of each leg in the frame of its tibia's first link [m], shape (3,); None for
            a leg that is left out.
    """
    legs: dict[str, list[int]] = {}
    for number, point in enumerate(points, 1):
        if point is not None:
            legs.setdefault(_text(point), []).append(number)
    if len(legs) == 1 and len(next(iter(legs.values()))) == len(points):
        return f"--foot {next(iter(legs))}"
    entries = (f"{_ranges(numbers)}={text}" for text, numbers in legs.items())
    return f'--foot "{"; ".join(entries)}"'


def _text(point: Float[np.ndarray, "3"]) -> str:
    return ",".join(plain_number(length) for length in np.round(point, 4) + 0.0)


def _ranges(numbers: list[int]) -> str:
    """Increasing numbers in short: 1-3,5."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ",".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)


def _places(option: str, names: Sequence[str]) -> list[str]:
    """Return the part of the option for each leg; empty for a leg without one."""
    if "=" not in option:
        return [option] * len(names)
    places = [""] * len(names)
    for entry in filter(None, (part.strip() for part in option.split(";"))):
        legs, equals, place = entry.partition("=")
        if not (equals and place.strip()):
            raise InvalidInput(
                f'foot is "{entry}"; it must be legs, =, and a link\'s name or three numbers.',
                where="option --foot",
                hint=EXAMPLE,
            )
        for index in _indices(legs, names):
            if places[index]:
                raise InvalidInput(f"leg {index + 1} has two feet.", where="option --foot")
            places[index] = place.strip()
    return places


def _indices(legs: str, names: Sequence[str]) -> list[int]:
    """Return indices of legs by name, number or range of numbers."""
    found: list[int] = []
    for leg in (part.strip() for part in legs.split(",")):
        first, dash, last = leg.partition("-")
        ends = (first.strip(), last.strip()) if dash else (leg, leg)
        numbers = [int(end) for end in ends if end.isdecimal() and len(end) < 4]
        if leg in names:
            found.append(names.index(leg))
        elif len(numbers) == 2 and 1 <= numbers[0] <= numbers[1] <= len(names):
            found += range(numbers[0] - 1, numbers[1])
        else:
            raise InvalidInput(
                f'there is no leg "{leg}"; legs are 1 to {len(names)}, or {", ".join(names[:8])}.',
                where="option --foot",
                hint=EXAMPLE,
            )
    return found


def _foot_or_error(chain: Chain, option: str, number: int) -> Foot | PhasmidError:
    try:
        return foot_of(chain, option, number)
    except PhasmidError as error:
        return error


def _check_one_point(
    chains: Sequence[Chain],
    feet: Sequence[Foot | PhasmidError],
    option: str,
    findings: list[Finding],
) -> None:
    """Compare the effect of one point for all legs on each of them.

    Raises:
        InvalidInput: It moves some feet much farther than others from where the file has them.
    """
    given = [foot.point for foot in feet if isinstance(foot, Foot)]
    if len(given) < len(feet):
        return
    tries = [_foot_or_error(chain, "", number) for number, chain in enumerate(chains, 1)]
    own = [foot for foot in tries if isinstance(foot, Foot)]
    points = [foot.point for foot in own]
    if len(points) == len(chains):
        moved = np.linalg.norm(np.array(given) - points, axis=1)
        length = float(np.linalg.norm(points, axis=1).max())
        near, far = int(np.argmin(moved)), int(np.argmax(moved))
        if moved[far] - moved[near] > UNLIKE * length:
            raise InvalidInput(
                f"one foot for all legs, {option}, stands {plain_number(1000 * moved[near], 3)} mm "
                f"from where the file has it on leg {near + 1} and "
                f"{plain_number(1000 * moved[far], 3)} mm on leg {far + 1} ({own[far].source}); "
                "the frames of their last links differ.",
                where="option --foot",
                hint=feet_hint(points),
            )
        return
    # Without feet in the file, legs of one shape point alike where all joints are at 0.
    directions = [_outward(chain, point) for chain, point in zip(chains, given, strict=True)]
    unlike = [
        number
        for number, direction in enumerate(directions, 1)
        if np.linalg.norm(direction - directions[0]) > UNLIKE * np.linalg.norm(given[0])
    ]
    if unlike:
        alike = [_inward(chain, directions[0]) for chain in chains]
        findings.append(
            Finding(
                Severity.SUSPECT,
                f"leg{'s' if len(unlike) > 1 else ''} {_ranges(unlike)}",
                f"one foot for all legs, {option}, lies in another direction here than on leg 1 "
                "where all joints are at 0; the frames of their last links may differ.",
                where="option --foot",
                hint=feet_hint(alike),
            )
        )


def _moved(chain: Chain, foot: Foot, number: int) -> list[Finding]:
    """Note that an option puts a foot far from where the file has one."""
    own = _foot_or_error(chain, "", number)
    if not isinstance(own, Foot) or any(note.severity is Severity.SUSPECT for note in own.notes):
        return []
    moved = float(np.linalg.norm(foot.point - own.point))
    if moved <= MOVED * np.linalg.norm(own.point):
        return []
    what = f"its foot was put {plain_number(1000 * moved, 3)} mm from where the file has it."
    return [Finding(Severity.NOTE, f"leg {number}", what, where="option --foot")]


def _axes(chain: Chain) -> Float[np.ndarray, "2 3"]:
    """Outward from the hip to the tibia's joint, level, and up; in the trunk, shape (2, 3)."""
    out = (chain.poses[2, :3, 3] - chain.hip) * [1, 1, 0]
    if not np.linalg.norm(out) > TIP:
        out = chain.hip * [1, 1, 0]
    return np.array([out / max(float(np.linalg.norm(out)), TIP), [0.0, 0.0, 1.0]])


def _outward(chain: Chain, point: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2"]:
    """A foot from its tibia's frame, outward and up at joint angles 0 [m], shape (2,)."""
    return np.asarray(_axes(chain) @ chain.poses[2, :3, :3] @ point)


def _inward(chain: Chain, direction: Float[np.ndarray, "2"]) -> Float[np.ndarray, "3"]:
    """The foot that lies so outward and up at joint angles 0, in the tibia's frame [m]."""
    return np.asarray(chain.poses[2, :3, :3].T @ _axes(chain).T @ direction)


def foot_of(chain: Chain, option: str, number: int) -> Foot:
    """Find the foot of one leg.

    Args:
        chain: The leg.
        option: A link's name or its ending, or three numbers; empty to look in the file.
        number: The leg's number, for messages.

    Raises:
        InvalidInput: The option names no link of this leg, or is no point.
        InvalidRobot: The foot cannot be found.
    """
    tibia = chain.links[2]
    if option:
        return _asked(chain, option, number)
    named = [link for link in tibia.ends if names_a_foot(link.name)]
    massless = [
        link
        for link in tibia.ends
        if (link.inertial is None or not link.inertial.mass) and not link.parts
    ]
    for found in (named, massless):
        if len(found) == 1:
            return Foot(tibia.poses[found[0].name][:3, 3], f"link {found[0].name}")
    ball = _ball(chain, number)
    if ball is not None:
        return ball
    if tibia.parts:
        return _tip(chain, number)
    raise InvalidRobot(
        f"leg {number}: its foot is not given; {tibia.name} has neither a fixed link at "
        "its end nor a shape.",
        where=tibia.links[0].where,
        hint="--foot 0,0,-0.13, in metres in that link's frame",
    )


def names_a_foot(name: str) -> bool:
    """Return whether a word of a name means a foot, such as ``foot_3`` or ``lf_toe``."""
    words = "".join(c if c.isalpha() else " " for c in name.lower()).split()
    return any(word in NAMES or word.endswith(("foot", "tip", "toe")) for word in words)


def _asked(chain: Chain, option: str, number: int) -> Foot:
    tibia = chain.links[2]
    pieces = option.split(",")
    if len(pieces) == 3:
        try:
            point = np.array([float(piece) for piece in pieces])
        except ValueError:
            point = np.full(3, math.nan)
        if not (np.isfinite(point).all() and np.abs(point).max() <= 2):
            raise InvalidInput(
                f"foot is {option}; it must be a link's name or three numbers in metres, "
                "each of at most 2.",
                where="option --foot",
                hint="--foot 0,0,-0.13",
            )
        return Foot(point, f"the point {option} in {tibia.name}")
    found = [name for name in tibia.poses if name == option]
    found = found or [name for name in tibia.poses if name.endswith(option)]
    if len(found) != 1:
        raise InvalidInput(
            f"leg {number}: {len(found) or 'no'} links at its end have a name that ends in "
            f'"{option}"; 1 is needed.',
            where="option --foot",
            hint=f"its links are {', '.join(list(tibia.poses)[:6])}",
        )
    return Foot(tibia.poses[found[0]][:3, 3], f"link {found[0]}")


def _tip(chain: Chain, number: int) -> Foot:
    """Find the end of the tibia's mesh that is farthest from the tibia's axis."""
    tibia, axis = chain.links[2], chain.joints[2].axis / np.linalg.norm(chain.joints[2].axis)
    corners = np.concatenate([part.vertices for part in tibia.parts])
    away = _from(axis, corners)
    tip = corners[away >= away.max() - TIP]
    foot = (tip.min(axis=0) + tip.max(axis=0)) / 2
    what = (
        f"no foot in the file; taken from the tip of its last link's shape at {_told(foot, axis)}"
    )
    note = _note(Severity.SUSPECT, chain, number, what)
    return Foot(foot, f"tip of the shape of {tibia.name}", (note,))


def _ball(chain: Chain, number: int) -> Foot | None:
    """Find the far end of the collision sphere at the end of the tibia; None without one."""
    tibia, axis = chain.links[2], chain.joints[2].axis / np.linalg.norm(chain.joints[2].axis)
    ends = []
    for link in tibia.links:
        X = tibia.poses[link.name]
        for *centre, radius in link.balls:
            point = X[:3, :3] @ np.array(centre) + X[:3, 3]
            outward = point - (point @ axis) * axis
            distance = float(np.linalg.norm(outward))
            if distance > 0:
                ends.append((distance + radius, point + radius * outward / distance))
    if not ends:
        return None
    distance, foot = max(ends, key=lambda end: end[0])
    corners = [part.vertices for part in tibia.parts]
    if corners and distance < AT_THE_END * float(_from(axis, np.concatenate(corners)).max()):
        return None
    what = (
        "no foot in the file; taken from the far end of the collision sphere of its last link, at "
        f"{_told(foot, axis)}"
    )
    note = _note(Severity.NOTE, chain, number, what)
    return Foot(foot, f"collision sphere of {tibia.name}", (note,))


def _from(
    axis: Float[np.ndarray, "3"], points: Float[np.ndarray, "corners 3"]
) -> Float[np.ndarray, " corners"]:
    """Return distances of points from an axis through the origin."""
    return np.asarray(np.linalg.norm(points - np.outer(points @ axis, axis), axis=1))


def _told(foot: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"]) -> str:
    # Without negative zeros.
    x, y, z = np.round(1000 * foot, 1) + 0.0
    away = 1000 * float(_from(axis, foot[None])[0])
    return f"({x:.1f}, {y:.1f}, {z:.1f}) mm, {away:.1f} mm from the tibia's axis."


def _note(severity: Severity, chain: Chain, number: int, what: str) -> Finding:
    return Finding(severity, f"leg {number}", what, where=chain.links[2].links[0].where)
