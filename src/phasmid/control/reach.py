"""Reach of the legs, and foothold regions: for each leg a convex polygon inside its reach.

Margins to the stretched leg and to the joint limits are shares of those by `STRETCH` and
`JOINT_MARGIN`.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.types import DIRECTIONS, Model, State
from phasmid.control.vectors import rotate_back, rotation
from phasmid.kinematics import vector_kernels as kernels
from phasmid.kinematics.leg_kernels import Triple, inverse_kinematics

STRETCH, JOINT_MARGIN = 0.98, 0.02
"""Share of its full length to which a leg may be stretched; margin to the joint limits [rad]."""

PLANNED, ENOUGH, HARD = 1.0, 0.5, 0.2
"""Shares of the margins: of steady walks and foothold regions, of landings and of the motion to
rest, and of all targets."""

CORNERS = math.cos(math.pi / DIRECTIONS)
"""Distance of a regular polygon's sides over that of its corners."""

STEPS, NEAR = 8, 1e-4
"""Steps along a ray, which add up to femur and tibia, and the distance to which its end is bisected
[m]."""


@compiled
def joint_margin(model: Model, leg: int, joint: int) -> float:
    """Return the margin of a joint to its limits [rad], at most an eighth of its range."""
    low, high = model.limits[leg, joint, 0], model.limits[leg, joint, 1]
    return max(min(JOINT_MARGIN, (high - low) / 8), 1e-9)


@compiled
def joints_at(
    model: Model, leg: int, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Return the joint angles of a foot in the hip frame [rad], and its least margin.

    Out of reach the margin is minus infinity.
    """
    lengths = model.lengths[leg]
    q1, q2, q3, margin = inverse_kinematics(lengths, lengths[3], x, y, z, 1.0)
    # Written so that NaN counts as out of reach.
    if not margin > 0:
        return q1, q2, q3, -math.inf
    out = math.sqrt(max(x * x + y * y - lengths[3] * lengths[3], 0.0)) - lengths[0]
    length = math.sqrt(out * out + z * z) / (lengths[1] + lengths[2])
    share = (1 - length) / (1 - STRETCH)
    for joint, q in enumerate((q1, q2, q3)):
        low, high = model.limits[leg, joint, 0], model.limits[leg, joint, 1]
        share = min(share, min(q - low, high - q) / joint_margin(model, leg, joint))
    return q1, q2, q3, share


@compiled
def to_hip_frame(
    model: Model, leg: int, R: np.ndarray, body: np.ndarray, x: float, y: float, z: float
) -> Triple:
    """Return a point in a leg's hip frame [m]; R and `body` are the body's rotation and place.

    Tuples and not arrays: to allocate these would take longer than the computation.
    """
    x, y, z = kernels.rotate_back(R, (x - body[0], y - body[1], z - body[2]))
    hip = model.p_body_hip[leg]
    return kernels.rotate_back(model.R_body_hip[leg], (x - hip[0], y - hip[1], z - hip[2]))


@compiled
def reach_margin(
    model: Model, leg: int, R: np.ndarray, body: np.ndarray, x: float, y: float, z: float
) -> float:
    """Return the margin of a leg whose foot is at a point of odom [m]."""
    x, y, z = to_hip_frame(model, leg, R, body, x, y, z)
    return joints_at(model, leg, x, y, z)[3]


@compiled
def is_reachable(state: State, model: Model, leg: int, x: float, y: float, z: float) -> bool:
    """Return whether a leg reaches a point of odom [m] from the present pose of the body."""
    return reach_margin(model, leg, state.R_odom_body, state.body_position, x, y, z) >= ENOUGH


@compiled
def is_planned(model: Model, leg: int, start: np.ndarray, ray: np.ndarray, r: float) -> bool:
    """Return whether a leg reaches so far along a ray of the hip frame [m]."""
    x, y, z = start[0] + r * ray[0], start[1] + r * ray[1], start[2] + r * ray[2]
    return joints_at(model, leg, x, y, z)[3] >= PLANNED


@compiled
def region_edge(model: Model, leg: int, start: np.ndarray, ray: np.ndarray) -> float:
    """Return the distance along a ray of the hip frame up to which the leg reaches [m]."""
    low, high = 0.0, 0.0
    for _ in range(STEPS):
        high += (model.lengths[leg, 1] + model.lengths[leg, 2]) / STEPS
        if not is_planned(model, leg, start, ray, high):
            break
        low = high
    while high - low > NEAR:
        middle = (low + high) / 2
        if is_planned(model, leg, start, ray, middle):
            low = middle
        else:
            high = middle
    return low


@compiled
def bound_region(
    model: Model, leg: int, pose: np.ndarray, slope: np.ndarray, region: np.ndarray
) -> None:
    """Write the foothold region of a leg at a pose of the body.

    It is inscribed in the leg's reach along rays from its neutral foot.

    Args:
        model: The robot.
        leg: Index of the leg.
        pose: Pose of the body relative to its path and neutral height, shape (6,).
        slope: Slope of the ground forward and left, and height of the foot above it [m],
            shape (3,).
        region: Written: normals forward and left, and distances from the neutral foot [m], of its
            half-planes, shape (K, 3).
    """
    R, body = rotation(pose[3], pose[4], pose[5]), np.array((pose[0], pose[1], pose[2]))
    body[2] += model.height
    x, y = model.neutral[leg, 0], model.neutral[leg, 1]
    height = slope[2] + slope[0] * x + slope[1] * y
    start = np.array(to_hip_frame(model, leg, R, body, x, y, height))
    edge = np.empty((DIRECTIONS, 2))
    for k in range(DIRECTIONS):
        angle = 2 * math.pi * k / DIRECTIONS
        x, y = math.cos(angle), math.sin(angle)
        ray = rotate_back(R, np.array((x, y, slope[0] * x + slope[1] * y)))
        r = region_edge(model, leg, start, rotate_back(model.R_body_hip[leg], ray))
        edge[k, 0], edge[k, 1] = r * x, r * y
    for k in range(DIRECTIONS):
        angle = 2 * math.pi * k / DIRECTIONS
        nx, ny = math.cos(angle), math.sin(angle)
        a, b = edge[k - 1], edge[(k + 1) % DIRECTIONS]
        # The normal of the edge fits better where the edge is convex.
        mx, my = b[1] - a[1], a[0] - b[0]
        length = math.sqrt(mx * mx + my * my)
        if length > 1e-9:
            mx, my = mx / length, my / length
            outward = mx * (edge[k, 0] - a[0]) + my * (edge[k, 1] - a[1])
            if outward > 0 and mx * nx + my * ny > 0.5:
                nx, ny = mx, my
        region[k, 0], region[k, 1] = nx, ny
        # Where the edge is round, the corners of the polygon come to lie on it.
        region[k, 2] = CORNERS * max(nx * edge[k, 0] + ny * edge[k, 1], 0.0)


@compiled
def region_share(
    region: np.ndarray, x: float, y: float, dx: float, dy: float, slack: float
) -> float:
    """Return the share, at most 1, of a displacement (dx, dy) that stays inside a region [m].

    It begins at (x, y) from the neutral foot; the region is wider by `slack` on each side.
    """
    share = 1.0
    for k in range(len(region)):
        along = region[k, 0] * dx + region[k, 1] * dy
        left = max(region[k, 2] + slack - region[k, 0] * x - region[k, 1] * y, 0.0)
        if along > max(left, 1e-12):
            share = min(share, left / along)
    return share


def foothold_regions(model: np.void, pose: tuple[float, ...]) -> np.ndarray:
    """Return the foothold regions of all legs on level ground at a pose, shape (L, K, 3)."""
    regions = np.zeros((model["leg_count"], DIRECTIONS, 3))
    for leg, region in enumerate(regions):
        bound_region(model, leg, np.array(pose), np.zeros(3), region)
    return regions
