"""Joint trajectories planned or measured elsewhere."""

from __future__ import annotations

import base64
import binascii
import math
import zlib
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_fields, numbers
from phasmid.csv_table import MOST_ROWS
from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.kinematics import body_from_hip, foot_position, rotated
from phasmid.motion.trunk import TrunkMotion
from phasmid.motion.walk import Walk
from phasmid.robot import JOINTS, Robot, robot_to_toml
from phasmid.servo.words import servo_words

LATEST = 1e10
"""Latest time of a row [s]; a clock that counts seconds from 1970 is at 2e9."""

SHORTEST = 1e-6
"""Shortest time from one row to the next [s]."""

LARGEST_ANGLE = 2 * math.pi
"""No joint of a leg turns further; a number beyond it is in degrees."""


@dataclass(frozen=True, eq=False)
class JointTrajectory:
    """Joint angles over time, interpolated by natural cubic splines.

    Attributes:
        robot: The robot, L legs.
        time: Times [s], increasing, shape (N,), N at least 2.
        q: Joint angles [rad], shape (N, L, 3).

    Raises:
        InvalidInput: Times do not increase, an angle is not finite or in degrees, shapes are wrong.
        InfeasibleWalk: A joint would pass its limits or be faster than its servo.
    """

    robot: Robot
    time: Float[np.ndarray, " time"]
    q: Float[np.ndarray, "time legs 3"]

    def __post_init__(self) -> None:
        check_fields(self)
        for name in ("time", "q"):
            array = numbers(getattr(self, name), name)
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        legs = len(self.robot.legs)
        if self.time.ndim != 1 or self.q.shape != (len(self.time), legs, 3):
            raise InvalidInput(
                f"trajectory has times of shape {self.time.shape} and angles of shape "
                f"{self.q.shape}; they must be (N,) and (N, {legs}, 3)."
            )
        if len(self.time) < 2:
            raise InvalidInput(f"trajectory has {len(self.time)} rows; it needs at least 2.")
        self._check_time()
        self._check_angles()

    def _check_time(self) -> None:
        time = self.time
        if not (np.abs(time) <= LATEST).all():
            row = int(np.argmin(np.abs(time) <= LATEST))
            raise InvalidInput(
                f"trajectory row {row + 1}: time is {time[row]:g} s; it must be a finite number, "
                f"{LATEST:g} s or less.",
                hint="times in seconds",
            )
        row = int(np.argmin(np.diff(time))) + 1
        if time[row] - time[row - 1] < SHORTEST:
            raise InvalidInput(
                f"trajectory row {row + 1}: time {time[row]:g} s does not follow "
                f"{time[row - 1]:g} s by {SHORTEST:g} s or more."
            )

    def _check_angles(self) -> None:
        """Refuse angles that are not finite, in degrees, or beyond the joints' speeds and limits.

        Raises:
            InvalidInput: An angle is not finite, or in degrees.
            InfeasibleWalk: A joint would pass its limits or be faster than its servo.
        """
        robot, q = self.robot, self.q.reshape(len(self.time), -1)
        joints, servo = joint_names(robot), robot.servo
        if not np.isfinite(q).all():
            row, column = _largest(~np.isfinite(q))
            raise InvalidInput(
                f"trajectory row {row + 1}, column {joints[column]}: not a finite number."
            )
        if np.abs(q).max() > LARGEST_ANGLE:
            row, column = _largest(np.abs(q))
            raise InvalidInput(
                f"{joints[column]} reaches {abs(q[row, column]):.3g} rad.",
                hint='unit = "deg"',
            )
        jump = np.abs(np.diff(q, axis=0))
        speed = jump / np.diff(self.time)[:, None]
        # Logs are replayed with the supply that they had, which no goal has to respect.
        rated = servo.rated_no_load_speed * np.ravel([leg.speed_ratio for leg in robot.legs])
        if (speed > rated).any():
            row, column = _largest(speed / rated)
            raise InfeasibleWalk(
                f"{joints[column]} jumps {jump[row, column]:.2g} rad between rows {row + 1} and "
                f"{row + 2} ({speed[row, column]:.3g} rad/s; the {servo_words(servo.name)} allows "
                f"{rated[column]:.3g})."
            )
        limits = robot.arrays.joint_limits.reshape(-1, 2)
        over = np.maximum(q - limits[:, 1], limits[:, 0] - q)
        # A measured angle at the stop may read slightly beyond it.
        if over.max() > 1e-3:
            row, column = _largest(over)
            low, high = np.degrees(limits[column])
            raise InfeasibleWalk(
                f"trajectory row {row + 1} turns {joints[column]} to "
                f"{math.degrees(q[row, column]):.1f}°; its limits are {low:.4g}° to {high:.4g}°."
            )

    @property
    def is_periodic(self) -> bool:
        """Return False: a trajectory has no known cycle."""
        return False

    def for_experiment(self, experiment: ScenarioLike | Experiment) -> JointTrajectory:
        """Return this trajectory of the robot as an experiment supplies it.

        Raises:
            InvalidInput: The robot differs.
            InfeasibleWalk: A joint would be faster than its servo.
        """
        robot = built(experiment).robot
        # Settings and supply of the servos may differ.
        own = replace(self.robot, servo=robot.servo)
        is_same_servo = self.robot.servo.name == robot.servo.name
        if not is_same_servo or robot_to_toml(robot) != robot_to_toml(own):
            raise InvalidInput(
                "the trajectory is of another robot than the scenario has.",
                hint="load_trajectory(path, scenario.load_robot())",
            )
        return replace(self, robot=robot)

    def sample(self, time: Float[np.ndarray, " times"]) -> SampledTrajectory:
        """Return the joints at other times, with a trunk at rest on its lowest feet.

        Args:
            time: Times from the trajectory's beginning [s], shape (M,).
        """
        time = np.asarray(time, dtype=float)
        feet = body_from_hip(self.robot, foot_position(self.robot.arrays, self.q[0]))
        still = np.zeros((len(time), 3))
        position = still + np.array([0.0, 0.0, -float(feet[:, 2].min())])
        trunk = TrunkMotion(position, still, still, still, still, still)
        return SampledTrajectory(self.robot, time, *self.angles(time), trunk)

    def channels(self, time: Float[np.ndarray, " times"]) -> dict[str, np.ndarray]:
        """Return the channels of a recording that follow from the trajectory."""
        q, qd, qdd = self.angles(np.asarray(time, dtype=float))
        return {
            "joint_position_target": q,
            "joint_velocity_target": qd,
            "joint_acceleration_target": qdd,
        }

    def to_text(self) -> str:
        """Return the trajectory as text, which `trajectory_from_text` reads."""
        table = np.column_stack([self.time, self.q.reshape(len(self.time), -1)])
        return base64.b64encode(zlib.compress(table.astype("<f8").tobytes())).decode()

    @property
    def duration(self) -> float:
        """Duration from the first row to the last [s]."""
        return float(self.time[-1] - self.time[0])

    def angles(
        self, time: Float[np.ndarray, " times"]
    ) -> tuple[
        Float[np.ndarray, "times legs 3"],
        Float[np.ndarray, "times legs 3"],
        Float[np.ndarray, "times legs 3"],
    ]:
        """Return joint angles and their first two derivatives at other times.

        Args:
            time: Times from the trajectory's beginning [s], shape (M,); beyond its end the last
                angles are held.

        Returns:
            Angles [rad], velocities [rad/s], accelerations [rad/s²], each of shape (M, L, 3).
        """
        time = np.asarray(time, dtype=float)
        inside = ((time >= 0) & (time <= self.duration))[:, None, None]
        at = np.clip(time, 0.0, self.duration) + self.time[0]
        velocity, acceleration = (inside * self._spline(at, order) for order in (1, 2))
        return self._spline(at), velocity, acceleration

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.time, self.q, axis=0, bc_type="natural")


@dataclass(frozen=True, eq=False)
class SampledTrajectory:
    """Samples of a trajectory.

    Attributes:
        robot: The robot, L legs.
        time: [s], shape (M,).
        q: Joint angles [rad], shape (M, L, 3).
        qd: Joint velocities [rad/s], shape (M, L, 3).
        qdd: Joint accelerations [rad/s²], shape (M, L, 3).
        trunk: Level and at rest, as high as the lowest foot at the beginning needs it.
    """

    robot: Robot
    time: Float[np.ndarray, " time"]
    q: Float[np.ndarray, "time legs 3"]
    qd: Float[np.ndarray, "time legs 3"]
    qdd: Float[np.ndarray, "time legs 3"]
    trunk: TrunkMotion

    @property
    def foot_position(self) -> Float[np.ndarray, "time legs 3"]:
        """Return the feet of a fixed trunk in world axes [m], shape (M, L, 3)."""
        p = body_from_hip(self.robot, foot_position(self.robot.arrays, self.q))
        return rotated(self.trunk.rotation[:, None], p) + self.trunk.position[:, None]


Motion: TypeAlias = Walk | JointTrajectory
"""Limits of motions that joints can follow."""

SampledMotion: TypeAlias = Walk | SampledTrajectory
"""The same at some times."""


def trajectory_from_text(text: str, robot: Robot) -> JointTrajectory:
    """Read the trajectory of `JointTrajectory.to_text`.

    Raises:
        InvalidInput: It is none of this robot.
    """
    width = 1 + 3 * len(robot.legs)
    try:
        unpacker = zlib.decompressobj()
        numbers = unpacker.decompress(base64.b64decode(text, validate=True), 8 * width * MOST_ROWS)
        table = np.frombuffer(numbers, "<f8").astype(np.float64).reshape(-1, width)
    except (binascii.Error, zlib.error, ValueError):
        raise InvalidInput("the recording's trajectory is not one of its robot.") from None
    return JointTrajectory(robot, table[:, 0], table[:, 1:].reshape(len(table), -1, 3))


def joint_names(robot: Robot) -> tuple[str, ...]:
    """Return the names of all joints as ``leg.joint``."""
    return tuple(f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS)


def _largest(values: np.ndarray) -> tuple[int, int]:
    """Return row and column of the largest value, the first of equal ones."""
    row, column = divmod(int(np.argmax(values)), values.shape[1])
    return row, column
