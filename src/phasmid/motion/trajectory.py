"""Joint angles over time that somebody else planned or measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.robot import JOINTS, Robot

LARGEST_ANGLE = 2 * math.pi
"""No joint of a leg turns further; a number beyond it is in degrees."""


@dataclass(frozen=True, eq=False)
class JointTrajectory:
    """Joint angles of a robot over time, joined by cubic splines: C2, natural at both ends.

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
        for name in ("time", "q"):
            array = np.array(getattr(self, name), dtype=float)
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
        _check_time(self.time)
        _check_finite(self.robot, self.q)
        _check_unit(self.robot, self.q)
        _check_jumps(self.robot, self.time, self.q)
        _check_limits(self.robot, self.q)

    @property
    def duration(self) -> float:
        """From the first row to the last [s]."""
        return float(self.time[-1] - self.time[0])

    def angles(
        self, time: Float[np.ndarray, " times"]
    ) -> tuple[Float[np.ndarray, "times legs 3"], ...]:
        """Joint angles and their first two derivatives at other times.

        Args:
            time: Times from the trajectory's beginning [s], shape (M,); beyond its end the last
                angles are held.

        Returns:
            Angles [rad], velocities [rad/s], accelerations [rad/s²], each of shape (M, L, 3).
        """
        time = np.asarray(time, dtype=float)
        inside = (time >= 0) & (time <= self.duration)
        at = np.clip(time, 0.0, self.duration) + self.time[0]
        rates = (inside[:, None, None] * self._spline(at, order) for order in (1, 2))
        return (self._spline(at), *rates)

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.time, self.q, axis=0, bc_type="natural")


def joint_names(robot: Robot) -> tuple[str, ...]:
    """Every joint as ``leg.joint``, leg by leg."""
    return tuple(f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS)


def _check_time(time: Float[np.ndarray, " time"]) -> None:
    if not np.isfinite(time).all():
        row = int(np.argmin(np.isfinite(time)))
        raise InvalidInput(f"trajectory row {row + 1}, column time: not a finite number.")
    late = np.diff(time) <= 0
    if late.any():
        row = int(np.argmax(late)) + 1
        raise InvalidInput(
            f"trajectory row {row + 1}: time {time[row]:.3f} s does not follow "
            f"{time[row - 1]:.3f} s."
        )


def _first(bad: np.ndarray) -> tuple[int, int]:
    """Row and column of the first that is bad, of an array with a row per time."""
    row, column = np.argwhere(bad.reshape(len(bad), -1))[0]
    return int(row), int(column)


def _check_finite(robot: Robot, q: Float[np.ndarray, "time legs 3"]) -> None:
    if not np.isfinite(q).all():
        row, column = _first(~np.isfinite(q))
        raise InvalidInput(
            f"trajectory row {row + 1}, column {joint_names(robot)[column]}: not a finite number."
        )


def _check_unit(robot: Robot, q: Float[np.ndarray, "time legs 3"]) -> None:
    far = np.abs(q)
    if far.max() > LARGEST_ANGLE:
        _, column = _first(far == far.max())
        raise InvalidInput(
            f"{joint_names(robot)[column]} reaches {far.max():.3g} rad.", hint='unit = "deg"'
        )


def _check_jumps(
    robot: Robot, time: Float[np.ndarray, " time"], q: Float[np.ndarray, "time legs 3"]
) -> None:
    jump, limit = np.diff(q, axis=0), robot.servo.no_load_speed
    speed = np.abs(jump) / np.diff(time)[:, None, None]
    if speed.max() > limit:
        row, column = _first(speed == speed.max())
        size = abs(float(jump.reshape(len(jump), -1)[row, column]))
        raise InfeasibleWalk(
            f"{joint_names(robot)[column]} jumps {size:.2g} rad between rows {row + 1} and "
            f"{row + 2} ({speed.max():.3g} rad/s; the servo {robot.servo.name} allows "
            f"{limit:.3g})."
        )


def _check_limits(robot: Robot, q: Float[np.ndarray, "time legs 3"]) -> None:
    lower, upper = robot.arrays.joint_limits[..., 0], robot.arrays.joint_limits[..., 1]
    over = np.maximum(q - upper, lower - q)
    # A measured angle at the stop may read a hair beyond it.
    if over.max() > 1e-3:
        row, column = _first(over == over.max())
        leg, joint = divmod(column, 3)
        low, high = np.degrees(robot.legs[leg].joint_limits[joint])
        raise InfeasibleWalk(
            f"trajectory row {row + 1} turns {joint_names(robot)[column]} to "
            f"{math.degrees(q[row, leg, joint]):.1f}°; its limits are {low:.4g}° to {high:.4g}°."
        )
