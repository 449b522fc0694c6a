"""Neutral feet of robots whose files have none."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from phasmid.formats.legs import UPRIGHT, FoundLeg
from phasmid.kinematics.leg import angles_and_margin
from phasmid.robot.leg import NEAREST_FOOT

OUT, DOWN = 0.6, 0.4
"""A foot's distance from its coxa axis and below its hip, of the leg's length: those of the
PhantomX of this project, 150 and 100 mm with 250 mm of leg."""

BENEATH = 0.7
"""Depth of a foot below a hip whose coxa axis lies, of the leg's length."""

SPARE = math.radians(5.0)
"""Angle that a standing leg keeps from its limits, where it can."""


def standing_feet(legs: Sequence[FoundLeg]) -> Float[np.ndarray, "legs 3"] | None:
    """Feet on one level ground, straight out from the hips and knees up, within the limits.

    All legs stand equally far out; of all stances that every leg can take, the one nearest to
    `OUT` and `DOWN`; beneath the hips, nearest to `BENEATH`, where all coxa axes lie.

    Args:
        legs: The legs, their hips in the body frame.

    Returns:
        Feet in the hip frames [m], shape (L, 3); None where no stance is within the limits.
    """
    length = float(np.mean([leg.lengths.sum() for leg in legs]))
    step = _round_step(length)
    # In steps that make round numbers, as far as any leg reaches.
    count = math.ceil(length / step)
    lying = all(abs(leg.R_level_hip[2, 2]) < UPRIGHT for leg in legs)
    wanted_out, wanted_down = (0.0, BENEATH) if lying else (OUT, DOWN)
    out = step * np.arange(0 if lying else 1, count + 1)
    down = step * np.arange(count + 1)
    r, h = np.meshgrid(out, down, indexing="ij")
    wish = np.hypot(
        r - round(wanted_out * length / step) * step, h - round(wanted_down * length / step) * step
    )
    order = np.argsort(wish, axis=None, kind="stable")
    r, h = r.ravel()[order], h.ravel()[order]
    for spare in (SPARE, 0.0):
        fits = np.ones(r.shape, dtype=bool)
        for leg in legs:
            fits &= _within(leg, _in_hip(leg, r, h), spare)
        if fits.any():
            best = int(np.argmax(fits))
            return np.array([_in_hip(leg, r[best], h[best]) for leg in legs])
    return None


def _round_step(length: float) -> float:
    """About a twentieth of a length, a round number."""
    decade = 10.0 ** math.floor(math.log10(length / 20))
    return max(m * decade for m in (1.0, 2.0, 5.0) if m * decade <= length / 20)


def _in_hip(leg: FoundLeg, r: np.ndarray | float, h: np.ndarray | float) -> np.ndarray:
    """Return a point at a distance from the hip and a depth below the body, in the hip frame."""
    r, z = np.broadcast_arrays(np.asarray(r), -np.asarray(h) - float(leg.position[2]))
    left = np.array([0.0, leg.lateral_offsets.sum(), 0.0])
    return np.stack([r, np.zeros(r.shape), z], axis=-1) @ leg.R_level_hip + left


def _within(leg: FoundLeg, p_hip_foot: np.ndarray, spare: float) -> np.ndarray:
    angles, margin = angles_and_margin(leg, p_hip_foot)
    low, high = leg.limits.T
    # Of a narrow range a spare angle may leave nothing.
    room = np.minimum(spare, (high - low) / 4)
    inside = ((angles >= low + room) & (angles <= high - room)).all(axis=-1)
    return inside & (margin >= 0) & (p_hip_foot[:, 0] >= NEAREST_FOOT)
