"""The stance of a file's robot: the one that the file gives, or one with room for its steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot
from phasmid.formats.findings import Findings
from phasmid.formats.legs import UPRIGHT, FoundLeg
from phasmid.gait import default_gait
from phasmid.kinematics import (
    body_height,
    foot_position,
    hip_from_body,
    neutral_feet,
    trunk_clearance,
)
from phasmid.kinematics.leg import angles_and_margin
from phasmid.kinematics.workspace import LIMIT_TOLERANCE
from phasmid.motion import USUAL_STRIDE, blend, has_room_for, lift, longest_stride
from phasmid.robot import Robot
from phasmid.robot.leg import NEAREST_FOOT
from phasmid.units import plain_number

OUT, DOWN = 0.6, 0.4
"""A foot's distance from its coxa axis and below its hip, of the leg's length: those of the
PhantomX of this project, 150 and 100 mm with 250 mm of leg."""

BENEATH = 0.7
"""Depth of a foot below a hip whose coxa axis lies, of the leg's length."""

SPARES = math.radians(5.0), 0.02, 0.0
"""Angles that a leg keeps from its limits throughout a step, where it can; the second is that of
the controller [rad]."""

STRETCH = 0.98
"""Share of its length to which a leg is stretched at the most, where it can: the controller's."""

CLEARANCES = 0.02, 1e-3, -math.inf
"""Height of the trunk over the feet that is kept, where it can [m]: the controller's, and any; none
is needed where the trunk's shape is unknown."""

SHARES = 1.0, 0.75, 0.5, 0.25, 0.0
"""Shares of the usual step and lift that are tried."""

TRIED = 12
"""Stances whose whole cycle is planned, with the gait's sway, before the best of them is taken."""

LEVEL = 1e-6
"""Heights of feet that differ by less are one [m]."""


@dataclass(frozen=True, eq=False)
class Choice:
    """Feet for a robot.

    Attributes:
        feet: In the hip frames [m], shape (L, 3), ``out`` from the coxa axes and ``down`` below the
            body's origin [m].
        spare: Angle from the joint limits that a step leaves [rad].
        stride: A stride ahead for which there is room, at most the usual one [m].
    """

    feet: Float[np.ndarray, "legs 3"]
    out: float
    down: float
    spare: float
    stride: float


def with_stance(
    robot: Robot, legs: Sequence[FoundLeg], findings: Findings, file: str, *, is_solid: bool
) -> Robot:
    """Return a robot on the neutral feet that its file gives, or else on chosen ones.

    A trunk that is solid, as the file shows it, must stay above the feet.

    Raises:
        InvalidRobot: No stance is within the limits, or all have the trunk below the feet.
    """
    given = _given_stance(robot, legs, findings, is_solid=is_solid)
    if given is not None:
        return given
    choice, step = _chosen(robot, is_solid=is_solid), USUAL_STRIDE
    room = (
        f"a step of {1000 * step.step_length:.0f} mm and a lift of {1000 * step.step_height:.0f} mm"
    )
    fits = choice.stride >= step.step_length
    what = (
        f"{1000 * choice.out:.0f} mm out from the coxa axes and {1000 * choice.down:.0f} mm below "
        "the body's origin were chosen, as the file gives no stance: "
    )
    if fits:
        spare = plain_number(math.degrees(choice.spare), 2)
        what += f"there {room} keep {spare}° or more from the joint limits."
    else:
        most = f"{math.floor(1000 * choice.stride)} mm"
        what += f"no stance within the joint limits has room for {room}; here it is {most}."
    command = f"phasmid export --robot {file or 'FILE'} --out robot.toml"
    hint = f"{command}, and change neutral_foot_mm there"
    (findings.note if fits else findings.suspect)("neutral feet", what, hint=hint)
    return _on_feet(robot, choice.feet)


def _on_feet(robot: Robot, feet: Float[np.ndarray, "legs 3"]) -> Robot:
    legs = zip(robot.legs, feet, strict=True)
    return replace(robot, legs=tuple(replace(leg, neutral_foot=foot) for leg, foot in legs))


def _given_stance(
    robot: Robot, legs: Sequence[FoundLeg], findings: Findings, *, is_solid: bool
) -> Robot | None:
    """Return the robot in the stance of its file; None where it gives none that can be used."""
    joints = [joint for leg in legs for joint in leg.chain.joints]
    homes = [joint.home for joint in joints if joint.home is not None]
    subject, hint = "neutral feet", "correct the file's stance"
    if len(homes) < len(joints):
        if homes:
            what = (
                f"{len(homes)} of {len(joints)} joints have an angle of the stance; none was used."
            )
            findings.suspect(subject, what, hint=hint)
        return None
    angles = np.reshape(homes, (-1, 3))
    signs, offsets = np.array([leg.signs for leg in legs]), np.array([leg.offsets for leg in legs])
    q = np.remainder(signs * angles + offsets + np.pi, 2 * np.pi) - np.pi
    low, high = np.moveaxis(robot.arrays.joint_limits, -1, 0)
    feet = foot_position(robot.arrays, q)
    # Beyond round-off of digits that were written.
    outside = ((q < low - 1e-3) | (q > high + 1e-3)).ravel()
    if np.abs(angles).max() > 2 * np.pi:
        reason = "an angle is more than a turn; angles are radians"
    elif outside.any():
        first = joints[int(np.argmax(outside))]
        reason = (
            f"joint {first.name} would be at {plain_number(first.home or 0.0)} rad, outside its "
            "limits"
        )
    elif (feet[:, 0] < NEAREST_FOOT).any():
        reason = "a foot stands behind its hip"
    elif (q[:, 2] > LIMIT_TOLERANCE).any():
        reason = "its knees bend up, and this model's bend down"
    else:
        robot = _on_level_feet(robot, feet, findings)
        stride = longest_stride(robot, default_gait(len(robot.legs)))
        if is_solid and trunk_clearance(robot, body_height(robot), np.zeros(6)) <= 0:
            reason = "the trunk reaches below the feet"
        elif stride <= 0:
            reason = "a leg has no room for a lift"
        else:
            is_usual = stride >= USUAL_STRIDE.step_length
            what = f"the file's stance; its longest step is {math.floor(1000 * stride)} mm."
            (findings.note if is_usual else findings.suspect)(subject, what)
            return robot
    findings.suspect(subject, f"the file's stance was not used: {reason}.", hint=hint)
    return None


def _on_level_feet(robot: Robot, feet: Float[np.ndarray, "legs 3"], findings: Findings) -> Robot:
    """Return the robot with feet on one level: their mean, where they differ."""
    robot = _on_feet(robot, feet)
    p = neutral_feet(robot)
    spread = float(np.ptp(p[:, 2]))
    if spread < LEVEL:
        return robot
    what = f"differ by {plain_number(1000 * spread, 2)} mm in height; they were set level."
    (findings.note if spread < 0.005 else findings.suspect)("neutral feet", what)
    p[:, 2] = p[:, 2].mean()
    return _on_feet(robot, hip_from_body(robot, p))


def _chosen(robot: Robot, *, is_solid: bool) -> Choice:
    """Return feet with room for a step: nearest to the usual places, or else those with most.

    All legs stand equally far out, straight from the hips or else in the middle of the coxae's
    ranges; of stances that every leg can take, the one nearest to `OUT` and `DOWN`; beneath the
    hips, nearest to `BENEATH`, where all coxa axes lie.
    """
    out, down = _places(robot)
    straight = np.zeros(len(robot.legs))
    turns = [straight, np.array([leg.joint_limits[0].mean() for leg in robot.legs])]
    stances = [_feet_at(robot, out, down, turn) for turn in turns]
    heights = down + robot.foot_radius
    clearance = np.array([trunk_clearance(robot, height, np.zeros(6)) for height in heights])
    if not any(_has_room(robot, feet, 0.0, 0.0).any() for feet in stances):
        raise InvalidRobot(
            "no stance with knees up is within the joint limits.",
            hint="widen the limits, or check their signs",
        )
    gait, usual = default_gait(len(robot.legs)), USUAL_STRIDE
    for share in SHARES:
        room = [
            (spare, feet, _has_room(robot, feet, share, spare))
            for spare, feet in product(SPARES, stances)
        ]
        found = [
            (feet[n], out[n], down[n], spare)
            for least in (CLEARANCES[:2] if is_solid else CLEARANCES)
            for spare, feet, fits in room
            for n in np.flatnonzero(fits & (clearance >= least))
        ][:TRIED]
        for feet, r, h, spare in found:
            if has_room_for(_on_feet(robot, feet), gait, usual):
                return Choice(feet, float(r), float(h), spare, usual.step_length)
        if found:
            # The gait's sway takes room that the steps alone leave, or there is none for more.
            feet, r, h, spare = found[0]
            stride = longest_stride(_on_feet(robot, feet), gait)
            if stride > 0 or share == SHARES[-1]:
                return Choice(feet, float(r), float(h), spare, stride)
    raise InvalidRobot(
        "the trunk reaches below the feet in every stance within the joint limits.",
        hint="check the meshes of the trunk, and their unit",
    )


def _places(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return distances from the coxa axes and depths below the body's origin, the best first."""
    length = float(robot.arrays.lengths.sum(axis=1).mean())
    step = _round_step(length)
    count = math.ceil(length / step)
    lying = all(abs(leg.R_level_hip[2, 2]) < UPRIGHT for leg in robot.legs)
    wanted_out, wanted_down = (0.0, BENEATH) if lying else (OUT, DOWN)
    out = step * np.arange(0 if lying else 1, count + 1)
    down = step * np.arange(count + 1)
    r, h = (grid.ravel() for grid in np.meshgrid(out, down, indexing="ij"))
    wish = np.hypot(
        r - round(wanted_out * length / step) * step, h - round(wanted_down * length / step) * step
    )
    order = np.argsort(wish, kind="stable")
    return r[order], h[order]


def _round_step(length: float) -> float:
    """About a twentieth of a length, a round number."""
    # Lengths that are sums fall short of theirs by round-off.
    most = length / 20 * (1 + 1e-9)
    decade = 10.0 ** math.floor(math.log10(most))
    return max(m * decade for m in (1.0, 2.0, 5.0) if m * decade <= most)


def _feet_at(
    robot: Robot, out: np.ndarray, down: np.ndarray, turn: np.ndarray
) -> Float[np.ndarray, "places legs 3"]:
    """Return feet at distances from the coxa axes and depths, each leg turned about its hip."""
    feet = []
    for leg, angle in zip(robot.legs, turn, strict=True):
        level = np.stack([out, np.zeros(len(out)), -down - leg.mount_position[2]], axis=-1)
        x, y, z = (level @ leg.R_level_hip + [0.0, leg.lateral_offsets.sum(), 0.0]).T
        c, s = math.cos(angle), math.sin(angle)
        feet.append(np.stack([c * x - s * y, s * x + c * y, z], axis=-1))
    return np.stack(feet, axis=1)


def _has_room(
    robot: Robot, feet: Float[np.ndarray, "places legs 3"], share: float, spare: float
) -> np.ndarray:
    """Return for each place whether all legs have room for a share of the usual step and lift."""
    usual = USUAL_STRIDE
    u = np.linspace(0.0, 1.0, 13)
    way = (blend("quintic", u).position - 0.5) * share * usual.step_length
    height = lift("quintic", u).position * share * usual.step_height
    zero = np.zeros_like(way)
    swings = np.concatenate([np.stack([way, zero, height], 1), np.stack([zero, way, height], 1)])
    moves = np.concatenate([swings, -swings * [1, 1, 0]])
    room = np.ones(len(feet), dtype=bool)
    for n, leg in enumerate(robot.legs):
        p = feet[:, n, None] + moves @ leg.X_body_hip[:3, :3]
        q, margin = angles_and_margin(leg, p)
        low, high = leg.joint_limits.T
        # Of a narrow range a spare angle may leave nothing.
        kept = np.minimum(spare, (high - low) / 4)
        inside = ((q >= low + kept) & (q <= high - kept)).all(axis=-1)
        longest = (leg.lengths[1] + leg.lengths[2]) ** 2
        least = (1 - STRETCH**2) * longest if spare else 0.0
        room &= (inside & (margin >= least)).all(axis=1) & (feet[:, n, 0] >= NEAREST_FOOT)
    return room
