"""Joint paths of posture sequences, followed within limits of speed and acceleration.

Planners make a `JointPath` from poses. The `Sequencer` follows paths with a `Route`, and the
commands of a manual leg with a `SetpointFilter`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.experiment.targets import JointTargets
from phasmid.kinematics.shared_kernels import quintic
from phasmid.robot import Robot

SPEED_SHARE, LOADED_SHARE = 0.5, 0.2
"""Largest joint speed as a share of the servo's no-load speed, and while the feet move the body."""

ACCELERATION = 30.0
"""Largest joint acceleration [rad/s²]."""

QUINTIC_SPEED, QUINTIC_ACCELERATION = 15 / 8, 10 / math.sqrt(3)
"""Largest speed and acceleration of the quintic from rest to rest in unit time."""

REVERSAL_SHARE = 0.9
"""Share of the remaining acceleration for reversals; the rest allows for finite steps."""

FILTER_PEAK, FILTER_SPEED = 4 * math.exp(-2), 0.98
"""Of `SetpointFilter`: largest acceleration per pole and unit speed of its input, and speed of the
input relative to the limit; the rest allows for finite steps."""

ARRIVED = 1e-7
"""Largest deviation of joints that have arrived at their target [rad]."""


def largest_speed(robot: Robot, *, loaded: bool = False) -> float:
    """Return the largest joint speed of sequences [rad/s], with the body's load or without.

    All joints move together: it is that of the slowest one.
    """
    slowest = float(robot.arrays.no_load_speed.min())
    return (LOADED_SHARE if loaded else SPEED_SHARE) * slowest


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """Motion of all joints from rest to rest along a path, within the limits.

    Attributes:
        spline: Joint angles [rad], shape (L, 3), as `scipy.interpolate.CubicSpline` of the path
            parameter from 0 to 1.
        duration: Duration of the motion [s].
    """

    spline: Any
    duration: float

    @classmethod
    def through(
        cls,
        q: Sequence[Float[np.ndarray, "legs 3"]] | Float[np.ndarray, "poses legs 3"],
        robot: Robot,
        *,
        loaded: bool = False,
    ) -> JointPath:
        """Return the motion through poses [rad] at equal steps of the path parameter s.

        Two poses make a straight line. The acceleration of a joint is q' s'' + q'' s'². The sum of
        both largest values bounds it, and equals it on a straight line.
        """
        # Lazy import: scipy.interpolate takes 0.2 s.
        from scipy.interpolate import CubicSpline

        knots = np.linspace(0.0, 1.0, len(q))
        spline = CubicSpline(knots, np.asarray(q))
        curvature = float(np.abs(spline(knots, 2)).max())
        # The slope of a cubic is largest at an end of its piece or at its turning point.
        c3, c2, c1, _ = spline.c
        turn = np.clip(-c2 / np.where(c3 == 0, 1.0, 3 * c3), 0.0, knots[1])
        slope = max(
            float(np.abs(c1 + x * (2 * c2 + 3 * c3 * x)).max()) for x in (0.0, turn, knots[1])
        )
        bound = slope * QUINTIC_ACCELERATION + curvature * QUINTIC_SPEED**2
        shortest = slope * QUINTIC_SPEED / largest_speed(robot, loaded=loaded)
        return cls(spline, float(max(shortest, math.sqrt(bound / ACCELERATION))))

    def at(self, time: float, rate: float = 1.0) -> JointTargets:
        """Return joint angles and speeds at a time [s] of the motion that runs at a rate."""
        u = time / self.duration
        s, speed, _ = quintic(u)
        return JointTargets(self.spline(s), self.spline(s, 1) * (speed / self.duration * rate))


class Route:
    """Motions one after another, run forwards and backwards.

    The direction may change at any time: the rate at which the motions run then changes between
    1 and -1 as fast as the largest acceleration permits.

    Args:
        paths: Each begins where the one before it ends.
        backwards: Whether to begin at the end of the last path.

    Attributes:
        finished: Whether the end in the present direction is reached.
    """

    def __init__(self, paths: Sequence[JointPath], *, backwards: bool = False) -> None:
        self._paths, self.finished = paths, False
        self._starts = np.cumsum([0.0, *(path.duration for path in paths)])
        self._time = float(self._starts[-1]) if backwards else 0.0
        self._rate = -1.0 if backwards else 1.0

    def _at(self, time: float) -> tuple[JointPath, float]:
        """Return the path at a time [s] of the route, and the time on it [s]."""
        index = int(np.searchsorted(self._starts[1:-1], time, side="right"))
        return self._paths[index], time - float(self._starts[index])

    def _largest_change(self, time: float, direction: float) -> float:
        """Return how fast the rate may change in a direction at a time of the route [1/s]."""
        path, elapsed = self._at(time)
        u = min(max(elapsed / path.duration, 0.0), 1.0)
        _, speed, acceleration = quintic(u)
        rest = QUINTIC_ACCELERATION - max(direction * acceleration, 0.0)
        return REVERSAL_SHARE * rest / (max(speed, 1e-9) * path.duration)

    def advance(self, dt: float, *, forward: bool = True) -> JointTargets:
        """Advance by a time step [s] in a direction, or towards a change of direction."""
        before, goal, end = self._rate, 1.0 if forward else -1.0, float(self._starts[-1])
        if goal != before:
            steps = self._time, self._time + dt * before
            change = dt * min(self._largest_change(time, goal) for time in steps)
            self._rate += min(max(goal - before, -change), change)
        self._time = min(max(self._time + dt * (before + self._rate) / 2, 0.0), end)
        self.finished = self._time == (end if forward else 0.0)
        path, elapsed = self._at(self._time)
        return path.at(elapsed, self._rate)


class SetpointFilter:
    """Joints that follow a changing target within speed and acceleration, without overshoot.

    The input moves towards the target at the speed limit, all joints of a leg in proportion.
    Three equal low-passes in series follow it; their pole bounds the acceleration. It begins at
    rest, with joint angles [rad] and the largest speed [rad/s].
    """

    def __init__(self, q: Float[np.ndarray, "legs 3"], speed: float) -> None:
        self._input, self._q = q, q
        self._qd = self._qdd = 0 * q
        self._speed, self._pole = FILTER_SPEED * speed, ACCELERATION / (FILTER_PEAK * speed)

    def advance(self, target: Float[np.ndarray, "legs 3"], dt: float) -> JointTargets:
        """Advance by a time step [s] towards a target [rad]."""
        deviation = target - self._input
        farthest = np.abs(deviation).max(axis=1, keepdims=True)
        step = self._speed * dt
        self._input = self._input + deviation * np.where(
            farthest > step, step / np.maximum(farthest, step), 1.0
        )
        # The error of a third-order lag is exp(-w t) times a quadratic of time.
        w, e, v = self._pole, self._q - self._input, self._qd
        c1, c2 = v + w * e, (self._qdd + 2 * w * v + w * w * e) / 2
        p0, p1, p2 = e + dt * (c1 + dt * c2), c1 + 2 * dt * c2, 2 * c2
        decay = math.exp(-w * dt)
        self._q = self._input + decay * p0
        self._qd = decay * (p1 - w * p0)
        self._qdd = decay * (p2 - 2 * w * p1 + w * w * p0)
        return JointTargets(self._q, self._qd)

    def arrived(self, target: Float[np.ndarray, "legs 3"]) -> bool:
        """Return whether the joints rest at a target [rad]."""
        return bool(np.abs(self._q - target).max() < ARRIVED)
