"""Limits of the velocity: of a gait's steady walk, and of the walk from its present state."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, internal
from phasmid.control.body_kernels import moment_of, rotation, support_margin, to_hip
from phasmid.control.body_motion import (
    com_in_odom,
    in_odom,
    in_path,
    integrate_twist,
    is_zero,
    point_velocity,
    sway_wave,
)
from phasmid.control.constraints import (
    NOTHING,
    REACH,
    SPEED,
    SUPPORT,
    Constraint,
    largest_share,
)
from phasmid.control.foothold_region import region_share
from phasmid.control.reach import PLANNED, joint_limit_margin, to_hip_frame
from phasmid.control.swing import blend, lift
from phasmid.control.types import DIRECTIONS, SUPPORT_MARGIN, LegPhase, Model, Reference, State
from phasmid.gait.support_kernels import edge_depth
from phasmid.kinematics.leg_kernels import joint_motion

PLANNED_SPEED_SHARE, PLANNED_MARGIN = 0.9, 0.004
"""Share of the largest joint speed for a steady walk, and its additional support margin [m]; the
rest is for changes."""

SLACK = 0.001
"""Distance beyond a region's edge that is left to round-off and the feet's arcs [m]."""

SHORTEST = 0.02
"""Least remaining stance of a foot whose lift waits [s]."""

ORIGIN = 0.0, 0.0, 0.0
"""Path before a displacement."""

SAMPLES = 32
"""Samples of a cycle of a steady walk."""

CLOSE = 1e-3
"""Relative error of largest velocities; that of the scale of a command is four times it."""


@internal
def lift_lag(reference: Reference) -> float:
    """Return the time for which the body gains on a foot after its lift-off [s].

    With a period P, a swing T and a displacement D in a cycle the foot's quintic begins as
    10 D (t/T)³. It lags its place on the ground the most, by two thirds of t at the body's speed,
    at t² = T³ / (30 P).
    """
    swing = (1.0 - reference.duty_factor) * reference.period
    return 2.0 / 3.0 * math.sqrt(swing**3 / (30.0 * reference.period))


@internal
def region_speed_share(
    state: State, model: Model, reference: Reference, velocity: np.ndarray, phase: float
) -> float:
    """Return the share of a velocity, at most 1, that keeps feet in their regions until lift-off.

    The gait's clock is at a phase.
    """
    share = 1.0
    if is_zero(velocity):
        return share
    sway, lag = np.empty((3, 2)), lift_lag(reference)
    for leg in range(state.leg_count):
        if state.leg_phase[leg] != LegPhase.STANCE or not reference.used[leg]:
            continue
        time = (1.0 - (phase - reference.lift_phase[leg]) % 1.0) * reference.period
        x, y = in_path(state.path, state.foot[leg, 0], state.foot[leg, 1])
        there = integrate_twist(ORIGIN, velocity, max(time, SHORTEST) + lag)
        ex, ey = in_path(there, x, y)
        dx, dy = ex - x, ey - y
        x, y = x - model.neutral[leg, 0], y - model.neutral[leg, 1]
        if reference.sway * state.clock.sway_share > 0.0:
            sway_wave(model, reference, reference.lift_phase[leg], sway)
            x -= state.clock.sway_share * sway[0, 0]
            y -= state.clock.sway_share * sway[0, 1]
        region = state.region[leg]
        for k in range(DIRECTIONS):
            along = region[k, 0] * dx + region[k, 1] * dy
            if along > 1e-12:
                left = region[k, 2] + SLACK - region[k, 0] * x - region[k, 1] * y
                share = min(share, max(left, 0.0) / along)
    return share


@internal
def support_speed_share(state: State, used: np.ndarray, velocity: np.ndarray) -> float:
    """Return the share of a velocity, at most 1, that keeps the centre of mass supported.

    It stays over the stance feet until the last foot in the air has landed.
    """
    left, legs = 0.0, state.leg_count
    for leg in range(legs):
        if state.leg_phase[leg] in (LegPhase.SWING, LegPhase.PROBING):
            left = max(left, state.swing_duration[leg] - state.swing_elapsed[leg])
    if left <= 0.0:
        return 1.0
    rx, ry = com_in_odom(state)
    wx, wy = point_velocity(state.path, velocity, rx, ry)
    share, feet, stance = 1.0, state.foot, np.zeros(legs, dtype=np.int64)
    for leg in range(legs):
        stance[leg] = state.leg_phase[leg] == LegPhase.STANCE and used[leg]
    for i in range(legs):
        for j in range(legs):
            if i == j or not stance[i] or not stance[j]:
                continue
            dx, dy = feet[j, 0] - feet[i, 0], feet[j, 1] - feet[i, 1]
            # Only edges that come nearer; `closing` and `depth` are multiplied by their length.
            closing = (dy * wx - dx * wy) * left
            length = math.sqrt(dx * dx + dy * dy)
            if closing > 1e-12 * length and edge_depth(feet, stance, i, j) >= 0.0:
                depth = dx * (ry - feet[i, 1]) - dy * (rx - feet[i, 0])
                depth += length * PLANNED_MARGIN / 2
                share = min(share, max(depth, 0.0) / closing)
    return share


@internal
def stays_in_region(
    model: Model, reference: Reference, region: np.ndarray, leg: int, velocity: np.ndarray
) -> bool:
    """Return whether a steady walk keeps a foot in its region, from touchdown to lift-off."""
    duty, period = reference.duty_factor, reference.period
    nx, ny = model.neutral[leg, 0], model.neutral[leg, 1]
    sway = np.empty((3, 2))
    for lands in (True, False):
        time = -duty * period / 2 if lands else duty * period / 2 + lift_lag(reference)
        x, y = in_path(integrate_twist(ORIGIN, velocity, time), nx, ny)
        phase = reference.lift_phase[leg] + (1 - duty if lands else 0.0)
        sway_wave(model, reference, phase, sway)
        if region_share(region, x - nx - sway[0, 0], y - ny - sway[0, 1]) < 1.0:
            return False
    return True


@internal
def set_steady_foot(
    model: Model,
    reference: Reference,
    leg: int,
    velocity: np.ndarray,
    phase: float,
    foot: np.ndarray,
    foot_velocity: np.ndarray,
) -> bool:
    """Write a foot of a steady walk and its velocity in the path's axes; return its stance.

    The phase is that since the leg's lift-off; the foot's height is that above the ground [m].
    """
    duty, period = reference.duty_factor, reference.period
    nx, ny = model.neutral[leg, 0], model.neutral[leg, 1]
    # Place and velocity in the path's axes in the middle of the last stance.
    x, y, vx, vy, foot[2], foot_velocity[2] = nx, ny, 0.0, 0.0, 0.0, 0.0
    stance = phase >= 1 - duty
    time = (phase - (1.0 if stance else 0.0) + duty / 2) * period
    there = integrate_twist(ORIGIN, velocity, time)
    if not stance:
        # From the last foothold to the next, one cycle later.
        dx, dy = in_odom(integrate_twist(ORIGIN, velocity, period), nx, ny)
        dx, dy = dx - nx, dy - ny
        part, air = phase / (1 - duty), (1 - duty) * period
        share, rate, _ = blend(part, air)
        x, y, vx, vy = nx + share * dx, ny + share * dy, rate * dx, rate * dy
        foot[2], foot_velocity[2], _ = lift(part, air, reference.step_height)
    foot[0], foot[1] = in_path(there, x, y)
    c, s = math.cos(there[2]), math.sin(there[2])
    foot_velocity[0] = c * vx + s * vy - velocity[0] + velocity[2] * foot[1]
    foot_velocity[1] = c * vy - s * vx - velocity[1] - velocity[2] * foot[0]
    return bool(stance)


@compiled
def steady_walk_constraint(
    model: Model,
    regions: np.ndarray,
    reference: Reference,
    pose: np.ndarray,
    velocity: np.ndarray,
) -> Constraint:
    """Return the first constraint that a steady walk violates.

    Args:
        model: The robot.
        regions: Foothold regions at that pose, shape (L, K, 3).
        reference: Gait and step height.
        pose: Pose of the body relative to its path and neutral height, shape (6,).
        velocity: Velocity of the path: vx, vy, wz, shape (3,).
    """
    legs, period = model.leg_count, reference.period
    for leg in range(legs):
        if reference.used[leg] and not stays_in_region(
            model, reference, regions[leg], leg, velocity
        ):
            return Constraint(REACH, leg, -1, 0.0)
    R, body, moment, sway = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty((3, 2))
    rotation(pose[3], pose[4], pose[5], R)
    feet, stance = np.zeros((legs, 3)), np.zeros(legs, dtype=np.int64)
    p, v, v_body, a = np.empty(3), np.empty(3), np.empty(3), np.zeros(3)
    q, qd, qdd = np.empty(3), np.empty(3), np.empty(3)
    for n in range(SAMPLES):
        phase, quickest, fast_leg, fast_joint = n / SAMPLES, 0.0, -1, -1
        sway_wave(model, reference, phase, sway)
        body[0], body[1] = pose[0] + sway[0, 0], pose[1] + sway[0, 1]
        body[2] = model.height + pose[2]
        for i in range(3):
            moment[i] = model.body_moment[i]
        for leg in range(legs):
            if not reference.used[leg]:
                moment_of(model, leg, model.folded[leg], moment)
                continue
            own = (phase - reference.lift_phase[leg]) % 1.0
            foot = feet[leg]
            stance[leg] = set_steady_foot(model, reference, leg, velocity, own, foot, v)
            p[0], p[1], p[2] = to_hip_frame(model, leg, R, body, foot[0], foot[1], foot[2])
            if not joint_limit_margin(model, leg, p, q) >= PLANNED:
                return Constraint(REACH, leg, -1, 0.0)
            v[0], v[1] = v[0] - sway[1, 0] / period, v[1] - sway[1, 1] / period
            to_hip(R, v, v_body)
            to_hip(model.R_body_hip[leg], v_body, v)
            joint_motion(model.lengths[leg], model.lengths[leg, 3], q, v, a, qd, qdd)
            for k in range(3):
                if abs(qd[k]) > quickest:
                    quickest, fast_leg, fast_joint = abs(qd[k]), leg, k
            moment_of(model, leg, q, moment)
        if quickest > model.joint_speed * PLANNED_SPEED_SHARE:
            return Constraint(SPEED, fast_leg, fast_joint, 0.0)
        for i in range(3):
            moment[i] /= model.mass
        x = body[0] + R[0, 0] * moment[0] + R[0, 1] * moment[1] + R[0, 2] * moment[2]
        y = body[1] + R[1, 0] * moment[0] + R[1, 1] * moment[1] + R[1, 2] * moment[2]
        margin = support_margin(feet, stance, x, y)
        if margin < SUPPORT_MARGIN + PLANNED_MARGIN:
            return Constraint(SUPPORT, -1, -1, margin)
    return Constraint(NOTHING, -1, -1, 0.0)


def feasible_velocity_scale(
    model: np.void,
    regions: np.ndarray,
    reference: np.void,
    pose: np.ndarray,
    velocity: np.ndarray,
    most: float,
) -> tuple[float, Constraint]:
    """Return the largest share of a velocity, up to `most`, of a feasible steady walk.

    Arguments are those of `steady_walk_constraint`, and records.
    """
    return largest_share(
        lambda share: steady_walk_constraint(model, regions, reference, pose, share * velocity),
        most,
        relative=CLOSE if most > 1.0 else 4 * CLOSE,
    )


def feasible_pose_scale(
    model: np.void,
    reference: np.void,
    base: np.ndarray,
    pose: np.ndarray,
) -> tuple[float, Constraint]:
    """Return the largest share of a pose at which a robot can step on the spot.

    The pose adds to a base that is not scaled. A duty factor of 1 in the reference is standing.
    """
    # On the spot the feet stay at their neutral places, which need no region.
    regions = np.zeros((int(model["leg_count"]), 1, 3))
    regions[:, :, 2] = 1.0
    return largest_share(
        lambda share: steady_walk_constraint(
            model, regions, reference, base + share * pose, np.zeros(3)
        ),
        absolute=2**-10,
    )
