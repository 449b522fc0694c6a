"""A robot's leg kinematics and gait as a C header for microcontrollers.

The header is the template ``firmware.h``. Its functions are those of `kinematics.leg_kernels`.
"""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from string import Template

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, plain
from phasmid.kinematics.leg import STRETCH_TOLERANCE
from phasmid.kinematics.workspace import LIMIT_TOLERANCE
from phasmid.motion import Walk
from phasmid.robot import Leg

BETWEEN = 8
"""Parts of an interval between samples at which the interpolation is compared with the plan."""

DIGITS = 15
"""Digits of a constant after the point."""


def firmware_header(walk: Walk, *, command: str = "phasmid.formats.firmware_header") -> str:
    """Return a C header with the inverse kinematics of a robot's legs and its planned walk.

    Args:
        walk: The walk, on level ground. The table of joint angles has its samples of one cycle,
            without the last one, which is the first again.
        command: Origin of the header, for its first comment.

    Raises:
        InvalidInput: The plan follows uneven ground, so that no two cycles are equal.
    """
    if not walk.is_periodic:
        raise InvalidInput(
            f"the walk follows the terrain {walk.experiment.world.kind}; a gait table needs cycles "
            "that are all equal.",
            hint='terrain = "flat", or planned_on = "level"',
        )
    robot, gait, stride = walk.robot, walk.gait, walk.experiment.course.stride
    samples = stride.samples - 1
    phase = np.arange(samples * BETWEEN) / (samples * BETWEEN)
    fine = walk.sample(phase * stride.period)
    q, stance = fine.q[::BETWEEN], fine.stance[::BETWEEN]
    forward, left, turn = map(float, stride.step)
    words = (
        f"{gait.name} gait, step {1000 * forward:g} mm forward, {1000 * left:g} mm left, "
        f"{np.degrees(turn):g} deg turn, {1000 * stride.step_height:g} mm high"
    )
    template = Path(__file__).with_name("firmware.h").read_text(encoding="utf-8")
    return Template(template).substitute(
        robot=_comment(robot.name),
        command=_comment(command),
        version=version("phasmid"),
        walk=_comment(words),
        foot=_ball(robot.foot_radius),
        legs=len(robot.legs),
        samples=samples,
        period=stride.period,
        duty_factor=gait.duty_factor,
        offsets=_array(np.array(gait.offsets)),
        stretch_tolerance=STRETCH_TOLERANCE,
        limit_tolerance=LIMIT_TOLERANCE,
        leg_table="\n".join(_leg(number, leg) for number, leg in enumerate(robot.legs)),
        stance_table=_rows(stance.astype(int)),
        gait_table=_rows(q, "{: .7f}"),
        deviation=f"{_deviation(fine.q, q):.1e}",
    )


def _deviation(
    fine: Float[np.ndarray, "times legs 3"], q: Float[np.ndarray, "samples legs 3"]
) -> float:
    """Return the largest difference of interpolated from planned angles [rad]."""
    share = np.arange(BETWEEN)[:, None, None] / BETWEEN
    between = q[:, None] + share * (np.roll(q, -1, axis=0) - q)[:, None]
    return float(np.abs(between.reshape(fine.shape) - fine).max())


def _leg(number: int, leg: Leg) -> str:
    """Return the constants of a leg, one line for each member of ``phasmid_leg``."""
    members = (
        leg.lengths,
        leg.lateral_offsets.sum(),
        leg.X_body_hip[:3, :3],
        leg.mount_position,
        leg.neutral_foot,
        leg.joint_limits,
        # With the servos at zero, femur and tibia are raised by their bends.
        np.array([0.0, leg.femur_bend, leg.tibia_bend - leg.femur_bend]),
    )
    lines = [f"    {{ /* {number}: {_comment(leg.name)} */"]
    lines += [f"        {_array(member)}," for member in members]
    return "\n".join([*lines, "    },"])


def _ball(radius: float) -> str:
    """Return the line of the header on feet that are balls; empty for points."""
    if not radius:
        return ""
    return (
        f" *          The foot is the centre of a ball of radius {radius!r} m: on the ground it\n"
        " *          is that high above it.\n"
    )


def _rows(table: np.ndarray, form: str = "{!r}") -> str:
    """Return the rows of a table, one on each line."""
    return "\n".join(f"    {_array(row, form)}," for row in table)


def _array(values: np.ndarray | float, form: str = "{!r}") -> str:
    """Return numbers as a C initializer, nested as the array is, without round-off near zero."""
    if np.ndim(values):
        return f"{{ {', '.join(_array(value, form) for value in np.asarray(values))} }}"
    # Adding zero removes the sign of a negative zero.
    return form.format(round(np.asarray(values).item(), DIGITS) + 0)


def _comment(text: str) -> str:
    """Return a text on one line that neither ends nor begins a comment in C."""
    return plain(text).replace("*/", "* /").replace("/*", "/ *")
