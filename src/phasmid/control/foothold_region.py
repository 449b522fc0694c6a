"""Where feet may stand: a convex region for each leg, and how fast the body may go above it."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, inlined, internal
from phasmid.control.body_kernels import rotation, to_hip
from phasmid.control.reach_bounds import AT_ENOUGH, AT_PLANNED, is_within
from phasmid.control.trunk import integrate_twist
from phasmid.control.types import DIRECTIONS, LegPhase, Model, Parameters, Reference, State
from phasmid.gait.support_kernels import edge_depth
from phasmid.kinematics.leg_kernels import Triple, inverse_kinematics

SLACK = 0.001
"""Feet may come this much nearer to the region's edge than planned, which is round-off and the
feet's arcs [m]."""

CORNERS = math.cos(math.pi / DIRECTIONS)
"""Of a regular polygon: distance of its sides over that of its corners."""

SHORTEST = 0.02
"""A foot whose lift waits is taken to stand at least this long [s]."""

STEPS, NEAR = 8, 1e-4
"""How the edge of a region is found along a ray: by so many steps, as long together as femur and
tibia, and from the first place that is too far by halving, to this [m]."""


CACHED_POSES = 8
"""Poses whose foothold regions are cached."""


@internal
def joint_limit_margin(
    model: Model, parameters: Parameters, leg: int, p: np.ndarray, q: np.ndarray
) -> float:
    """Room that a leg has with its foot somewhere, in shares of the margins; write its angles.

    Args:
        model: The robot.
        parameters: The margins.
        leg: The leg's index.
        p: Foot in the hip frame [m], shape (3,).
        q: Written [rad], shape (3,).

    Returns:
        1 where all margins are just kept, negative out of reach, minus infinity where no angles
        are.
    """
    lengths = model.lengths[leg]
    q[0], q[1], q[2], margin = inverse_kinematics(lengths, lengths[3], p[0], p[1], p[2], 1.0)
    # Written so that NaN counts as out of reach.
    if not margin > 0:
        return -math.inf
    beside = p[0] * p[0] + p[1] * p[1] - lengths[3] * lengths[3]
    out = math.sqrt(max(beside, 0.0)) - lengths[0]
    length = math.sqrt(out * out + p[2] * p[2]) / (lengths[1] + lengths[2])
    room = (1 - length) / max(1 - parameters.stretch, 1e-9)
    for k in range(3):
        low, high = model.limits[leg, k, 0], model.limits[leg, k, 1]
        edge = max(min(parameters.joint_margin, (high - low) / 8), 1e-9)
        room = min(room, (q[k] - low) / edge, (high - q[k]) / edge)
    return room


@internal
def reaches(
    model: Model, parameters: Parameters, leg: int, p: np.ndarray, share: float, q: np.ndarray
) -> bool:
    """Whether a leg can put its foot somewhere; write the joint angles for it.

    Args:
        model: The robot.
        parameters: The margins.
        leg: The leg's index.
        p: Foot in the hip frame [m], shape (3,).
        share: Share of the margins that must be kept.
        q: Written where it is within the leg's length [rad], shape (3,).
    """
    return joint_limit_margin(model, parameters, leg, p, q) >= share


@inlined
def to_hip_frame(
    model: Model, leg: int, R: np.ndarray, trunk: np.ndarray, x: float, y: float, z: float
) -> Triple:
    """Where a place is in a leg's hip frame [m].

    Numbers and not arrays: to get memory for these would take longer than what is computed.

    Args:
        model: The robot.
        leg: The leg's index.
        R: Rotation of the body, shape (3, 3).
        trunk: Where the body is [m], shape (3,).
        x: The place, in the same frame as the body [m].
        y: The same.
        z: The same.
    """
    x, y, z = x - trunk[0], y - trunk[1], z - trunk[2]
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
def is_reached(state: State, model: Model, leg: int, x: float, y: float, z: float) -> bool:
    """Whether a leg can put its foot at a place in odom [m], as the body is now."""
    x, y, z = to_hip_frame(model, leg, state.R_odom_body, state.body_position, x, y, z)
    return is_within(model.lengths, model.reach, AT_ENOUGH, leg, x, y, z)


@internal
def region_edge(
    lengths: np.ndarray, reach: np.ndarray, leg: int, start: np.ndarray, way: np.ndarray
) -> float:
    """How far along a ray a foot may stand, up to the length of femur and tibia [m].

    Args:
        lengths: As in `Model`, shape (L, 4).
        reach: The same, shape (2, L, 8).
        leg: The leg's index.
        start: Where the ray begins in the hip frame [m], shape (3,).
        way: Its direction there, as long as the distance counts, shape (3,).
    """
    x, y, z, a, b, c = start[0], start[1], start[2], way[0], way[1], way[2]
    length = (lengths[leg, 1] + lengths[leg, 2]) / STEPS
    low, high = 0.0, 0.0
    for _ in range(STEPS):
        high += length
        if not is_within(lengths, reach, AT_PLANNED, leg, x + high * a, y + high * b, z + high * c):
            break
        low = high
    if low == high:
        return low
    while high - low > NEAR:
        r = (low + high) / 2
        if is_within(lengths, reach, AT_PLANNED, leg, x + r * a, y + r * b, z + r * c):
            low = r
        else:
            high = r
    return low


@compiled
def bound_region(
    model: Model, leg: int, pose: np.ndarray, slope: np.ndarray, region: np.ndarray
) -> None:
    """Write the half-planes within which a foot may stand while the body has a pose.

    They are inscribed in what the leg reaches along rays from its neutral foot.

    Args:
        model: The robot.
        leg: The leg's index.
        pose: Of the body beside its path and its neutral height, shape (6,).
        slope: Of the ground, ahead and to the left, and by how much the foot stands higher than
            that [m], shape (3,).
        region: Written: normal ahead and left, and distance from the neutral foot [m], (K, 3).
    """
    R = np.empty((3, 3))
    rotation(pose[3], pose[4], pose[5], R)
    v, p_body = np.empty(3), np.empty(3)
    start, way = np.empty(3), np.empty(3)
    cx, cy = model.neutral[leg, 0], model.neutral[leg, 1]
    v[0], v[1] = cx - pose[0], cy - pose[1]
    v[2] = slope[2] + slope[0] * cx + slope[1] * cy - model.height - pose[2]
    to_hip(R, v, p_body)
    for i in range(3):
        p_body[i] -= model.p_body_hip[leg, i]
    to_hip(model.R_body_hip[leg], p_body, start)
    edge = np.empty((DIRECTIONS, 2))
    for k in range(DIRECTIONS):
        angle = 2 * math.pi * k / DIRECTIONS
        v[0], v[1] = math.cos(angle), math.sin(angle)
        v[2] = slope[0] * v[0] + slope[1] * v[1]
        to_hip(R, v, p_body)
        to_hip(model.R_body_hip[leg], p_body, way)
        r = region_edge(model.lengths, model.reach, leg, start, way)
        edge[k, 0], edge[k, 1] = r * v[0], r * v[1]
    for k in range(DIRECTIONS):
        angle = 2 * math.pi * k / DIRECTIONS
        nx, ny = math.cos(angle), math.sin(angle)
        a, b = edge[k - 1], edge[(k + 1) % DIRECTIONS]
        # The edge's own normal fits better where the edge is convex.
        mx, my = b[1] - a[1], a[0] - b[0]
        length = math.sqrt(mx * mx + my * my)
        if length > 1e-9:
            mx, my = mx / length, my / length
            outward = mx * (edge[k, 0] - a[0]) + my * (edge[k, 1] - a[1])
            if outward > 0 and mx * nx + my * ny > 0.5:
                nx, ny = mx, my
        region[k, 0], region[k, 1] = nx, ny
        # The corners of a polygon about the edge come onto the edge, where that is round.
        region[k, 2] = CORNERS * max(nx * edge[k, 0] + ny * edge[k, 1], 0.0)


@internal
def region_share(region: np.ndarray, dx: float, dy: float, slack: float) -> float:
    """Share of a way from a neutral foot that stays within its region; at most 1.

    Args:
        region: The half-planes, shape (K, 3).
        dx: The way ahead [m].
        dy: The way to the left [m].
        slack: Width that is added to the region [m].
    """
    share = 1.0
    for k in range(len(region)):
        along = region[k, 0] * dx + region[k, 1] * dy
        if along > region[k, 2] + slack:
            share = min(share, (region[k, 2] + slack) / along)
    return share


@internal
def sway_wave(model: Model, reference: Reference, phase: float, out: np.ndarray) -> None:
    """Write the gait's sway, its derivative by phase, and that one's: see `phasmid.gait.sway`.

    Args:
        model: The robot.
        reference: Gait.
        phase: Of the cycle.
        out: Written: ahead and left [m], shape (3, 2).
    """
    out[:] = 0.0
    if reference.sway == 0.0:
        return
    legs, used, offsets = model.leg_count, reference.used, reference.lift_phase
    mx, my, count = 0.0, 0.0, 0
    for i in range(legs):
        if used[i]:
            mx += model.neutral[i, 0]
            my += model.neutral[i, 1]
            count += 1
    mx, my = mx / max(count, 1), my / max(count, 1)
    for i in range(legs):
        if not used[i]:
            continue
        x = reference.sway * (mx - model.neutral[i, 0])
        y = reference.sway * (my - model.neutral[i, 1])
        angle = 2 * math.pi * (phase - offsets[i] - (1 - reference.duty_factor) / 2)
        c, s = math.cos(angle), math.sin(angle)
        rate = 2 * math.pi
        out[0, 0] += c * x
        out[0, 1] += c * y
        out[1, 0] -= rate * s * x
        out[1, 1] -= rate * s * y
        out[2, 0] -= rate * rate * c * x
        out[2, 1] -= rate * rate * c * y


@internal
def lift_lag(reference: Reference) -> float:
    """Time for which the body goes on before a foot that has lifted overtakes it [s].

    The foot's quintic begins as 10 D (t/T)³, D being the body's way in a cycle: it is behind its
    place on the ground the most, by two thirds of t at the body's speed, at t² = T³ / (30 P).

    Args:
        reference: Duty factor, and period P [s].
    """
    swing = (1.0 - reference.duty_factor) * reference.period
    return 2.0 / 3.0 * math.sqrt(swing**3 / (30.0 * reference.period))


@internal
def speed_share(
    state: State,
    model: Model,
    reference: Reference,
    velocity: np.ndarray,
    phase: float,
) -> float:
    """Share of a velocity at which every foot stays in its region until it lifts.

    Args:
        state: Where the engine is.
        model: The robot.
        reference: Gait.
        velocity: Of the path, ahead, left and turn, shape (3,).
        phase: Of the gait's clock.

    Returns:
        At most 1, and 0 or more.
    """
    if velocity[0] == 0.0 and velocity[1] == 0.0 and velocity[2] == 0.0:
        return 1.0
    share = 1.0
    path = state.path
    c, s = math.cos(path[2]), math.sin(path[2])
    there, aside = np.empty(3), np.empty((3, 2))
    origin = np.zeros(3)
    swaying, lag = reference.sway * state.clock.sway_share, lift_lag(reference)
    for leg in range(state.leg_count):
        if state.leg_phase[leg] != LegPhase.STANCE or not reference.used[leg]:
            continue
        time = (1.0 - (phase - reference.lift_phase[leg]) % 1.0) * reference.period
        time = max(time, SHORTEST) + lag
        x, y = state.foot[leg, 0] - path[0], state.foot[leg, 1] - path[1]
        x, y = c * x + s * y, c * y - s * x
        integrate_twist(origin, velocity, time, there)
        ct, st = math.cos(there[2]), math.sin(there[2])
        ex, ey = x - there[0], y - there[1]
        dx, dy = ct * ex + st * ey - x, ct * ey - st * ex - y
        x, y = x - model.neutral[leg, 0], y - model.neutral[leg, 1]
        if swaying > 0.0:
            # At its lift the body is aside by this.
            sway_wave(model, reference, reference.lift_phase[leg], aside)
            x -= state.clock.sway_share * aside[0, 0]
            y -= state.clock.sway_share * aside[0, 1]
        region = state.region[leg]
        for k in range(DIRECTIONS):
            along = region[k, 0] * dx + region[k, 1] * dy
            if along > 1e-12:
                room = region[k, 2] + SLACK - region[k, 0] * x - region[k, 1] * y
                share = min(share, max(room, 0.0) / along)
    return share


@internal
def support_share(
    state: State, parameters: Parameters, used: np.ndarray, velocity: np.ndarray
) -> float:
    """Share of a velocity at which the centre of mass stays over the feet that stand.

    It counts until the last foot that is in the air has landed.

    Args:
        state: Where the engine is.
        parameters: The margins.
        used: Which legs are walked on, shape (L,).
        velocity: Of the path, ahead, left and turn, shape (3,).
    """
    left, legs = 0.0, state.leg_count
    for leg in range(legs):
        if state.leg_phase[leg] in (LegPhase.SWING, LegPhase.PROBING):
            left = max(left, state.swing_duration[leg] - state.swing_elapsed[leg])
    if left <= 0.0:
        return 1.0
    c, s = math.cos(state.path[2]), math.sin(state.path[2])
    R, com = state.R_odom_body, state.com
    rx = R[0, 0] * com[0] + R[0, 1] * com[1] + R[0, 2] * com[2] + state.body_position[0]
    ry = R[1, 0] * com[0] + R[1, 1] * com[1] + R[1, 2] * com[2] + state.body_position[1]
    wx = c * velocity[0] - s * velocity[1] - velocity[2] * (ry - state.path[1])
    wy = s * velocity[0] + c * velocity[1] + velocity[2] * (rx - state.path[0])
    share, feet, standing = 1.0, state.foot, np.zeros(legs, dtype=np.int64)
    for leg in range(legs):
        standing[leg] = 1 if state.leg_phase[leg] == LegPhase.STANCE and used[leg] else 0
    for i in range(legs):
        if not standing[i]:
            continue
        for j in range(legs):
            if i == j or not standing[j]:
                continue
            dx, dy = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
            # Of the edges that it comes nearer to; closing, depth and room are times their length.
            closing = (dy * wx - dx * wy) * left
            length = math.sqrt(dx * dx + dy * dy)
            if closing > 1e-12 * length and edge_depth(feet, standing, i, j) >= 0.0:
                depth = dx * (ry - feet[i, 1]) - dy * (rx - feet[i, 0])
                room = depth + length * parameters.planned_margin / 2
                share = min(share, max(room, 0.0) / closing)
    return share


class FootholdRegions:
    """Foothold regions of a robot by the body's pose, cached for the last few poses.

    Args:
        model: Record of the robot, L legs.
    """

    def __init__(self, model: np.void) -> None:
        self._model = model
        self._cache: dict[tuple[float, ...], np.ndarray] = {}

    def at(self, pose: np.ndarray) -> np.ndarray:
        """Return half-planes about the neutral feet, as in `State.region`, shape (L, K, 3).

        Args:
            pose: Pose of the body relative to its path [m, rad], shape (6,).
        """
        key = tuple(pose)
        if key not in self._cache:
            if len(self._cache) >= CACHED_POSES:
                self._cache.clear()
            region = np.zeros((self._model["leg_count"], DIRECTIONS, 3))
            for leg in range(len(region)):
                bound_region(self._model, leg, pose, np.zeros(3), region[leg])
            self._cache[key] = region
        return self._cache[key]
