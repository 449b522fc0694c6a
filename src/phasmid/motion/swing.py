"""Swing of a foot over uneven ground, from one foothold to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from phasmid.experiment.course import Footing, StrideTable
from phasmid.motion.curves import Curve, Path, blend, lift, vector
from phasmid.terrain import Ground

PLACES = 161
"""Places along its way at which a swing is held against the ground."""

CLEARANCE = 0.1
"""A foot passes over ground beyond its footholds by this part of the step height or more."""

ASIDE = 0.001
"""Nearer to a foothold than this the ground is that of the foothold [m]."""

LONGEST_WAIT = 0.8
"""Largest part of a swing for which the foot goes up or down only."""

HIGHER = 4
"""How often a swing is lifted by another step height before it is given up."""

_U = np.linspace(0.0, 1.0, 2049)


class Swings(NamedTuple):
    """Shapes of swings; leading axes are cycle and leg.

    Attributes:
        start: Where it lifts off, in world axes [m], shape (..., 3).
        end: Where it lands [m], shape (..., 3).
        top: Highest point [m], shape (...).
        before: Part of its time for which the foot goes up before it goes along, shape (...).
        after: Part for which it only comes down, shape (...).
        clear: Whether it strikes nothing, shape (...).
    """

    start: Float[np.ndarray, "*batch 3"]
    end: Float[np.ndarray, "*batch 3"]
    top: Float[np.ndarray, "*batch"]
    before: Float[np.ndarray, "*batch"]
    after: Float[np.ndarray, "*batch"]
    clear: Bool[np.ndarray, "*batch"]

    @classmethod
    def over_level_ground(
        cls, start: Float[np.ndarray, "*batch 3"], end: Float[np.ndarray, "*batch 3"], height: float
    ) -> Swings:
        """Return swings without obstacles up to a height above their start [m]."""
        none = np.zeros(start.shape[:-1])
        return cls(start, end, start[..., 2] + height, none, none, none == 0)

    def at(self, rows: Int[np.ndarray, "time legs"]) -> Swings:
        """Return the swings of each leg in some cycles, shape (N, L)."""
        legs = np.arange(rows.shape[1])
        return Swings(*(values[rows, legs] for values in self))

    def reshaped(self, cycles: int) -> Swings:
        """Return swings in a row as those of cycles and legs, shape (C, L)."""
        return Swings(*(values.reshape(cycles, -1, *values.shape[1:]) for values in self))

    def path(self, curve: Curve, u: Float[np.ndarray, "*batch"]) -> Path:
        """Return the foot in world axes with derivatives by the fraction of the swing.

        Up to the top and down from it by one blend each; along by a third, which waits while
        obstacles are near. On level ground it waits for nothing.

        Args:
            curve: Polynomial of the blends.
            u: Fraction of the swing in time, in [0, 1], shape (...).
        """
        share = 1 - self.before - self.after
        along = blend(curve, np.clip((u - self.before) / share, 0.0, 1.0)).over(share)
        way = self.end - self.start
        x, y = (along * way[..., axis] + self.start[..., axis] for axis in (0, 1))
        low = np.where(u < 0.5, self.start[..., 2], self.end[..., 2])
        return vector(x, y, lift(curve, u) * (self.top - low) + low)

    def feet(self, curve: Curve, u: Float[np.ndarray, "*batch"], duration: float) -> Path:
        """Return the feet in world axes with time derivatives; after its swing a foot stands.

        Args:
            curve: Polynomial of the blends.
            u: Fraction of the swing in time, 1 for standing feet, shape (...).
            duration: Duration of a swing [s].
        """
        p, v, a = self.path(curve, u).over(duration)
        moving = (u < 1.0)[..., None]
        return Path(np.where(moving, p, self.end), moving * v, moving * a)


def plan_swings(
    terrain: Ground,
    footing: Footing,
    stride: StrideTable,
    start: Float[np.ndarray, "swings 3"],
    end: Float[np.ndarray, "swings 3"],
) -> Swings:
    """Plan the swings between footholds that clear the ground with the shortest waits.

    Args:
        terrain: The ground.
        footing: Its margin is the ground around a foothold that is even.
        stride: Step height and curve.
        start: Where each lifts off [m].
        end: Where each lands [m].
    """
    tau = np.linspace(0.0, 1.0, PLACES)
    s = blend(stride.curve, tau).position
    ground, distance = _ground_along(terrain, footing, start, end, s)
    top = np.maximum(np.maximum(start[:, 2], end[:, 2]), ground.max(axis=1)) + stride.step_height
    beyond = distance > footing.foothold_margin
    needed = _widened(ground + CLEARANCE * stride.step_height * beyond, distance > ASIDE)
    before, after = np.zeros((2, len(start)))
    clear = np.zeros(len(start), dtype=bool)
    for _ in range(HIGHER):
        todo = np.flatnonzero(~clear)
        if not len(todo):
            break
        waits = _least_waits(
            stride.curve, tau, needed[todo], start[todo, 2], end[todo, 2], top[todo]
        )
        clear[todo] = sum(waits) <= LONGEST_WAIT
        before[todo], after[todo] = (np.where(clear[todo], wait, 0.0) for wait in waits)
        top[~clear] += stride.step_height
    return Swings(start, end, top, before, after, clear)


def _ground_along(
    terrain: Ground,
    footing: Footing,
    start: Float[np.ndarray, "swings 3"],
    end: Float[np.ndarray, "swings 3"],
    s: Float[np.ndarray, " places"],
) -> tuple[Float[np.ndarray, "swings places"], Float[np.ndarray, "swings places"]]:
    """Height of the ground at places along the way, and their distance to the footholds [m].

    Away from the footholds it is the highest ground beside the foot; around them it is even.
    """
    way = (end - start)[:, None, :2]
    path = start[:, None, :2] + way * s[:, None]
    below, width = terrain.height(path[..., 0], path[..., 1]), footing.foothold_margin / 2
    around = below.copy()
    for angle in np.arange(8) * np.pi / 4:
        beside = path + width * np.array([np.cos(angle), np.sin(angle)])
        around = np.maximum(around, terrain.height(beside[..., 0], beside[..., 1]))
    length = np.linalg.norm(way, axis=-1)
    distance = np.minimum(s, 1 - s) * length
    return np.where(distance > width, around, below), distance


def _widened(
    needed: Float[np.ndarray, "swings places"], aside: Bool[np.ndarray, "swings places"]
) -> Float[np.ndarray, "swings places"]:
    """Return the largest heights of neighbouring places: an edge may lie in between."""
    wide = needed.copy()
    before = np.where(aside[:, 1:], needed[:, :-1], -np.inf)
    after = np.where(aside[:, :-1], needed[:, 1:], -np.inf)
    wide[:, 1:] = np.maximum(wide[:, 1:], before)
    wide[:, :-1] = np.maximum(wide[:, :-1], after)
    return wide


def _least_waits(
    curve: Curve,
    tau: Float[np.ndarray, " places"],
    needed: Float[np.ndarray, "swings places"],
    low0: Float[np.ndarray, " swings"],
    low1: Float[np.ndarray, " swings"],
    top: Float[np.ndarray, " swings"],
) -> tuple[Float[np.ndarray, " swings"], Float[np.ndarray, " swings"]]:
    """Return the shortest waits with which the foot clears the ground along its path.

    The foot is at the place of τ at the time a + (1 - a - b) τ. It must not be there before it is
    up, nor after it must come down; each place bounds a from below and b from below, each by the
    other, so the least pair is found from 0 upwards.
    """
    risen = _time_to(curve, needed, low0, top)[:, 1:-1]
    fallen = 1 - _time_to(curve, needed, low1, top)[:, 1:-1]
    inner = tau[1:-1]
    a, b = np.zeros((2, len(top)))
    for _ in range(60):
        last = a, b
        a = np.maximum((risen - inner + b[:, None] * inner) / (1 - inner), 0.0).max(axis=1)
        b = np.maximum((inner - fallen + a[:, None] * (1 - inner)) / inner, 0.0).max(axis=1)
        a, b = np.minimum(a, 1.0), np.minimum(b, 1.0)
        if np.abs(a - last[0]).max(initial=0.0) + np.abs(b - last[1]).max(initial=0.0) < 1e-12:
            break
    return a, b


def _time_to(
    curve: Curve,
    height: Float[np.ndarray, "swings places"],
    low: Float[np.ndarray, " swings"],
    top: Float[np.ndarray, " swings"],
) -> Float[np.ndarray, "swings places"]:
    """Return the fraction of the swing from the lowest point to a height."""
    rise = np.maximum(top - low, 1e-12)[:, None]
    share = np.clip((height - low[:, None]) / rise, 0.0, 1.0)
    return np.asarray(np.interp(share, blend(curve, _U).position, _U) / 2)
