"""Limits of velocity and pose: of a gait's steady walk, and of the walk from its present state."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.body_motion import com_in_odom, leg_moment, standing_feet, sway_wave
from phasmid.control.constraints import (
    CLEARANCE,
    NOTHING,
    REACH,
    SPEED,
    SUPPORT,
    Constraint,
    largest_share,
)
from phasmid.control.reach import PLANNED, joints_at, region_share, to_hip_frame
from phasmid.control.swing import blend, lift
from phasmid.control.types import SUPPORT_MARGIN, LegPhase, Model, Reference, State
from phasmid.control.vectors import (
    in_odom,
    in_path,
    integrate_twist,
    is_zero,
    point_velocity,
    rotate,
    rotate_back,
    rotation,
)
from phasmid.gait.support_kernels import line_margin, support_edges
from phasmid.kinematics.frames import trunk_clearance
from phasmid.kinematics.leg_kernels import joint_motion
from phasmid.kinematics.vector_kernels import turned
from phasmid.robot import Robot

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

CLOSE, CLOSE_POSE = 1e-3, 2**-10
"""Relative error of largest velocities, a quarter of that of the scale of a command; error of the
scale of a pose."""

LEAST_CLEARANCE = 0.02
"""Least clearance of the trunk over the ground; compliant joints take part of it [m]."""


@compiled
def lift_lag(reference: Reference) -> float:
    """Return the time for which the body gains on a foot after its lift-off [s].

    With a period P, a swing T and a displacement D in a cycle the foot's quintic begins as
    10 D (t/T)³. It lags its place on the ground the most, by two thirds of t at the body's speed,
    at t² = T³ / (30 P).
    """
    swing = (1.0 - reference.duty_factor) * reference.period
    return 2.0 / 3.0 * math.sqrt(swing**3 / (30.0 * reference.period))


@compiled
def time_to_lift(reference: Reference, leg: int, phase: float) -> float:
    """Return the time until a leg lifts, where the gait's clock is at a phase [s]."""
    if reference.walks == 0:
        return math.inf
    return float((1.0 - (phase - reference.lift_phase[leg]) % 1.0) * reference.period)


@compiled
def region_speed_share(
    state: State, model: Model, reference: Reference, velocity: np.ndarray, phase: float
) -> float:
    """Return the share of a velocity, at most 1, that keeps feet in their regions until lift-off.

    The gait's clock is at a phase.
    """
    share = 1.0
    if is_zero(velocity):
        return share
    for leg in range(state.leg_count):
        if state.leg_phase[leg] != LegPhase.STANCE or not reference.used[leg]:
            continue
        time = time_to_lift(reference, leg, phase)
        fx, fy = in_path(state.path, state.foot[leg, 0], state.foot[leg, 1])
        there = integrate_twist(ORIGIN, velocity, max(time, SHORTEST) + lift_lag(reference))
        ex, ey = in_path(there, fx, fy)
        x, y = fx - model.neutral[leg, 0], fy - model.neutral[leg, 1]
        sway = state.clock.sway_share * sway_wave(model, reference, reference.lift_phase[leg])[0]
        inside = region_share(state.region[leg], x - sway[0], y - sway[1], ex - fx, ey - fy, SLACK)
        share = min(share, inside)
    return share


@compiled
def support_speed_share(state: State, reference: Reference, velocity: np.ndarray) -> float:
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
    edges = np.empty((legs * legs, 5))
    count = support_edges(state.foot, standing_feet(state, reference), edges)
    share = 1.0
    for k in range(count):
        x, y, dx, dy = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        # Only edges that come nearer.
        closing = (dy * wx - dx * wy) * left
        if closing > 1e-12:
            depth = dx * (ry - y) - dy * (rx - x) + PLANNED_MARGIN / 2
            share = min(share, max(depth, 0.0) / closing)
    return share


@compiled
def stays_in_region(
    model: Model, reference: Reference, region: np.ndarray, leg: int, velocity: np.ndarray
) -> bool:
    """Return whether a steady walk keeps a foot in its region, from touchdown to lift-off."""
    duty, period = reference.duty_factor, reference.period
    nx, ny = model.neutral[leg, 0], model.neutral[leg, 1]
    for lands in (True, False):
        time = -duty * period / 2 if lands else duty * period / 2 + lift_lag(reference)
        x, y = in_path(integrate_twist(ORIGIN, velocity, time), nx, ny)
        phase = reference.lift_phase[leg] + (1 - duty if lands else 0.0)
        sway = sway_wave(model, reference, phase)[0]
        if region_share(region, 0.0, 0.0, x - nx - sway[0], y - ny - sway[1], 0.0) < 1.0:
            return False
    return True


@compiled
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
    vx, vy = turned(-there[2], vx, vy)
    foot_velocity[0] = vx - velocity[0] + velocity[2] * foot[1]
    foot_velocity[1] = vy - velocity[1] - velocity[2] * foot[0]
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
    R, body = rotation(pose[3], pose[4], pose[5]), np.empty(3)
    feet, stance = np.zeros((legs, 3)), np.zeros(legs, dtype=np.bool_)
    q, qd, qdd, v, zero = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.zeros(3)
    for n in range(SAMPLES):
        phase, excess, fast_leg, fast_joint = n / SAMPLES, 0.0, -1, -1
        sway = sway_wave(model, reference, phase)
        body[:2] = pose[:2] + sway[0]
        body[2] = model.height + pose[2]
        moment = model.body_moment.copy()
        for leg in range(legs):
            if not reference.used[leg]:
                moment += leg_moment(model, leg, model.folded[leg])
                continue
            own = (phase - reference.lift_phase[leg]) % 1.0
            foot = feet[leg]
            stance[leg] = set_steady_foot(model, reference, leg, velocity, own, foot, v)
            x, y, z = to_hip_frame(model, leg, R, body, foot[0], foot[1], foot[2])
            q[0], q[1], q[2], margin = joints_at(model, leg, x, y, z)
            if not margin >= PLANNED:
                return Constraint(REACH, leg, -1, 0.0)
            v[:2] -= sway[1] / period
            v_hip = rotate_back(model.R_body_hip[leg], rotate_back(R, v))
            joint_motion(model.lengths[leg], model.lengths[leg, 3], q, v_hip, zero, qd, qdd)
            for k in range(3):
                over = abs(qd[k]) - model.joint_speed[leg, k] * PLANNED_SPEED_SHARE
                if over > excess:
                    excess, fast_leg, fast_joint = over, leg, k
            moment += leg_moment(model, leg, q)
        if excess > 0.0:
            return Constraint(SPEED, fast_leg, fast_joint, 0.0)
        com = body + rotate(R, moment / model.mass)
        margin = line_margin(feet, stance, com[0], com[1])
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
    robot: Robot, model: np.void, reference: np.void, base: np.ndarray, pose: np.ndarray
) -> tuple[float, Constraint]:
    """Return the largest share of a pose at which a robot can step on the spot.

    The pose adds to a base that is not scaled; where the base has less than `LEAST_CLEARANCE`, the
    pose must not reduce it. A duty factor of 1 in the reference is standing.
    """
    # On the spot the feet stay at their neutral places, which need no region.
    regions = np.zeros((int(model["leg_count"]), 1, 3))
    regions[:, :, 2] = 1.0
    height = float(model["height"]) + robot.foot_radius
    least = min(LEAST_CLEARANCE, trunk_clearance(robot, height, base))

    def constraint_at(share: float) -> Constraint:
        scaled = base + share * pose
        if trunk_clearance(robot, height, scaled) < least:
            return Constraint(CLEARANCE, -1, -1, 0.0)
        return steady_walk_constraint(model, regions, reference, scaled, np.zeros(3))

    return largest_share(constraint_at, absolute=CLOSE_POSE)
