"""Ways one after the other, gone forwards and backwards, turning round at any moment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from phasmid.control.sequences.joint_path import JointMotion, JointPath

TURNING_TIMES = np.geomspace(0.05, 4.0, 40)
"""Times for turning round that are tried, in shares of the way's own time."""

LOOKS = np.linspace(0.0, 1.0, 33)
"""Where a turn is looked at, in shares of its time."""

DONE = 1e-9
"""Rest of a time that is round-off, as a share of it."""


class Route:
    """Ways one after the other; the joints are at rest where one ends and the next begins.

    Attributes:
        paths: The ways; each begins where the one before it ends.
        index: Which of them is being gone.
        forward: Whether it is gone towards its end.
    """

    def __init__(self, paths: Sequence[JointPath], *, backwards: bool = False) -> None:
        self.paths = tuple(paths)
        self.forward = not backwards
        self.index = len(self.paths) - 1 if backwards else 0
        self._wanted = self.forward
        self._begin()

    def _begin(self) -> None:
        """Set out on a way, from rest."""
        self._state = (0.0 if self.forward else 1.0, 0.0, 0.0)
        self._plan(self._state, self.paths[self.index].duration)

    def _plan(self, state: tuple[float, float, float], duration: float) -> None:
        goal = 1.0 if self.forward else 0.0
        self._duration, self._elapsed = duration, 0.0
        self._curve = quintic(*state, goal, np.array([duration]))[0]

    @property
    def path(self) -> JointPath:
        """The way that is being gone."""
        return self.paths[self.index]

    @property
    def finished(self) -> bool:
        """Whether the last way has been gone, or the first one back."""
        last = len(self.paths) - 1 if self.forward else 0
        return self.index == last and self._elapsed >= self._duration

    def turn(self, *, forward: bool) -> None:
        """Go the other way from now on, as soon as that can be done smoothly within the limits."""
        self._wanted = forward

    def advance(self, dt: float) -> JointMotion:
        """Go on for some time [s].

        Returns:
            The joints there; at rest at the end where the route is finished.
        """
        if self._wanted != self.forward:
            self._turn()
        self._elapsed += dt
        while self._elapsed >= self._duration * (1 - DONE):
            following = self.index + (1 if self.forward else -1)
            if not 0 <= following < len(self.paths):
                self._elapsed = self._duration
                break
            self._elapsed -= self._duration
            left, self.index = self._elapsed, following
            self._begin()
            self._elapsed = max(left, 0.0)
        if self._elapsed >= self._duration:
            self._state = (1.0 if self.forward else 0.0, 0.0, 0.0)
        else:
            self._state = _evaluated(self._curve, self._elapsed)
        return self.path.at(*self._state)

    def _turn(self) -> None:
        """Plan back to where the present way was begun; from rest that is never refused."""
        path = self.path
        if self._elapsed >= self._duration or self._elapsed == 0.0:
            self.forward = self._wanted
            goal = 1.0 if self.forward else 0.0
            self._plan(self._state, 0.0 if self._state[0] == goal else path.duration)
            return
        durations = path.duration * TURNING_TIMES
        goal = 1.0 if self._wanted else 0.0
        curves = quintic(*self._state, goal, durations)
        s, rate, bend = np.moveaxis(_along(curves, durations), 1, 0)
        first, second = path.steepness
        inside = (s > -1e-9).all(axis=1) & (s < 1 + 1e-9).all(axis=1)
        slow = (first * np.abs(rate) <= path.speed).all(axis=1)
        soft = first * np.abs(bend) + second * rate**2 <= path.acceleration * (1 + 1e-9)
        possible = np.flatnonzero(inside & slow & soft.all(axis=1))
        if len(possible):
            best = int(possible[0])
            self.forward = self._wanted
            self._duration, self._elapsed = float(durations[best]), 0.0
            self._curve = curves[best]


def quintic(
    s: float, rate: float, bend: float, goal: float, durations: Float[np.ndarray, " times"]
) -> Float[np.ndarray, "times 6"]:
    """Powers of time, lowest first, of the quintics from a state to rest at a goal.

    Args:
        s: Where it begins.
        rate: Its first derivative there.
        bend: Its second derivative there.
        goal: Where it ends.
        durations: How long each takes [s]; none where it is 0.

    Returns:
        Coefficients, shape (N, 6).
    """
    T = np.where(durations > 0, durations, 1.0)
    v, a = rate * T, bend * T * T
    way = goal - s
    third = 10 * way - 6 * v - 1.5 * a
    fourth = -15 * way + 8 * v + 1.5 * a
    fifth = 6 * way - 3 * v - 0.5 * a
    one = np.ones_like(T)
    return np.stack(
        [s * one, rate * one, bend / 2 * one, third / T**3, fourth / T**4, fifth / T**5], axis=-1
    )


def _evaluated(c: Float[np.ndarray, "6"], t: float) -> tuple[float, float, float]:
    c0, c1, c2, c3, c4, c5 = c.tolist()
    return (
        c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
        c1 + t * (2 * c2 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5))),
        2 * c2 + t * (6 * c3 + t * (12 * c4 + t * 20 * c5)),
    )


def _along(
    curves: Float[np.ndarray, "times 6"], durations: Float[np.ndarray, " times"]
) -> Float[np.ndarray, "times 3 looks"]:
    """Each curve and its first two derivatives at the looks."""
    t = durations[:, None] * LOOKS
    c = curves[:, :, None]
    s, rate, bend = _horner(c, t), 0 * t, 0 * t
    for n in range(1, 6):
        rate = rate + n * c[:, n] * t ** (n - 1)
    for n in range(2, 6):
        bend = bend + n * (n - 1) * c[:, n] * t ** (n - 2)
    return np.stack([s, rate, bend], axis=1)


def _horner(c: np.ndarray, t: np.ndarray) -> np.ndarray:
    s = 0 * t
    for n in range(5, -1, -1):
        s = s * t + c[:, n]
    return s
