"""Robots that slide down ground too steep for its friction."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from phasmid.robot.similarity import Scale
from phasmid.terrain.ground import Ground
from phasmid.terrain.shapes import Slope

GRIP_SHARE = 0.8
"""Share of the friction that may hold a robot on a slope; its own motion needs the rest."""

SLIDING_SPEEDS = 0.02, 0.1
"""Speeds above which a ``phantomx-ax`` slides [m/s]: where its ground cannot hold it, and where its
friction is nearly used up; those of other robots follow the root of their leg length. Standing it
creeps by a millimetre per second, and moving on steep ground by 40."""

SLIDING_TIME = 0.2
"""Time over which the speed of sliding is measured [s]: feet that chatter touch often in it."""

CHATTER = 0.02
"""Interval of samples up to which a foot that touches in one of two slides [s]: feet chatter."""

LEAST_TOUCH = 0.1 * SLIDING_TIME
"""Least part of this time in which feet touch the ground [s]; fast ones leap."""


@dataclass(frozen=True)
class Slide:
    """A robot that slides down the ground.

    Attributes:
        speed: Along the ground [m/s].
        slope: Steepness of the ground [rad].
        friction: Coefficient of Coulomb friction there.
    """

    speed: float
    slope: float
    friction: float

    @property
    def cause(self) -> str:
        """Slope and friction, in words."""
        steep, held = (math.degrees(a) for a in (self.slope, math.atan(self.friction)))
        return (
            f"the ground is {steep:.3g}° steep and its friction of {self.friction:.3g} holds up to "
            f"{held:.3g}°"
        )

    def remedy(self, ground: Ground) -> str:
        """Return options with which the robot would stand."""
        enough = math.ceil(10 * math.tan(self.slope) / GRIP_SHARE) / 10
        more = "a friction of" if ground.patches else "--friction"
        return f"{more} {enough:g} or {self.flatter(ground)}"

    def flatter(self, ground: Ground) -> str:
        """Return the option of a slope on which the robot would stand and walk."""
        shape, held = ground.shape, math.degrees(math.atan(GRIP_SHARE * self.friction))
        if not isinstance(shape, Slope) or held < 1:
            return "flatter ground"
        return f"--slope-deg {math.copysign(math.floor(held), shape.angle):g}"


def find_slide(
    ground: Ground,
    scale: Scale,
    time: Float[np.ndarray, " time"],
    feet: Float[np.ndarray, "time legs 3"],
    contact: Bool[np.ndarray, "time legs"],
) -> Slide | None:
    """Return the fastest slide of a robot where its ground is too steep, or None.

    Args:
        ground: The ground.
        scale: The robot relative to ``phantomx-ax``.
        time: Times [s], shape (N,).
        feet: Positions of the feet in world axes [m], shape (N, L, 3).
        contact: Which feet touch the ground, shape (N, L).
    """
    if ground.faces_up or len(time) < 2 or time[-1] - time[0] < SLIDING_TIME:
        return None
    touching = contact[:-1]
    if np.diff(time).mean() > CHATTER:
        # A foot that lifts before the next sample makes a part of its swing.
        touching = touching & contact[1:]
    counts = np.maximum(touching.sum(axis=1), 1)

    def mean(values: np.ndarray) -> np.ndarray:
        """Return the mean over the feet that touch."""
        weights = touching.reshape(*touching.shape, *(1,) * (values.ndim - 2))
        return np.asarray((weights * values).sum(axis=1).T / counts).T

    x, y = feet[:-1, :, 0], feet[:-1, :, 1]
    slope, friction = mean(ground.surface(x, y)[1]), mean(ground.friction(x, y))
    rise = np.hypot(*slope.T)
    steep = touching.any(axis=1) & (rise > GRIP_SHARE * friction)
    # Feet that stay on a plane move down it by cos a along the vertical's projection.
    downhill = -np.sum(mean(np.diff(feet, axis=0))[:, :2] * slope, axis=1) / np.maximum(rise, 1e-9)
    distance = np.where(steep, downhill * np.sqrt(1 + rise**2), 0.0)
    # Means over the time, from each sample on.
    ends = np.searchsorted(time, time + SLIDING_TIME - 1e-9)
    starts = np.flatnonzero(ends < len(time))
    ends = ends[starts]
    sums = [
        np.concatenate([[0.0], np.cumsum(each)])
        for each in (distance, steep * np.diff(time), steep, steep * rise, steep * friction)
    ]
    moved, lasted, count, rises, frictions = (each[ends] - each[starts] for each in sums)
    speed = np.where(lasted >= LEAST_TOUCH, moved / np.maximum(lasted, LEAST_TOUCH), 0.0)
    least = np.where(rises > frictions, *SLIDING_SPEEDS) * scale.length / scale.time
    best = int(np.argmax(np.where(speed > least, speed, 0.0)))
    if speed[best] <= least[best]:
        return None
    return Slide(
        float(speed[best]),
        math.atan(rises[best] / count[best]),
        float(frictions[best] / count[best]),
    )
