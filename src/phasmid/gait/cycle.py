"""One cycle of a gait in the body frame: stance, feet, sway and the least support margin."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from phasmid.gait.gait import Gait
from phasmid.gait.support import support_margin

COMFORTABLE_STEP = (0.04, 0.0, 0.0)
"""Step of the paper's length: forward, left [m], yaw [rad]."""

BENT_SAMPLES = 9
"""Samples between two events where the centre of mass moves along a curve over the feet."""


class Timing(NamedTuple):
    """Samples of one cycle, some between any two events, both ends of each interval included.

    Attributes:
        phase: Phases of the cycle, shape (N,).
        stance: Feet that stand, shape (N, L).
        share: Progress of each foot's stance, from -1/2 to 1/2; meaningless in the air, (N, L).
    """

    phase: Float[np.ndarray, " samples"]
    stance: Bool[np.ndarray, "samples legs"]
    share: Float[np.ndarray, "samples legs"]


def sample_count(gait: Gait, step: Float[np.ndarray, "3"]) -> int:
    """Return the number of samples between two events that contain the least margin.

    Where the body neither turns nor sways, the centre of mass moves straight over the feet. The
    margin is a concave function of its position, so that both ends are enough.
    """
    return BENT_SAMPLES if gait.sway or step[2] else 2


def timing(gait: Gait, count: int) -> Timing:
    """Return stance and its progress over one cycle, in samples between any two events."""
    begin = gait.events
    end = np.append(begin[1:], 1.0 + begin[0])
    middle = (begin + end) / 2
    offset = (end - begin)[:, None] * np.linspace(-0.5, 0.5, count)
    own, swing = gait.leg_phase(middle), 1 - gait.duty_factor
    share = (own[:, None, :] + offset[:, :, None] - swing) / gait.duty_factor - 0.5
    return Timing(
        (middle[:, None] + offset).reshape(-1),
        np.repeat(own > swing, count, axis=0),
        share.reshape(-1, own.shape[1]),
    )


def foot_way(
    neutral: Float[np.ndarray, "legs 2"],
    step: Float[np.ndarray, "3"],
    share: Float[np.ndarray, "*batch legs"],
) -> Float[np.ndarray, "*batch legs 2"]:
    """Return standing feet in the frame of a body that moves at a constant velocity [m].

    Args:
        neutral: Feet at mid-stance in the body frame [m], shape (L, 2).
        step: Motion of the body in one stance: forward, left [m], yaw [rad].
        share: Share of the step since mid-stance, from -1/2 to 1/2, shape (..., L).
    """
    turn = step[2] * share
    c, s = np.cos(turn), np.sin(turn)
    # The path of a constant twist is an arc; its chord has the factors sin(a)/a and (1 - cos(a))/a.
    along = np.sinc(turn / np.pi) * share
    across = np.sin(turn / 2) * np.sinc(turn / (2 * np.pi)) * share
    x = neutral[:, 0] - (along * step[0] - across * step[1])
    y = neutral[:, 1] - (across * step[0] + along * step[1])
    return np.stack([c * x + s * y, c * y - s * x], axis=-1)


class Sway(NamedTuple):
    """Displacement of the body from its path, forward and left.

    Attributes:
        way: Displacement [m], shape (N, 2).
        speed: Its first derivative by time [m/s], shape (N, 2).
        acceleration: Its second derivative by time [m/s²], shape (N, 2).
    """

    way: Float[np.ndarray, "time 2"]
    speed: Float[np.ndarray, "time 2"]
    acceleration: Float[np.ndarray, "time 2"]

    def removed_from(
        self, position: Float[np.ndarray, "time axes"], yaw: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, "time 2"]:
        """Return the path of a body without its sway [m], shape (N, 2).

        Args:
            position: The body in the world, x and y first [m], shape (N, 2) or (N, 3).
            yaw: Its heading [rad], shape (N,).
        """
        (ahead, left), c, s = self.way.T, np.cos(yaw), np.sin(yaw)
        return position[:, :2] - np.stack([c * ahead - s * left, s * ahead + c * left], axis=-1)


def sway(
    gait: Gait,
    neutral: Float[np.ndarray, "legs axes"],
    period: float,
    time: Float[np.ndarray, " time"],
) -> Sway:
    """Return the sway of the body in a gait.

    Each foot adds a cosine of one cycle: away from the foot at mid-swing, by a share of its
    distance from the centroid of all feet, and towards it half a cycle later.

    Args:
        gait: The gait; its sway is that share.
        neutral: Neutral feet in the body frame, x and y first [m], shape (L, 2) or (L, 3).
        period: Time of a cycle [s].
        time: Times [s], shape (N,).
    """
    neutral = np.asarray(neutral, dtype=float)
    arm = gait.sway * (neutral[:, :2].mean(axis=0) - neutral[:, :2])
    middle = np.asarray(gait.offsets) + gait.swing_fraction / 2
    angle = 2 * np.pi * (np.asarray(time, dtype=float)[:, None] / period - middle)
    rate = 2 * np.pi / period
    # Summed in one order whatever the shapes, so that single samples are the same bits.
    c, s = (
        np.stack([sum((wave[:, i] * p[k] for i, p in enumerate(arm)), 0.0) for k in (0, 1)], -1)
        for wave in (np.cos(angle), np.sin(angle))
    )
    return Sway(c, -rate * s, -(rate**2) * c)


class Cycle(NamedTuple):
    """Samples of one cycle in the body frame.

    Attributes:
        feet: Feet [m], shape (N, L, 2).
        stance: Feet that stand, shape (N, L).
        com: Centre of mass [m], shape (N, 2).
    """

    feet: Float[np.ndarray, "samples legs 2"]
    stance: Bool[np.ndarray, "samples legs"]
    com: Float[np.ndarray, "samples 2"]


def one_cycle(
    gait: Gait,
    neutral: Float[np.ndarray, "legs 2"],
    centre_of_mass: Float[np.ndarray, "2"],
    step: Float[np.ndarray, "3"],
) -> Cycle:
    """Return one cycle of a walk at a constant velocity; arguments are those of `least_margin`."""
    samples = timing(gait, sample_count(gait, step))
    com = centre_of_mass + sway(gait, neutral, 1.0, samples.phase).way
    return Cycle(foot_way(neutral, step, samples.share), samples.stance, com)


def least_margin(
    gait: Gait,
    neutral: Float[np.ndarray, "legs axes"],
    centre_of_mass: Float[np.ndarray, "2"] | tuple[float, float] = (0.0, 0.0),
    step: Float[np.ndarray, "3"] | tuple[float, float, float] = COMFORTABLE_STEP,
) -> float:
    """Return the least support margin of a cycle at a constant velocity [m].

    Args:
        gait: The gait.
        neutral: Neutral feet in the body frame, x and y first [m], shape (L, 2) or (L, 3).
        centre_of_mass: In the body frame, x and y [m], shape (2,).
        step: Motion of the body while a foot stands: forward, left [m], yaw [rad].
    """
    feet, com = np.asarray(neutral, dtype=float)[:, :2], np.asarray(centre_of_mass, dtype=float)[:2]
    return float(support_margin(*one_cycle(gait, feet, com, np.asarray(step, dtype=float))).min())
