"""What a leg reaches within its margins, as a few numbers that need no angles to be compared."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import internal

PLANNED, ENOUGH, HARD = 1.0, 0.5, 0.2
"""Shares of the margins of stretch and of joint limits: of what is planned, of what is kept on the
way to rest and where a foot may come down, and of all targets."""

AT_PLANNED, AT_ENOUGH = 0, 1
"""Where the bounds at these shares stand in `Model.reach`."""

BOUNDS = 8
"""Numbers of a leg: the least and the largest square of the foot's distance from the femur's axis
[m²]; cosine and sine of the middle of what the coxa may have, and cosine of half its width; the
same of the femur."""

NEVER = 2.0
"""A cosine that no angle has; all have more than its negative."""


def edge_width(limits: Float[np.ndarray, "... 2"], joint_margin: float) -> Float[np.ndarray, "..."]:
    """The margin of joints' limits, which is narrower where the joint's range is [rad].

    Args:
        limits: Lowest and highest angles [rad].
        joint_margin: Of wide ranges [rad].
    """
    return np.maximum(np.minimum(joint_margin, (limits[..., 1] - limits[..., 0]) / 8), 1e-9)


def reach_bounds(
    lengths: Float[np.ndarray, "legs 4"],
    limits: Float[np.ndarray, "legs 3 2"],
    stretch: float,
    joint_margin: float,
) -> Float[np.ndarray, "2 legs 8"]:
    """The bounds of each leg at the shares `PLANNED` and `ENOUGH`; see `BOUNDS` and `is_within`.

    Args:
        lengths: As in `Model`.
        limits: Lowest and highest joint angles [rad].
        stretch: Share of its full length to which a leg may be stretched.
        joint_margin: Distance from the joints' limits [rad].
    """
    bounds = np.zeros((2, len(lengths), BOUNDS))
    width = edge_width(limits, joint_margin)
    femur, tibia = lengths[:, 1], lengths[:, 2]
    for at, share in ((AT_PLANNED, PLANNED), (AT_ENOUGH, ENOUGH)):
        # Angles are told as from -pi to pi, and those of the knee as from -pi to 0.
        low = np.maximum(limits[..., 0] + share * width, -math.pi)
        high = np.minimum(limits[..., 1] - share * width, [math.pi, math.pi, 0.0])
        room = np.maximum(1 - stretch, 1e-9)
        longest = np.maximum(1 - share * room, 0.0) * (femur + tibia)
        knee = femur**2 + tibia**2 + 2 * femur * tibia * np.cos([low[:, 2], high[:, 2]])
        bounds[at, :, 0] = np.where(low[:, 2] <= high[:, 2], knee[0], np.inf)
        bounds[at, :, 1] = np.minimum(knee[1], longest**2)
        for joint, first in ((0, 2), (1, 5)):
            middle, half = (low + high)[:, joint] / 2, (high - low)[:, joint] / 2
            bounds[at, :, first], bounds[at, :, first + 1] = np.cos(middle), np.sin(middle)
            half_cos = np.where(half < math.pi, np.cos(half), -NEVER)
            bounds[at, :, first + 2] = np.where(half >= 0, half_cos, NEVER)
    return bounds


@internal
def is_within(
    lengths: np.ndarray, reach: np.ndarray, at: int, leg: int, x: float, y: float, z: float
) -> bool:
    """Whether a leg reaches a place with the margins that its bounds have.

    As `foothold_region.joint_limit_margin` compared with a share, without angles. The distance from
    the femur's axis gives knee and stretch. An angle is in a range where its cosine, counted from
    the middle of the range, is at least that of half the range. On the axis of the coxa, where its
    angle is undetermined, it counts as in its range.

    Args:
        lengths: As in `Model`, shape (L, 4).
        reach: As by `reach_bounds`, shape (2, L, 8).
        at: Which of its shares.
        leg: The leg's index.
        x: Foot in the hip frame [m].
        y: The same.
        z: The same.
    """
    # Single numbers of the whole arrays: their parts as arrays would take longer than the rest.
    coxa, femur, tibia = lengths[leg, 0], lengths[leg, 1], lengths[leg, 2]
    left = lengths[leg, 3]
    beside = x * x + y * y - left * left
    if beside < 0.0:
        return False
    flat = math.sqrt(beside)
    out = flat - coxa
    square = out * out + z * z
    long, short = (femur + tibia) ** 2 - square, square - (femur - tibia) ** 2
    # Written so that NaN counts as out of reach.
    if not (reach[at, leg, 0] <= square <= reach[at, leg, 1] and long > 0.0 and short > 0.0):
        return False
    # The coxa's angle is that of (ahead, up), as long as the square of (x, y).
    ahead, up = x * flat + y * left, y * flat - x * left
    side = reach[at, leg, 2] * ahead + reach[at, leg, 3] * up
    if not side >= reach[at, leg, 4] * (x * x + y * y):
        return False
    # The femur's angle is that of (ahead, up); the length of that is twice the femur's by `square`.
    along, across = square + (femur + tibia) * (femur - tibia), math.sqrt(long * short)
    ahead, up = out * along - z * across, z * along + out * across
    side = reach[at, leg, 5] * ahead + reach[at, leg, 6] * up
    return bool(side >= reach[at, leg, 7] * 2.0 * femur * square)
