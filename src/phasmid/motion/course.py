"""The course of a walk over level or uneven ground: motion of trunk and feet at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from phasmid.errors import InfeasibleWalk
from phasmid.experiment import Experiment, Stride
from phasmid.gait import Gait, sway
from phasmid.kinematics import body_height, neutral_feet, step_pose
from phasmid.motion.curves import Path, blend
from phasmid.motion.feet import (
    coxa_only_feet,
    foothold,
    in_body,
    mid_stance,
    straight_feet,
    swing_fraction,
)
from phasmid.motion.footholds import Footholds, choose_footholds, holding_friction
from phasmid.motion.posture import Postures, fit_postures, leaning_trunk
from phasmid.motion.rolling import Rolling, rolling
from phasmid.motion.swing import Swings, plan_swings
from phasmid.motion.trunk import TrunkMotion, between_events, progress, swayed, trunk_motion
from phasmid.robot import Robot
from phasmid.terrain import Ground

EARLIEST = -2
"""Number of the first planned cycle: a swing at the start may come from its foothold."""


@dataclass(frozen=True, eq=False)
class LevelCourse:
    """Motion of trunk and feet over level ground.

    Attributes:
        robot: The robot, L legs.
        gait: The gait.
        stride: Steps, heights, times and curves.
    """

    robot: Robot
    gait: Gait
    stride: Stride

    def motion(self, time: Float[np.ndarray, " time"]) -> tuple[TrunkMotion, Path]:
        """Return the motion of the trunk, and of the feet in the body frame.

        Args:
            time: Times [s], shape (N,).
        """
        robot, gait, stride = self.robot, self.gait, self.stride
        trunk = _level_trunk(robot, gait, stride, body_height(robot), time)
        if stride.stance_law == "straight":
            return trunk, straight_feet(robot, gait, stride, time, trunk, self._rolling)
        return trunk, coxa_only_feet(robot, gait, stride, time, _height_over_feet(robot))

    @cached_property
    def _rolling(self) -> Rolling | None:
        """How the balls at the feet roll; None for points."""
        robot, gait, stride = self.robot, self.gait, self.stride
        if not robot.foot_radius:
            return None

        def feet(time: np.ndarray, rolled: Rolling | None) -> tuple[TrunkMotion, Path]:
            trunk = _level_trunk(robot, gait, stride, body_height(robot), time)
            return trunk, straight_feet(robot, gait, stride, time, trunk, rolled)

        def heading(time: np.ndarray) -> np.ndarray:
            steps = mid_stance(gait, swing_fraction(gait, stride, time)[0])
            return np.asarray(step_pose(stride.step, steps)[..., 2])

        return rolling(robot, gait, stride.period, feet, heading)


@dataclass(frozen=True, eq=False)
class UnevenCourse:
    """Footholds, swings and postures of a walk from its start to a time.

    Attributes:
        experiment: The experiment.
        robot: The robot, L legs.
        gait: The gait.
        end: End of the course [s].
        footholds: Footholds of each leg by cycle, from `EARLIEST`.
        swings: Swings from each foothold to the next.
        postures: Postures by event of the gait.
    """

    experiment: Experiment
    robot: Robot
    gait: Gait
    end: float
    footholds: Footholds
    swings: Swings
    postures: Postures

    def motion(self, time: Float[np.ndarray, " time"]) -> tuple[TrunkMotion, Path]:
        """Return the motion of the trunk, and of the feet in the body frame.

        Args:
            time: Times up to the end [s], shape (N,).
        """
        gait, stride = self.gait, self.experiment.course.stride
        whole, index, s = between_events(gait, stride, time / stride.period)
        seconds = np.diff(np.append(gait.events, 1.0))[index] * stride.period
        event = whole.astype(int) * len(gait.events) + index
        level = _level_trunk(self.robot, gait, stride, 0.0, time)
        trunk = leaning_trunk(
            self.postures, event, s.over(seconds), level, _height_over_feet(self.robot)
        )
        return trunk, in_body(self._feet(time), trunk)

    def _feet(self, time: Float[np.ndarray, " time"]) -> Path:
        """Return the feet in world axes."""
        stride = self.experiment.course.stride
        cycle, u = swing_fraction(self.gait, stride, time)
        swings = self.swings.at((cycle - EARLIEST - 1).astype(int))
        return swings.feet(stride.curve, u, self.gait.swing_fraction * stride.period)


def _height_over_feet(robot: Robot) -> float:
    """Return the height of the body frame over the mean neutral foot [m]."""
    return body_height(robot) - robot.foot_radius


def _level_trunk(
    robot: Robot,
    gait: Gait,
    stride: Stride,
    height: float,
    time: Float[np.ndarray, " time"],
) -> TrunkMotion:
    """Return the motion of a level trunk with its sway."""
    trunk = trunk_motion(stride.step, height, progress(gait, stride, time))
    if gait.sway:
        trunk = swayed(trunk, sway(gait, neutral_feet(robot), stride.period, np.asarray(time)))
    return trunk


def plan_course(experiment: Experiment, end: float) -> UnevenCourse:
    """Plan footholds, swings and postures of a walk on uneven ground.

    The feet are the centres of balls on the ground where they are no points.

    Args:
        experiment: Its robot, course and planned terrain are used.
        end: End of the course [s].

    Raises:
        InfeasibleWalk: The feet slide by the stance law or for lack of friction, a leg finds no
            foothold, or strikes the ground in its swing.
    """
    robot, gait, stride = experiment.robot, experiment.course.gait, experiment.course.stride
    terrain = experiment.world.planned_terrain.raised(robot.foot_radius)
    if stride.stance_law != "straight":
        raise InfeasibleWalk(
            f"{place(experiment)} feet cannot slide as the stance law "
            f"{stride.stance_law} has them.",
            hint='stance_law = "straight", or planned_on = "level"',
        )
    # A run may end half a time step later.
    last = math.floor((end + experiment.solver.time_step) / stride.period + 1e-9) + 1
    cycle = np.arange(EARLIEST, last + 1.0)[:, None]
    lift = (np.asarray(gait.offsets) + cycle) * stride.period
    land = lift + gait.swing_fraction * stride.period
    footholds = _footholds(experiment, robot, gait, terrain, cycle)
    # From the swing towards each foothold to the end of the swing away from it.
    counted = (lift <= end) & (land + stride.period >= 0)
    missing = np.argwhere(counted & ~footholds.found)
    if len(missing):
        n, leg = missing[np.argmin(land[tuple(missing.T)])]
        x, y, _ = footholds.place[n, leg]
        raise InfeasibleWalk(
            f"{place(experiment, land[n, leg])} {robot.legs[leg].name} finds no foothold within "
            f"{1000 * experiment.course.footing.search_radius:g} mm of ({x:.3f}, {y:.3f}) m.",
        )
    _check_grip(experiment, terrain, footholds.place[counted][:, :2])
    ends = (footholds.place[:-1].reshape(-1, 3), footholds.place[1:].reshape(-1, 3))
    swings = plan_swings(terrain, experiment.course.footing, stride, *ends).reshaped(
        last - EARLIEST
    )
    struck = np.argwhere(counted[1:] & (land[1:] >= 0) & ~swings.clear)
    if len(struck):
        n, leg = struck[np.argmin(lift[1:][tuple(struck.T)])]
        raise InfeasibleWalk(
            f"{place(experiment, lift[n + 1, leg])} {robot.legs[leg].name} would strike the ground "
            "in its swing, or wait for too much of it."
        )
    postures = _postures(experiment, robot, gait, footholds, last)
    return UnevenCourse(experiment, robot, gait, end, footholds, swings, postures)


def _check_grip(
    experiment: Experiment, terrain: Ground, places: Float[np.ndarray, "places 2"]
) -> None:
    """Refuse ground on which every foot slides.

    Raises:
        InfeasibleWalk: The message has the friction that is enough for every foothold.
    """
    holding, friction = holding_friction(terrain, places), terrain.friction(*places.T)
    if (friction >= holding).any():
        return
    needed = math.ceil(100 * float(holding.max())) / 100
    raise InfeasibleWalk(
        f"{place(experiment)} every foot would slide: friction is {float(friction.max()):g} at the "
        f"most, and the slope takes {needed:g}.",
        hint=f'friction = {needed:g}, or planned_on = "level" to see it slide',
    )


def place(experiment: Experiment, time: float | None = None) -> str:
    """Return the ground and a time [s] in the words of a message."""
    words = f"on this {experiment.world.kind} terrain"
    if time is None:
        return words
    return f"{words} at {time:.2f} s" if time > 0 else f"{words} at the start"


def _footholds(
    experiment: Experiment,
    robot: Robot,
    gait: Gait,
    terrain: Ground,
    cycle: Float[np.ndarray, "cycles 1"],
) -> Footholds:
    step, neutral = experiment.course.stride.step, neutral_feet(robot)
    # Steps of the body at mid-stance on each foothold.
    amid = (np.asarray(gait.offsets) + gait.swing_fraction + cycle) / gait.duty_factor + 0.5
    nominal = foothold(step, amid, neutral)
    ahead = foothold(step, amid + 1, neutral) - nominal
    outward = nominal - step_pose(step, amid)[..., :2]
    return choose_footholds(
        terrain, experiment.course.footing, nominal, _unit(ahead), _unit(outward)
    )


def _postures(
    experiment: Experiment, robot: Robot, gait: Gait, footholds: Footholds, cycles: int
) -> Postures:
    """Return the postures over all feet, standing and swinging, at the events of some cycles."""
    stride = experiment.course.stride
    events = np.append((np.arange(cycles)[:, None] + gait.events).ravel(), float(cycles))
    number, u = swing_fraction(gait, stride, events * stride.period)
    rows, legs = (number - EARLIEST).astype(int), np.arange(len(robot.legs))
    before, after = footholds.place[rows - 1, legs], footholds.place[rows, legs]
    feet = before + (after - before) * blend(stride.curve, u).position[..., None]
    trunk = step_pose(stride.step, events / gait.duty_factor)[:, :2]
    return fit_postures(experiment.course.footing, feet, trunk)


def _unit(v: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch 2"]:
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return v / np.where(length > 0, length, 1.0)
