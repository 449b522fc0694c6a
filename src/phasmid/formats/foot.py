"""Where a leg's foot is: named by a person, a frame of the file, a ball, or the tip of a mesh."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.formats.chains import Chain
from phasmid.formats.findings import Finding, Severity

NAMES = ("foot", "feet", "tip", "toe", "end", "ee")
"""Words that name the end of a leg, as parts of a link's name."""

AT_THE_END = 0.9
"""Part of the way to the tip of a link's shapes at which a sphere is at its end."""

TIP = 1e-3
"""Corners of a mesh within this of the farthest one are its tip [m]."""


def foot_of(
    chain: Chain, option: str, number: int
) -> tuple[Float[np.ndarray, "3"], str, tuple[Finding, ...]]:
    """The foot in the frame of the tibia's first link.

    Args:
        chain: The leg.
        option: As `ImportOptions.foot`.
        number: The leg's number, for messages.

    Returns:
        Foot [m], shape (3,); where it comes from, in words; what to know about it.

    Raises:
        InvalidInput: The option names no link of this leg, or is no point.
        InvalidRobot: Nothing tells where the foot is.
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
            return tibia.poses[found[0].name][:3, 3], f"link {found[0].name}", ()
    ball = _ball(chain, number)
    if ball is not None:
        return ball
    if tibia.parts:
        return _tip(chain, number)
    raise InvalidRobot(
        f"leg {number}: nothing says where its foot is; {tibia.name} has neither a fixed link at "
        "its end nor a shape.",
        where=tibia.links[0].where,
        hint="--foot 0,0,-0.13, in metres in that link's frame",
    )


def names_a_foot(name: str) -> bool:
    """Whether a word of a name means a foot, such as ``foot_3`` or ``lf_toe``."""
    words = "".join(c if c.isalpha() else " " for c in name.lower()).split()
    return any(word in NAMES or word.endswith(("foot", "tip", "toe")) for word in words)


def _asked(
    chain: Chain, option: str, number: int
) -> tuple[Float[np.ndarray, "3"], str, tuple[Finding, ...]]:
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
        return point, f"the point {option} in {tibia.name}", ()
    found = [name for name in tibia.poses if name == option]
    found = found or [name for name in tibia.poses if name.endswith(option)]
    if len(found) != 1:
        raise InvalidInput(
            f"leg {number}: {len(found) or 'no'} links at its end have a name that ends in "
            f'"{option}"; 1 is needed.',
            where="option --foot",
            hint=f"its links are {', '.join(list(tibia.poses)[:6])}",
        )
    return tibia.poses[found[0]][:3, 3], f"link {found[0]}", ()


def _tip(chain: Chain, number: int) -> tuple[Float[np.ndarray, "3"], str, tuple[Finding, ...]]:
    """The end of the tibia's mesh that is farthest from the tibia's axis."""
    tibia, axis = chain.links[2], chain.joints[2].axis / np.linalg.norm(chain.joints[2].axis)
    corners = np.concatenate([part.vertices for part in tibia.parts])
    away = _from(axis, corners)
    tip = corners[away >= away.max() - TIP]
    foot = (tip.min(axis=0) + tip.max(axis=0)) / 2
    what = (
        f"no foot in the file; taken from the tip of its last link's shape at {_told(foot, axis)}"
    )
    note = _note(Severity.SUSPECT, chain, number, what, foot)
    return foot, f"tip of the shape of {tibia.name}", (note,)


def _ball(
    chain: Chain, number: int
) -> tuple[Float[np.ndarray, "3"], str, tuple[Finding, ...]] | None:
    """The far end of the collision sphere at the end of the tibia; None without such a sphere."""
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
    note = _note(Severity.NOTE, chain, number, what, foot)
    return foot, f"collision sphere of {tibia.name}", (note,)


def _from(
    axis: Float[np.ndarray, "3"], points: Float[np.ndarray, "corners 3"]
) -> Float[np.ndarray, " corners"]:
    """Distances of points from an axis through the origin."""
    return np.asarray(np.linalg.norm(points - np.outer(points @ axis, axis), axis=1))


def _told(foot: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"]) -> str:
    # Without negative zeros.
    x, y, z = np.round(1000 * foot, 1) + 0.0
    away = 1000 * float(_from(axis, foot[None])[0])
    return f"({x:.1f}, {y:.1f}, {z:.1f}) mm, {away:.1f} mm from the tibia's axis."


def _note(severity: Severity, chain: Chain, number: int, what: str, foot: np.ndarray) -> Finding:
    point = ",".join(f"{length:.4g}" for length in np.round(foot, 4) + 0.0)
    return Finding(
        severity,
        f"leg {number}",
        what,
        where=chain.links[2].links[0].where,
        hint=f"--foot {point}, in metres in that link's frame, changed to where it touches",
    )
