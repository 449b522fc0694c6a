"""Foothold regions: for each leg a convex polygon in which its foot may stand."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, internal
from phasmid.control.body_kernels import rotation, to_hip
from phasmid.control.reach import AT_PLANNED, is_within, to_hip_frame
from phasmid.control.types import DIRECTIONS, Model

CORNERS = math.cos(math.pi / DIRECTIONS)
"""Distance of a regular polygon's sides over that of its corners."""

STEPS, NEAR = 8, 1e-4
"""Steps along a ray, which add up to femur and tibia, and the distance to which its end is bisected
[m]."""


@internal
def region_edge(model: Model, leg: int, start: np.ndarray, ray: np.ndarray) -> float:
    """Return the distance along a ray of the hip frame up to which the leg reaches [m]."""
    x, y, z, a, b, c = start[0], start[1], start[2], ray[0], ray[1], ray[2]
    step = (model.lengths[leg, 1] + model.lengths[leg, 2]) / STEPS
    low, high = 0.0, 0.0
    for _ in range(STEPS):
        high += step
        if not is_within(model, AT_PLANNED, leg, x + high * a, y + high * b, z + high * c):
            break
        low = high
    if low == high:
        return low
    while high - low > NEAR:
        r = (low + high) / 2
        if is_within(model, AT_PLANNED, leg, x + r * a, y + r * b, z + r * c):
            low = r
        else:
            high = r
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
    R, body = np.empty((3, 3)), np.array((pose[0], pose[1], model.height + pose[2]))
    rotation(pose[3], pose[4], pose[5], R)
    v, v_body, ray = np.empty(3), np.empty(3), np.empty(3)
    cx, cy = model.neutral[leg, 0], model.neutral[leg, 1]
    height = slope[2] + slope[0] * cx + slope[1] * cy
    start = np.array(to_hip_frame(model, leg, R, body, cx, cy, height))
    edge = np.empty((DIRECTIONS, 2))
    for k in range(DIRECTIONS):
        angle = 2 * math.pi * k / DIRECTIONS
        v[0], v[1] = math.cos(angle), math.sin(angle)
        v[2] = slope[0] * v[0] + slope[1] * v[1]
        to_hip(R, v, v_body)
        to_hip(model.R_body_hip[leg], v_body, ray)
        r = region_edge(model, leg, start, ray)
        edge[k, 0], edge[k, 1] = r * v[0], r * v[1]
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


@internal
def region_share(region: np.ndarray, dx: float, dy: float) -> float:
    """Return the share, at most 1, of a displacement from a neutral foot inside its region [m]."""
    share = 1.0
    for k in range(len(region)):
        along = region[k, 0] * dx + region[k, 1] * dy
        if along > region[k, 2]:
            share = min(share, region[k, 2] / along)
    return share


def foothold_regions(model: np.void, pose: tuple[float, ...]) -> np.ndarray:
    """Return the foothold regions of all legs on level ground at a pose, shape (L, K, 3)."""
    regions = np.zeros((model["leg_count"], DIRECTIONS, 3))
    for leg, region in enumerate(regions):
        bound_region(model, leg, np.array(pose), np.zeros(3), region)
    return regions
