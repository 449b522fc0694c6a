"""Feasibility of a plan: reach, joint speed and support."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from phasmid.errors import InfeasibleWalk
from phasmid.experiment import Experiment, Stride
from phasmid.gait import Gait, shortfall, support_margin
from phasmid.kinematics import (
    centre_of_mass,
    foot_violations,
    hip_from_body,
    joint_angles,
    within_reach,
)
from phasmid.motion.course import LevelCourse, UnevenCourse, place
from phasmid.robot import JOINTS, Robot
from phasmid.servo.servo import LEAST
from phasmid.servo.words import servo_words
from phasmid.units import beyond

CHECKED_SAMPLES = 60
"""Instants between two events of a gait at which a plan is checked, and its swings' middles."""

CYCLES_AT_ONCE = 20
"""Cycles of a walk over uneven ground that are checked at once."""

USUAL_STRIDE = Stride(period=1.0)
"""The stride of an experiment that states none; only its period is another."""

STRIDES, BISECTIONS = 17, 21
"""Strides that are tried up to twice the legs' length, and bisections of what is possible."""


def checked_times(
    experiment: Experiment, course: LevelCourse | UnevenCourse
) -> Iterator[Float[np.ndarray, " time"]]:
    """Yield the instants at which a plan is checked: one cycle of a periodic walk, else all.

    Yields:
        Times of some cycles [s].
    """
    phases, period = checked_phases(course.gait), experiment.course.stride.period
    if isinstance(course, LevelCourse):
        yield phases * period
        return
    count = math.ceil(course.end / period)
    for first in range(0, count, CYCLES_AT_ONCE):
        cycles = np.arange(first, min(first + CYCLES_AT_ONCE, count))
        times = ((cycles[:, None] + phases) * period).ravel()
        yield np.append(times[times < course.end], course.end)


def checked_phases(gait: Gait) -> Float[np.ndarray, " time"]:
    """Return phases of a cycle between which nothing happens.

    Between two neighbours of the gait's events and the tops of its lifts all motions are
    polynomials, however short the swing is.
    """
    tops = (np.asarray(gait.offsets) + gait.swing_fraction / 2) % 1.0
    edges = np.unique(np.concatenate([gait.events, tops, [1.0]]))
    shares = np.arange(CHECKED_SAMPLES) / CHECKED_SAMPLES
    return (edges[:-1, None] + np.diff(edges)[:, None] * shares).ravel()


def is_in_reach(course: LevelCourse | UnevenCourse, times: Float[np.ndarray, " time"]) -> bool:
    """Return whether all feet are within reach, and all joints within their limits."""
    feet = hip_from_body(course.robot, course.motion(times)[1].position)
    return bool(within_reach(course.robot, feet).all())


def has_room_for(robot: Robot, gait: Gait, stride: Stride) -> bool:
    """Return whether all legs have room for a stride on level ground throughout a cycle."""
    return is_in_reach(LevelCourse(robot, gait, stride), checked_phases(gait) * stride.period)


def is_supported(robot: Robot, gait: Gait, stride: Stride) -> bool:
    """Return whether the standing feet support the robot throughout a cycle on level ground.

    All feet must be within reach.
    """
    phases = checked_phases(gait)
    feet = LevelCourse(robot, gait, stride).motion(phases * stride.period)[1].position
    com = centre_of_mass(robot, joint_angles(robot.arrays, hip_from_body(robot, feet)))
    margin = support_margin(feet[..., :2], gait.stance(phases), com[..., :2])
    return bool((margin > 0).all())


def longest_stride(
    robot: Robot,
    gait: Gait,
    stride: Stride | None = None,
    direction: float = 0.0,
    *,
    supported: bool = False,
) -> float:
    """Longest straight step on level ground for which all legs have room throughout a cycle.

    Link lengths, joint limits, the gait's sway and the height of the swings count. Joint speeds and
    legs that touch each other do not.

    Args:
        robot: The robot, L legs.
        gait: The gait.
        stride: Its step height, stance and curve are used; default: `USUAL_STRIDE`'s.
        direction: Direction of travel in the body frame, 0 forward [rad].
        supported: Whether the standing feet must support the robot, too.

    Returns:
        Way of the body while a foot stands [m]; 0 where the robot cannot even step on the spot.
    """
    of_one_metre = {
        "step_length": math.cos(direction),
        "step_sideways": math.sin(direction),
        "step_turn": 0.0,
        "stance_law": "straight",
    }
    stride = (stride or USUAL_STRIDE).model_copy(update=of_one_metre)

    def is_possible(length: float) -> bool:
        step = stride.scaled(length)
        return has_room_for(robot, gait, step) and (
            not supported or is_supported(robot, gait, step)
        )

    longest = 2.0 * float(robot.arrays.lengths.sum(axis=1).max())
    return largest_possible(is_possible, np.linspace(0.0, longest, STRIDES))


def largest_possible(
    is_possible: Callable[[float], bool], tried: Float[np.ndarray, " values"]
) -> float:
    """Return the largest possible value, by bisection after the last possible one of those tried.

    Feet may leave their reach and enter it again: only the first gap counts.

    Args:
        is_possible: Whether a value is possible.
        tried: Values, increasing; the first where even that is impossible.
    """
    low = float(tried[0])
    for high in tried.tolist():
        if not is_possible(high):
            break
        low = high
    if high == low:
        # All of them are possible, or not even the first.
        return low
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if is_possible(middle) else (low, middle)
    return low


def check_reach(
    experiment: Experiment, course: LevelCourse | UnevenCourse, times: Float[np.ndarray, " time"]
) -> None:
    """Refuse feet out of reach.

    Raises:
        InfeasibleWalk: A foot is out of reach, or a joint beyond its limit.
    """
    if is_in_reach(course, times):
        return
    feet = hip_from_body(course.robot, course.motion(times)[1].position)
    far = np.where(
        within_reach(course.robot, feet) == 0, np.hypot(feet[..., 0], feet[..., 1]), -1.0
    )
    t, leg = _first_largest(far, axis=1)
    which = course.robot.legs[leg]
    what = f"is too much for {which.name}: {foot_violations(which, feet[t, leg])[0].reason}"
    if isinstance(course, UnevenCourse):
        step = f"step of {stride_words(experiment.course.stride.step)}"
        raise InfeasibleWalk(f"{place(experiment, times[t])} the {step} {what}.")
    raise InfeasibleWalk(f"{_too_far(course, times)} {what}.")


def _too_far(course: LevelCourse, times: Float[np.ndarray, " time"]) -> str:
    """Return the quantity without which all feet would be within reach, in words."""
    stride, gait = course.stride, course.gait
    step, lift = f"step of {stride_words(stride.step)}", f"step height of {_mm(stride.step_height)}"
    still, flat = stride.scaled(0), stride.model_copy(update={"step_height": 0.0})
    for words, without in (
        (step, replace(course, stride=still)),
        (lift, replace(course, stride=flat)),
        (f"sway of {gait.sway:g}", replace(course, gait=replace(gait, sway=0.0))),
        (f"{step} with a {lift}", replace(course, stride=flat.scaled(0))),
    ):
        if is_in_reach(without, times):
            return words
    return "neutral stance"


def _mm(length: float) -> str:
    return f"{1000 * length:.4g} mm"


def _first_largest(values: Float[np.ndarray, "*shape"], axis: int) -> tuple[int, ...]:
    """Return the index of the largest value, the first of equal ones along an axis.

    Robots are symmetric: without this, round-off would choose the leg that a message names.
    """
    near = values >= values.max() - 1e-9 * abs(values.max())
    found = np.argwhere(near)
    return tuple(int(i) for i in found[np.argmin(found[:, axis])])


def stride_words(step: np.ndarray, *, down: bool = False) -> str:
    """Return a stride in words; bounds are rounded down."""
    rounded = np.trunc if down else np.round
    length, turn = 1000 * math.hypot(step[0], step[1]), abs(math.degrees(step[2]))
    words = []
    if length > 0 or turn == 0:
        words.append(f"{float(rounded(length)):g} mm")
    if turn > 0:
        words.append(f"{float(rounded(10 * turn)) / 10:g}°")
    return " and ".join(words)


def check_speed(
    experiment: Experiment,
    course: LevelCourse | UnevenCourse,
    times: Float[np.ndarray, " time"],
    qd: Float[np.ndarray, "time legs 3"],
) -> None:
    """Refuse joint speeds above the joints' no-load speeds.

    Raises:
        InfeasibleWalk: A joint would turn faster than its servo without load.
    """
    servo, speed, limits = course.robot.servo, np.abs(qd), course.robot.arrays.no_load_speed
    if (speed <= limits).all():
        return
    t, leg, joint = _first_largest(speed / limits, axis=1)
    peak, limit = float(speed[..., leg, joint].max()), float(limits[leg, joint])
    when = f"{place(experiment, times[t])} " if isinstance(course, UnevenCourse) else ""
    needed, allowed = beyond(peak, limit if limit > LEAST else 0.0, 3)
    raise InfeasibleWalk(
        f"{when}joint {course.robot.legs[leg].name}.{JOINTS[joint]} would turn at {needed} "
        f"rad/s; the {servo_words(servo.name)} allows {allowed} rad/s{servo.supply_words}."
    )


def check_support(
    experiment: Experiment,
    course: LevelCourse | UnevenCourse,
    times: Float[np.ndarray, " time"],
    margin: Float[np.ndarray, " time"],
) -> None:
    """Refuse a centre of mass outside the support polygon.

    Raises:
        InfeasibleWalk: The robot would topple.
    """
    (worst,) = _first_largest(-margin, axis=0)
    if margin[worst] > 0:
        return
    when = f"at phase {times[worst] / experiment.course.stride.period:.2f}"
    if isinstance(course, UnevenCourse):
        when = place(experiment, times[worst])
    raise InfeasibleWalk(f"{when} {shortfall(margin[worst])}.")
