"""Walks that can be made, near one that was refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from typing import Any, TypeAlias

import numpy as np

from phasmid.arguments import checked
from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.gait import gaits_of
from phasmid.motion import walk
from phasmid.motion.walk import Walk, checked_course, is_plain
from phasmid.toml import toml_value

Changes: TypeAlias = dict[str, Any]
"""Other values of a scenario, by its keys."""

BISECTIONS = 12
"""Bisections of a share, to a millimetre of a metre."""

COARSE = (0.75, 0.5, 0.25)
"""Shares that are tried on uneven ground, where each plan takes up to a second."""

SMALLEST_SHARE, SMALLEST_STEP, SMALLEST_TURN = 0.1, 0.01, math.radians(1)
"""Least share of a step or lift that is proposed; of large ones the least way [m], turn [rad]."""

SLOWEST = 50.0
"""Largest factor of a period that is proposed."""

SWAYS = (0.1, 0.06, 0.14, 0.18, 0.0)
"""Sways that are tried, that of the library's crawl first."""

DUTY_FACTORS = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95)
"""Duty factors that are tried."""

NEARER = np.linspace(0.6, 1.4, 9)
"""Factors of distance and depth of the neutral feet that are tried."""


@checked
def plan(scenario: ScenarioLike | Experiment) -> Walk:
    """Plan the walk of a scenario.

    Args:
        scenario: The scenario, or its experiment. The walk begins in mid-gait: legs of phase 0
            lift at once.

    Returns:
        The walk at the samples of the scenario, both ends of each cycle included.

    Raises:
        InvalidInput: That is no scenario.
        InfeasibleWalk: The step is too long for a leg or too fast for its servos, the robot is
            not stable, or a leg finds no foothold on uneven ground. Where some change makes the
            walk possible, the hint has its numbers.
        InvalidRobot: The robot is impossible.
        InvalidGait: The gait does not fit the robot.
    """
    experiment = built(scenario)
    try:
        return walk.plan(experiment)
    except InfeasibleWalk as error:
        if not error.hint:
            error.advise(partial(remedy, experiment))
        raise


def remedy(experiment: Experiment) -> str:
    """Return the first change with which a walk can be planned, such as ``period = 0.49``.

    Args:
        experiment: Its walk is refused.
    """
    is_level = is_plain(experiment.world.planned_terrain)
    for changes in _level_changes(experiment) if is_level else _uneven_changes(experiment):
        if _can_be_made(experiment, changes):
            return ", ".join(f"{key} = {toml_value(value)}" for key, value in changes.items())
    return "another gait, a shorter step, or a wider stance"


def _can_be_made(experiment: Experiment, changes: Changes) -> bool:
    try:
        checked_course(experiment.replace(**changes))
    except InvalidInput:
        return False
    return True


def _level_changes(experiment: Experiment) -> Iterator[Changes]:
    """Yield changes of a walk on level ground, those that keep most of it first."""
    can_be_made = partial(_can_be_made, experiment)
    yield _nearest(lambda x: _slower(experiment, SLOWEST**x), can_be_made)
    stride = experiment.course.stride
    way, turn = math.hypot(stride.step_length, stride.step_sideways), abs(stride.step_turn)
    least = max(_part(SMALLEST_STEP, way), _part(SMALLEST_TURN, turn))
    lowest = _part(SMALLEST_STEP, stride.step_height)
    yield _nearest(lambda x: _shorter(experiment, 1 - x * (1 - least)), can_be_made)
    yield _nearest(lambda x: _lower(experiment, 1 - x * (1 - lowest)), can_be_made)
    yield _nearest(lambda x: _smaller(experiment, 1 - x * (1 - min(least, lowest))), can_be_made)
    servo = experiment.robot.servo
    if servo.voltage < servo.rated_voltage:
        yield {"voltage": servo.rated_voltage}
    if servo.torque_limit < experiment.file_robot.servo.torque_limit:
        yield {"torque_limit": 1.0}
    yield from _gaits(experiment)
    for x, factor in product(COARSE, (2.0, 5.0, 20.0)):
        yield _shorter(experiment, x) | _slower(experiment, factor)
    yield from _stances(experiment)


def _uneven_changes(experiment: Experiment) -> Iterator[Changes]:
    """Yield changes of a walk on uneven ground."""
    for x in COARSE:
        yield _slower(experiment, 1 / x)
        yield _shorter(experiment, x)
    yield {"step_height_mm": math.ceil(1500 * experiment.course.stride.step_height)}
    yield {"planned_on": "level"}


def _part(least: float, size: float) -> float:
    """Return the share of a size from which it is proposed; 0 where it is nothing."""
    return min(SMALLEST_SHARE, least / size) if size else 0.0


def _nearest(make: Callable[[float], Changes], can_be_made: Callable[[Changes], bool]) -> Changes:
    """Return the least change that helps, of those that grow from 0 to 1."""
    low, high = 0.0, 1.0
    if not can_be_made(make(high)):
        return make(high)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if can_be_made(make(middle)) else (middle, high)
    return make(high)


def _slower(experiment: Experiment, factor: float) -> Changes:
    return {"period": math.ceil(100 * experiment.course.stride.period * factor - 1e-9) / 100}


def _shorter(experiment: Experiment, share: float) -> Changes:
    """Return steps of another size, in whole millimetres and tenths of a degree."""
    ahead, left, turn = share * experiment.course.stride.step * [1000, 1000, math.degrees(1)]
    steps = {"step_length_mm": math.trunc(ahead), "step_sideways_mm": math.trunc(left)}
    steps |= {"step_turn_deg": math.trunc(10 * turn) / 10}
    return {key: value for key, value in steps.items() if value}


def _lower(experiment: Experiment, share: float) -> Changes:
    return {"step_height_mm": math.trunc(1000 * share * experiment.course.stride.step_height)}


def _smaller(experiment: Experiment, share: float) -> Changes:
    return _shorter(experiment, share) | _lower(experiment, share)


def _gaits(experiment: Experiment) -> Iterator[Changes]:
    """Yield other gaits where the present one is of the library, else other numbers."""
    gait, library = experiment.course.gait, gaits_of(len(experiment.robot.legs))
    if gait == library.get(gait.name):
        yield from ({"gait": name} for name in library)
    else:
        yield from ({"duty_factor": duty} for duty in DUTY_FACTORS if duty > gait.duty_factor)
    for sway in SWAYS:
        yield {"sway": sway}


def _stances(experiment: Experiment) -> Iterator[Changes]:
    """Yield stances, those near to the robot's own first."""
    robot = experiment.replace(stance_radius=None, body_height=None).robot
    x, y, z = np.mean([leg.R_level_hip @ leg.neutral_foot for leg in robot.legs], axis=0)
    radius, height = math.hypot(x, y), robot.foot_radius - z
    for wide, deep in sorted(product(NEARER, NEARER), key=lambda f: abs(f[0] - 1) + abs(f[1] - 1)):
        yield {
            "stance_radius_mm": round(1000 * wide * radius),
            "body_height_mm": round(1000 * deep * height),
        }
