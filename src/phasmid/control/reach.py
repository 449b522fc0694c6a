"""Where feet may stand: a convex region for each leg, and how fast the body may go above it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from phasmid.compiled import compiled, internal
from phasmid.control.limbs import angles_of, rotation, to_hip
from phasmid.control.state import DIRECTIONS, PROBING, STANCE, SWING
from phasmid.control.trunk import ride

SLACK = 0.001
"""Feet may come this much nearer to the region's edge than planned, which is round-off and the
feet's arcs [m]."""

CORNERS = math.cos(math.pi / DIRECTIONS)
"""Of a regular polygon: distance of its sides over that of its corners."""

SHORTEST = 0.02
"""A foot whose lift waits is taken to stand at least this long [s]."""

STEPS, AIM, CLOSE, NEAR, GUESSES = 8, 1.002, 1.005, 1e-4, 4
"""How the edge of a region is found along a ray: by so many steps; the room that is aimed at
between two, and that which is near enough to 1; or so near that a place beyond is known to be none
[m]; and how often it is guessed by a line before the way is halved."""

PLANNED, HARD = 1.0, 0.2
"""Shares of the margins of stretch and of joint limits: of what is planned, and of all targets."""


@internal
def room_of(model: Any, tuning: Any, leg: int, p: np.ndarray, q: np.ndarray) -> float:
    """Room that a leg has with its foot somewhere, in shares of the margins; write its angles.

    Args:
        model: The robot.
        tuning: The margins.
        leg: The leg's index.
        p: Foot in the hip frame [m], shape (3,).
        q: Written [rad], shape (3,).

    Returns:
        1 where all margins are just kept, negative out of reach, minus infinity where no angles
        are.
    """
    lengths = model.lengths[leg]
    q[0], q[1], q[2], margin = angles_of(lengths, p[0], p[1], p[2], 1.0)
    # Written so that NaN counts as out of reach.
    if not margin > 0:
        return -math.inf
    out = math.sqrt(p[0] * p[0] + p[1] * p[1]) - lengths[0]
    length = math.sqrt(out * out + p[2] * p[2]) / (lengths[1] + lengths[2])
    room = (1 - length) / max(1 - tuning.stretch, 1e-9)
    for k in range(3):
        low, high = model.limits[leg, k, 0], model.limits[leg, k, 1]
        edge = max(min(tuning.joint_margin, (high - low) / 8), 1e-9)
        room = min(room, (q[k] - low) / edge, (high - q[k]) / edge)
    return room


@internal
def reaches(model: Any, tuning: Any, leg: int, p: np.ndarray, share: float, q: np.ndarray) -> bool:
    """Whether a leg can put its foot somewhere; write the joint angles for it.

    Args:
        model: The robot.
        tuning: The margins.
        leg: The leg's index.
        p: Foot in the hip frame [m], shape (3,).
        share: Share of the margins that must be kept.
        q: Written where it is within the leg's length [rad], shape (3,).
    """
    return room_of(model, tuning, leg, p, q) >= share


@internal
def is_reached(state: Any, model: Any, tuning: Any, leg: int, p_odom: np.ndarray) -> bool:
    """Whether a leg can put its foot at a place in odom, as the body is now."""
    p, p_body, p_hip = np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        p[i] = p_odom[i] - state.trunk[0, i]
    to_hip(state.body, p, p_body)
    for i in range(3):
        p_body[i] -= model.p_body_hip[leg, i]
    to_hip(model.R_body_hip[leg], p_body, p_hip)
    return reaches(model, tuning, leg, p_hip, PLANNED / 2, p)


@internal
def room_along(
    model: Any,
    tuning: Any,
    leg: int,
    start: np.ndarray,
    way: np.ndarray,
    r: float,
    p: np.ndarray,
    q: np.ndarray,
) -> float:
    """Room that a leg has with its foot on a ray, so far along it; see `edge_of`."""
    for i in range(3):
        p[i] = start[i] + r * way[i]
    return room_of(model, tuning, leg, p, q)


@internal
def edge_of(
    model: Any,
    tuning: Any,
    leg: int,
    start: np.ndarray,
    way: np.ndarray,
    room: float,
    p: np.ndarray,
    q: np.ndarray,
) -> float:
    """How far along a ray a foot may stand, up to the length of femur and tibia [m].

    Steps as long as a part of the leg go up to the first place that is too far. From there on it is
    the Illinois method, and halving where rooms tell no line: they jump as a foot passes the hip.

    Args:
        model: The robot.
        tuning: The margins.
        leg: The leg's index.
        start: Where the ray begins in the hip frame [m], shape (3,).
        way: Its direction there, as long as the distance counts, shape (3,).
        room: That the leg has at the beginning.
        p: To work in, shape (3,).
        q: The same.
    """
    length = (model.lengths[leg, 1] + model.lengths[leg, 2]) / STEPS
    low, high, inner, outer = 0.0, 0.0, room - AIM, 0.0
    for _ in range(STEPS):
        high += length
        found = room_along(model, tuning, leg, start, way, high, p, q)
        if not found >= 1.0:
            outer = AIM - found
            break
        low, inner = high, found - AIM
    if low == high:
        return low
    tries, last = 0, -1
    while high - low > NEAR:
        tries += 1
        r = (low + high) / 2
        if tries <= GUESSES and inner > 0.0 and math.isfinite(outer):
            r = low + (high - low) * inner / (inner + outer)
        found = room_along(model, tuning, leg, start, way, r, p, q)
        if found >= 1.0:
            if found < CLOSE:
                return r
            low, inner = r, found - AIM
            outer, last = outer / 2 if last == 1 else outer, 1
        else:
            high, outer = r, AIM - found
            inner, last = inner / 2 if last == -1 else inner, -1
    return low


@compiled
def bound_region(
    model: Any, tuning: Any, leg: int, pose: np.ndarray, slope: np.ndarray, region: np.ndarray
) -> None:
    """Write the half-planes within which a foot may stand while the body has a pose.

    They are inscribed in what the leg reaches along rays from its neutral foot.

    Args:
        model: The robot.
        tuning: The margins.
        leg: The leg's index.
        pose: Of the body beside its path and its neutral height, shape (6,).
        slope: Of the ground, ahead and to the left, and by how much the foot stands higher than
            that [m], shape (3,).
        region: Written: normal ahead and left, and distance from the neutral foot [m], (K, 3).
    """
    R = np.empty((3, 3))
    rotation(pose[3], pose[4], pose[5], R)
    v, p_body, q = np.empty(3), np.empty(3), np.empty(3)
    start, way, p = np.empty(3), np.empty(3), np.empty(3)
    cx, cy = model.neutral[leg, 0], model.neutral[leg, 1]
    v[0], v[1] = cx - pose[0], cy - pose[1]
    v[2] = slope[2] + slope[0] * cx + slope[1] * cy - model.height - pose[2]
    to_hip(R, v, p_body)
    for i in range(3):
        p_body[i] -= model.p_body_hip[leg, i]
    to_hip(model.R_body_hip[leg], p_body, start)
    room = room_of(model, tuning, leg, start, q)
    edge = np.empty((DIRECTIONS, 2))
    for k in range(DIRECTIONS):
        angle = 2 * math.pi * k / DIRECTIONS
        v[0], v[1] = math.cos(angle), math.sin(angle)
        v[2] = slope[0] * v[0] + slope[1] * v[1]
        to_hip(R, v, p_body)
        to_hip(model.R_body_hip[leg], p_body, way)
        r = edge_of(model, tuning, leg, start, way, room, p, q)
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
def within(region: np.ndarray, dx: float, dy: float, slack: float) -> float:
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
def wave(
    model: Any,
    used: np.ndarray,
    offsets: np.ndarray,
    gait: np.ndarray,
    phase: float,
    out: np.ndarray,
) -> None:
    """Write the gait's sway, its derivative by phase, and that one's: see `phasmid.gait.sway`.

    Args:
        model: The robot.
        used: Which legs are walked on, shape (L,).
        offsets: When they lift, shape (L,).
        gait: Duty factor, period, sway, shape (3 or more,).
        phase: Of the cycle.
        out: Written: ahead and left [m], shape (3, 2).
    """
    out[:] = 0.0
    if gait[2] == 0.0:
        return
    legs = len(offsets)
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
        x = gait[2] * (mx - model.neutral[i, 0])
        y = gait[2] * (my - model.neutral[i, 1])
        angle = 2 * math.pi * (phase - offsets[i] - (1 - gait[0]) / 2)
        c, s = math.cos(angle), math.sin(angle)
        rate = 2 * math.pi
        out[0, 0] += c * x
        out[0, 1] += c * y
        out[1, 0] -= rate * s * x
        out[1, 1] -= rate * s * y
        out[2, 0] -= rate * rate * c * x
        out[2, 1] -= rate * rate * c * y


@internal
def lag_of(gait: np.ndarray) -> float:
    """Time for which the body goes on before a foot that has lifted overtakes it [s].

    The foot's quintic begins as 10 D (t/T)³, D being the body's way in a cycle: it is behind its
    place on the ground the most, by two thirds of t at the body's speed, at t² = T³ / (30 P).

    Args:
        gait: Duty factor, and period P [s], shape (2 or more,).
    """
    swing = (1.0 - gait[0]) * gait[1]
    return 2.0 / 3.0 * math.sqrt(swing**3 / (30.0 * gait[1]))


@internal
def speed_share(
    state: Any,
    model: Any,
    used: np.ndarray,
    velocity: np.ndarray,
    offsets: np.ndarray,
    gait: np.ndarray,
    phase: float,
) -> float:
    """Share of a velocity at which every foot stays in its region until it lifts.

    Args:
        state: Where the engine is.
        model: The robot.
        used: Which legs are walked on, shape (L,).
        velocity: Of the path, ahead, left and turn, shape (3,).
        offsets: When the legs lift, shape (L,).
        gait: Duty factor, period and sway, shape (3 or more,).
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
    swaying, lag = gait[2] * state.clock[2], lag_of(gait)
    for leg in range(len(used)):
        if state.leg[leg] != STANCE or not used[leg]:
            continue
        time = (1.0 - (phase - offsets[leg]) % 1.0) * gait[1]
        time = max(time, SHORTEST) + lag
        x, y = state.foot[leg, 0] - path[0], state.foot[leg, 1] - path[1]
        x, y = c * x + s * y, c * y - s * x
        ride(origin, velocity, time, there)
        ct, st = math.cos(there[2]), math.sin(there[2])
        ex, ey = x - there[0], y - there[1]
        dx, dy = ct * ex + st * ey - x, ct * ey - st * ex - y
        x, y = x - model.neutral[leg, 0], y - model.neutral[leg, 1]
        if swaying > 0.0:
            # At its lift the body is aside by this.
            wave(model, used, offsets, gait, offsets[leg], aside)
            x -= state.clock[2] * aside[0, 0]
            y -= state.clock[2] * aside[0, 1]
        region = state.region[leg]
        for k in range(DIRECTIONS):
            along = region[k, 0] * dx + region[k, 1] * dy
            if along > 1e-12:
                room = region[k, 2] + SLACK - region[k, 0] * x - region[k, 1] * y
                share = min(share, max(room, 0.0) / along)
    return share


@internal
def support_share(state: Any, tuning: Any, used: np.ndarray, velocity: np.ndarray) -> float:
    """Share of a velocity at which the centre of mass stays over the feet that stand.

    It counts until the last foot that is in the air has landed.

    Args:
        state: Where the engine is.
        tuning: The margins.
        used: Which legs are walked on, shape (L,).
        velocity: Of the path, ahead, left and turn, shape (3,).
    """
    left, legs = 0.0, len(used)
    for leg in range(legs):
        if state.leg[leg] in (SWING, PROBING):
            left = max(left, state.swing[leg, 1] - state.swing[leg, 0])
    if left <= 0.0:
        return 1.0
    c, s = math.cos(state.path[2]), math.sin(state.path[2])
    R, com = state.body, state.com
    rx = R[0, 0] * com[0] + R[0, 1] * com[1] + R[0, 2] * com[2] + state.trunk[0, 0]
    ry = R[1, 0] * com[0] + R[1, 1] * com[1] + R[1, 2] * com[2] + state.trunk[0, 1]
    wx = c * velocity[0] - s * velocity[1] - velocity[2] * (ry - state.path[1])
    wy = s * velocity[0] + c * velocity[1] + velocity[2] * (rx - state.path[0])
    share, feet = 1.0, state.foot
    for i in range(legs):
        if state.leg[i] != STANCE or not used[i]:
            continue
        for j in range(legs):
            if i == j or state.leg[j] != STANCE or not used[j]:
                continue
            dx, dy = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
            length = math.sqrt(dx * dx + dy * dy)
            if length < 1e-9:
                continue
            dx, dy = dx / length, dy / length
            closing = (dy * wx - dx * wy) * left
            if closing <= 1e-12:
                continue
            edge = True
            for k in range(legs):
                if state.leg[k] == STANCE and used[k]:
                    d = dx * (feet[k, 1] - feet[i, 1]) - dy * (feet[k, 0] - feet[i, 0])
                    edge = edge and d > -1e-12
            if edge:
                depth = dx * (ry - feet[i, 1]) - dy * (rx - feet[i, 0])
                share = min(share, max(depth + tuning.planned_margin / 2, 0.0) / closing)
    return share
