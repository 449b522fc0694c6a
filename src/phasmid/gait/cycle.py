"""One cycle of a gait seen from the body: who stands where, and what that holds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from phasmid.gait.gait import Gait, events, leg_phase
from phasmid.gait.support import support_margin
from phasmid.gait.sway import sway

COMFORTABLE_STEP = (0.04, 0.0, 0.0)
"""A step straight ahead, as long as the paper's: ahead, to the left [m], turn [rad]."""

BENT_SAMPLES = 9
"""Samples between two events where the centre of mass goes along a curve over the feet."""


class Timing(NamedTuple):
    """Samples of one cycle, some between any two events, both ends of each interval included.

    Attributes:
        phase: Phases of the cycle, shape (N,).
        stance: Who stands, shape (N, L).
        share: How far each foot's stance is over, from -1/2 to 1/2; of no use in the air,
            shape (N, L).
    """

    phase: Float[np.ndarray, " samples"]
    stance: Bool[np.ndarray, "samples legs"]
    share: Float[np.ndarray, "samples legs"]


def timing(lifts: Float[np.ndarray, " legs"], duty_factor: float, count: int) -> Timing:
    """Who stands, and for how long already, over one cycle.

    Args:
        lifts: Phases at which legs lift, shape (L,).
        duty_factor: Fraction of the cycle for which each foot stands.
        count: Samples between two events.
    """
    swing = 1 - duty_factor
    begin = events(lifts, swing)
    end = np.append(begin[1:], 1.0 + begin[0])
    middle = (begin + end) / 2
    offset = (end - begin)[:, None] * np.linspace(-0.5, 0.5, count)
    own = leg_phase(middle, lifts)
    share = (own[:, None, :] + offset[:, :, None] - swing) / duty_factor - 0.5
    return Timing(
        (middle[:, None] + offset).reshape(-1),
        np.repeat(own > swing, count, axis=0),
        share.reshape(-1, len(lifts)),
    )


def foot_way(
    neutral: Float[np.ndarray, "legs 2"],
    step: Float[np.ndarray, "3"],
    share: Float[np.ndarray, "*batch legs"],
) -> Float[np.ndarray, "*batch legs 2"]:
    """Where a foot that stands is, seen from a body that goes at a constant speed.

    Args:
        neutral: Feet amid their stance, in the body frame [m], shape (L, 2).
        step: The body's way in one stance: ahead, to the left [m], turn to the left [rad].
        share: Share of the step that the body has gone since then, from -1/2 to 1/2.
    """
    turn = step[2] * share
    c, s = np.cos(turn), np.sin(turn)
    # The body's way is the arc of a constant twist; sin(a)/a and (1 - cos(a))/a are of its chord.
    along = np.sinc(turn / np.pi) * share
    across = np.sin(turn / 2) * np.sinc(turn / (2 * np.pi)) * share
    x = neutral[:, 0] - (along * step[0] - across * step[1])
    y = neutral[:, 1] - (across * step[0] + along * step[1])
    return np.stack([c * x + s * y, c * y - s * x], axis=-1)


def sample_count(step: Float[np.ndarray, "3"], sway: float) -> int:
    """Samples between two events that find the least margin.

    Over the feet the centre of mass goes straight where the body neither turns nor sways, and the
    margin is a concave function of its place, so that both ends are enough.
    """
    return BENT_SAMPLES if sway or step[2] else 2


def least_margin(
    gait: Gait,
    neutral: Float[np.ndarray, "legs axes"],
    centre_of_mass: Float[np.ndarray, "2"] | tuple[float, float] = (0.0, 0.0),
    step: Float[np.ndarray, "3"] | tuple[float, float, float] = COMFORTABLE_STEP,
) -> float:
    """The least support margin of a cycle while the body goes at a constant speed [m].

    Args:
        gait: Which legs stand, when.
        neutral: Neutral feet in the body frame, x and y first [m], shape (L, 2) or (L, 3).
        centre_of_mass: In the body frame, x and y [m], shape (2,).
        step: The body's way while a foot stands: ahead, to the left [m], turn to the left [rad].
    """
    way = np.asarray(step, dtype=float)
    feet = np.asarray(neutral, dtype=float)[:, :2]
    lifts = np.asarray(gait.offsets, dtype=float)
    told = timing(lifts, gait.duty_factor, sample_count(way, gait.sway))
    com = np.asarray(centre_of_mass, dtype=float)[:2] + sway(gait, feet, 1.0, told.phase).way
    return float(support_margin(foot_way(feet, way, told.share), told.stance, com).min())
