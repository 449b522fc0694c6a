"""Joint paths of posture sequences, followed within limits of speed and acceleration.

Planners make a `JointPath` from poses. The `Sequencer` follows paths with a `Route`, and the
commands of a manual leg with a `SetpointFilter`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.control.sequences.settings import SequenceSettings
from phasmid.control.targets import JointTargets
from phasmid.robot import Robot

QUINTIC_SPEED, QUINTIC_ACCELERATION = 15 / 8, 10 / math.sqrt(3)
"""Largest speed and acceleration of the quintic from rest to rest in unit time."""

REVERSAL_TIMES, REVERSAL_SAMPLES = np.geomspace(0.05, 4.0, 40), np.linspace(0.0, 1.0, 33)
"""Durations of a reversal to try, relative to the path's, and instants to check, relative to it."""

ROUND_OFF = 1e-9
"""Relative error of times and of path parameters."""

FILTER_PEAK, FILTER_SPEED = 4 * math.exp(-2), 0.98
"""Of `SetpointFilter`: largest acceleration per pole and unit speed of its input, and speed of the
input relative to the limit; the rest allows for finite steps."""

ARRIVED = 1e-7
"""Largest deviation of joints that have arrived at their target [rad]."""


@dataclass(frozen=True, eq=False)
class JointPath:
    """Twice differentiable path of all joints, by a path parameter s from 0 to 1.

    Attributes:
        spline: Joint angles [rad], shape (L, 3), as `scipy.interpolate.CubicSpline` of s times
            the number of pieces.
        speed: Largest joint speed [rad/s].
        acceleration: Largest joint acceleration [rad/s²].
    """

    spline: Any
    speed: float
    acceleration: float

    @classmethod
    def through(
        cls,
        q: Sequence[Float[np.ndarray, "legs 3"]] | Float[np.ndarray, "poses legs 3"],
        robot: Robot,
        settings: SequenceSettings,
        *,
        loaded: bool = False,
    ) -> JointPath:
        """Return the path through poses [rad] at equal steps of s, with the body's load or without.

        Two poses make a straight line.
        """
        # Lazy import: scipy.interpolate takes 0.2 s.
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(np.arange(len(q)), np.asarray(q))
        return cls(spline, settings.speed(robot, loaded=loaded), settings.acceleration)

    @cached_property
    def steepness(self) -> tuple[float, float]:
        """Largest first and second derivative of a joint angle with respect to s."""
        c3, c2, c1, _ = self.spline.c
        # The slope of a cubic is largest at an end of its piece or at its turning point.
        turn = np.clip(-c2 / np.where(c3 == 0, 1.0, 3 * c3), 0.0, 1.0)
        slopes = [c1, c1 + 2 * c2 + 3 * c3, c1 + turn * (2 * c2 + 3 * c3 * turn)]
        curvatures = [2 * c2, 2 * c2 + 6 * c3]
        n = len(c1)
        return n * float(np.abs(slopes).max()), n * n * float(np.abs(curvatures).max())

    @cached_property
    def duration(self) -> float:
        """Shortest time of a quintic s(t) from rest to rest within the limits [s].

        The acceleration of a joint is q' s'' + q'' s'². The sum of both largest values bounds it,
        and equals it on a straight line.
        """
        first, second = self.steepness
        bound = first * QUINTIC_ACCELERATION + second * QUINTIC_SPEED**2
        return max(first * QUINTIC_SPEED / self.speed, math.sqrt(bound / self.acceleration))

    def at(self, s: float, rate: float = 0.0) -> JointTargets:
        """Return joint angles and speeds at a path parameter and its rate [1/s]."""
        n = self.spline.c.shape[1]
        return JointTargets(self.spline(n * s), self.spline(n * s, 1) * (n * rate))


class Route:
    """Joint paths one after another, each from rest to rest, followed in both directions.

    Args:
        paths: Each begins where the one before it ends.
        backwards: Whether to begin at the end of the last path.

    Attributes:
        forward: Present direction.
        finished: Whether the last path in that direction has been followed to its end.
    """

    def __init__(self, paths: Sequence[JointPath], *, backwards: bool = False) -> None:
        self._paths, self.forward, self.finished = tuple(paths), not backwards, False
        self._index = len(self._paths) - 1 if backwards else 0
        self._plan((float(backwards), 0.0, 0.0), self._path.duration)

    @property
    def _path(self) -> JointPath:
        return self._paths[self._index]

    def _plan(self, state: tuple[float, float, float], duration: float) -> None:
        """Plan s(t) on the present path from s, its rate and its acceleration to rest."""
        self._state, self._duration, self._elapsed = state, duration, 0.0
        self._curve = _quintic(state, float(self.forward), np.array(duration))

    def advance(self, dt: float, *, forward: bool = True) -> JointTargets:
        """Advance by a time step [s]; a change of direction waits until the limits allow it."""
        if forward != self.forward:
            self._reverse()
        self._elapsed += dt
        while self._elapsed >= self._duration * (1 - ROUND_OFF):
            following = self._index + (1 if self.forward else -1)
            self.finished = not 0 <= following < len(self._paths)
            if self.finished:
                self._state = float(self.forward), 0.0, 0.0
                return self._path.at(self._state[0])
            rest, self._index = self._elapsed - self._duration, following
            self._plan((float(not self.forward), 0.0, 0.0), self._path.duration)
            self._elapsed = max(rest, 0.0)
        s, rate, acceleration = _evaluate(self._curve, self._elapsed)
        self._state = float(s), float(rate), float(acceleration)
        return self._path.at(*self._state[:2])

    def _reverse(self) -> None:
        """Plan back to where the present path began, if a quintic within the limits does so."""
        path, goal = self._path, float(not self.forward)
        if self._state[1:] == (0.0, 0.0):
            self.forward, self.finished = not self.forward, False
            self._plan(self._state, 0.0 if self._state[0] == goal else path.duration)
            return
        durations = path.duration * REVERSAL_TIMES
        curves = _quintic(self._state, goal, durations)
        s, rate, acceleration = _evaluate(curves[:, None], durations[:, None] * REVERSAL_SAMPLES)
        first, second = path.steepness
        joint_acceleration = first * np.abs(acceleration) + second * rate**2
        feasible = (
            (np.abs(s - 0.5) < 0.5 + ROUND_OFF)
            & (first * np.abs(rate) <= path.speed)
            & (joint_acceleration <= path.acceleration * (1 + ROUND_OFF))
        ).all(axis=1)
        if feasible.any():
            self.forward = not self.forward
            self._plan(self._state, float(durations[np.argmax(feasible)]))


def _quintic(
    state: tuple[float, float, float], goal: float, duration: Float[np.ndarray, "*batch"]
) -> Float[np.ndarray, "*batch 6"]:
    """Return coefficients, lowest power first, of quintics from a state to rest at a goal."""
    s, rate, acceleration = state
    T = np.where(duration > 0, duration, 1.0)
    d, v, a = goal - s, rate * T, acceleration * T * T
    third = (10 * d - 6 * v - 1.5 * a) / T**3
    fourth = (-15 * d + 8 * v + 1.5 * a) / T**4
    fifth = (6 * d - 3 * v - 0.5 * a) / T**5
    return np.stack(np.broadcast_arrays(s, rate, acceleration / 2, third, fourth, fifth), axis=-1)


def _evaluate(c: np.ndarray, t: Any) -> tuple[Any, Any, Any]:
    """Return quintics and their first two derivatives at times, broadcast."""
    c0, c1, c2, c3, c4, c5 = np.moveaxis(c, -1, 0)
    return (
        c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
        c1 + t * (2 * c2 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5))),
        2 * c2 + t * (6 * c3 + t * (12 * c4 + t * 20 * c5)),
    )


class SetpointFilter:
    """Joints that follow a changing target within speed and acceleration, without overshoot.

    The input moves towards the target at the speed limit, all joints of a leg in proportion.
    Three equal low-passes in series follow it; their pole bounds the acceleration. It begins at
    rest, with joint angles [rad] and limits of speed [rad/s] and acceleration [rad/s²].
    """

    def __init__(self, q: Float[np.ndarray, "legs 3"], speed: float, acceleration: float) -> None:
        self._input, self._q = q, q
        self._qd = self._qdd = 0 * q
        self._speed, self._pole = FILTER_SPEED * speed, acceleration / (FILTER_PEAK * speed)

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
