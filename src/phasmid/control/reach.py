"""Reach of the legs: the places where a foot can be, and its margin there.

Margins are to the stretched leg and to the joint limits, as shares of those in the settings.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import inlined, internal
from phasmid.control.types import Model, State
from phasmid.kinematics.leg_kernels import Triple, inverse_kinematics

PLANNED, ENOUGH, HARD = 1.0, 0.5, 0.2
"""Shares of the margins: of steady walks and foothold regions, of landings and of the motion to
rest, and of all targets."""

AT_PLANNED, AT_ENOUGH = 0, 1
"""Rows of `Model.reach` with the bounds at these shares."""

NEVER = 2.0
"""A cosine that no angle has; all have more than its negative."""


def reach_bounds(
    lengths: Float[np.ndarray, "legs 4"],
    limits: Float[np.ndarray, "legs 3 2"],
    stretch: float,
    joint_margin: float,
) -> Float[np.ndarray, "2 legs 8"]:
    """Return the bounds of each leg at the shares `PLANNED` and `ENOUGH`, for `is_within`.

    Bounds of a leg: least and largest square of the foot's distance from the femur's axis [m²];
    cosine and sine of the middle of the coxa's range, and cosine of half its width; the same of
    the femur.

    Args:
        lengths: As in `Model`.
        limits: Lowest and highest joint angles [rad].
        stretch: Share of its full length to which a leg may be stretched.
        joint_margin: Margin to the joint limits [rad].
    """
    bounds = np.zeros((2, len(lengths), 8))
    width = np.clip((limits[..., 1] - limits[..., 0]) / 8, 1e-9, max(joint_margin, 1e-9))
    femur, tibia = lengths[:, 1], lengths[:, 2]
    for bound, share in zip(bounds, (PLANNED, ENOUGH), strict=True):
        # Inverse kinematics returns angles from -pi to pi, and a knee angle from -pi to 0.
        low = np.maximum(limits[..., 0] + share * width, -math.pi)
        high = np.minimum(limits[..., 1] - share * width, [math.pi, math.pi, 0.0])
        longest = max(1 - share * max(1 - stretch, 1e-9), 0.0) * (femur + tibia)
        knee = femur**2 + tibia**2 + 2 * femur * tibia * np.cos([low[:, 2], high[:, 2]])
        bound[:, 0] = np.where(low[:, 2] <= high[:, 2], knee[0], np.inf)
        bound[:, 1] = np.minimum(knee[1], longest**2)
        for joint, first in ((0, 2), (1, 5)):
            middle, half = (low + high)[:, joint] / 2, (high - low)[:, joint] / 2
            bound[:, first], bound[:, first + 1] = np.cos(middle), np.sin(middle)
            half_cos = np.where(half < math.pi, np.cos(half), -NEVER)
            bound[:, first + 2] = np.where(half >= 0, half_cos, NEVER)
    return bounds


@internal
def is_within(model: Model, row: int, leg: int, x: float, y: float, z: float) -> bool:
    """Return whether a leg reaches a point of its hip frame [m], by a row of `Model.reach`.

    Equals `joint_limit_margin(...) >= share` without angles, in 12 instead of 91 ns: a foothold
    region takes 300 of them. The distance from the femur's axis
    determines knee and stretch. An angle is in its range where the cosine of its distance from
    the middle is at least that of half the range. On the coxa axis every coxa angle is possible.
    """
    lengths, bound = model.lengths, model.reach
    # Single numbers: views of rows would take longer than the comparison.
    coxa, femur, tibia, left = lengths[leg, 0], lengths[leg, 1], lengths[leg, 2], lengths[leg, 3]
    beside = x * x + y * y - left * left
    if beside < 0.0:
        return False
    flat = math.sqrt(beside)
    out = flat - coxa
    square = out * out + z * z
    long, short = (femur + tibia) ** 2 - square, square - (femur - tibia) ** 2
    # Written so that NaN counts as out of reach.
    if not (bound[row, leg, 0] <= square <= bound[row, leg, 1] and long > 0.0 and short > 0.0):
        return False
    # The coxa angle is that of the vector (ahead, up), whose squared length is x² + y².
    ahead, up = x * flat + y * left, y * flat - x * left
    side = bound[row, leg, 2] * ahead + bound[row, leg, 3] * up
    if not side >= bound[row, leg, 4] * (x * x + y * y):
        return False
    # The femur angle is that of (ahead, up), whose length is 2 femur square.
    along, across = square + (femur + tibia) * (femur - tibia), math.sqrt(long * short)
    ahead, up = out * along - z * across, z * along + out * across
    side = bound[row, leg, 5] * ahead + bound[row, leg, 6] * up
    return bool(side >= bound[row, leg, 7] * 2.0 * femur * square)


@internal
def joint_limit_margin(model: Model, leg: int, p: np.ndarray, q: np.ndarray) -> float:
    """Write the joint angles of a foot in the hip frame, and return its least margin.

    Margins to stretch and joint limits are shares of the settings'; minus infinity out of reach.
    """
    lengths = model.lengths[leg]
    q[0], q[1], q[2], margin = inverse_kinematics(lengths, lengths[3], p[0], p[1], p[2], 1.0)
    # Written so that NaN counts as out of reach.
    if not margin > 0:
        return -math.inf
    beside = p[0] * p[0] + p[1] * p[1] - lengths[3] * lengths[3]
    out = math.sqrt(max(beside, 0.0)) - lengths[0]
    length = math.sqrt(out * out + p[2] * p[2]) / (lengths[1] + lengths[2])
    share = (1 - length) / max(1 - model.stretch, 1e-9)
    for k in range(3):
        low, high = model.limits[leg, k, 0], model.limits[leg, k, 1]
        width = max(min(model.joint_margin, (high - low) / 8), 1e-9)
        share = min(share, (q[k] - low) / width, (high - q[k]) / width)
    return share


@inlined
def to_hip_frame(
    model: Model, leg: int, R: np.ndarray, body: np.ndarray, x: float, y: float, z: float
) -> Triple:
    """Return a point in a leg's hip frame [m]; R and `body` are the body's rotation and place.

    Numbers and not arrays: to allocate these would take longer than the computation.
    """
    x, y, z = x - body[0], y - body[1], z - body[2]
    p, H = model.p_body_hip, model.R_body_hip
    u = R[0, 0] * x + R[1, 0] * y + R[2, 0] * z - p[leg, 0]
    v = R[0, 1] * x + R[1, 1] * y + R[2, 1] * z - p[leg, 1]
    w = R[0, 2] * x + R[1, 2] * y + R[2, 2] * z - p[leg, 2]
    return (
        H[leg, 0, 0] * u + H[leg, 1, 0] * v + H[leg, 2, 0] * w,
        H[leg, 0, 1] * u + H[leg, 1, 1] * v + H[leg, 2, 1] * w,
        H[leg, 0, 2] * u + H[leg, 1, 2] * v + H[leg, 2, 2] * w,
    )


@internal
def is_reachable(state: State, model: Model, leg: int, x: float, y: float, z: float) -> bool:
    """Return whether a leg reaches a point of odom [m] from the present pose of the body."""
    x, y, z = to_hip_frame(model, leg, state.R_odom_body, state.body_position, x, y, z)
    return is_within(model, AT_ENOUGH, leg, x, y, z)
