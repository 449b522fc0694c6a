"""The compiled update of the locomotion engine.

`LocomotionEngine` and `EngineBatch` call `update` on records of `Memory`.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, inlined, internal
from phasmid.control.body_kernels import moment_of, support_margin, to_hip
from phasmid.control.body_motion import (
    POSE_BANDWIDTH,
    SWAY_BANDWIDTH,
    VELOCITY_BANDWIDTH,
    approach,
    follow,
    integrate_twist,
    set_body_motion,
    sway_wave,
)
from phasmid.control.estimation.estimator import estimate_ground
from phasmid.control.feed_forward.feed_forward import compute_feed_forward
from phasmid.control.foothold_region import bound_region
from phasmid.control.foothold_search import end_search, is_returning, is_searching
from phasmid.control.gait_scheduler import advance_phase, best_phase
from phasmid.control.leg_phases import land_here, move_feet, stand
from phasmid.control.reach import HARD, joint_limit_margin
from phasmid.control.reference_governor import is_recoverable, is_settled
from phasmid.control.swing import (
    foot_at_joints,
    hold_leg,
    soften_joint_limits,
)
from phasmid.control.types import SUPPORT_MARGIN, LegPhase, Manoeuvre, Model, Reference, State
from phasmid.control.velocity_limits import region_speed_share, support_speed_share
from phasmid.kinematics.leg_kernels import joint_motion

POSE_SPEED, POSE_TURN_SPEED = 0.08, 0.5
"""Largest speeds at which the body approaches its commanded pose [m/s, rad/s]."""

LEAST = 0.5
"""Share of the support margin of a lift that the motion of the trunk must keep."""

STRAIGHT = -0.2
"""Knee angle beyond which a knee turns too fast for the foot's speed [rad]."""

STALE = 1e-3
"""Change of body, ground or foot after which a foothold region is computed anew [m]."""

RETURN_SPEED = 0.06
"""Speed of the body that returns from where a foot has found no ground [m/s]."""

STUCK = 1e-3
"""Time scale below which a slow-down does not end by itself."""

RECOVERY = 2.0
"""Rate at which the time scale recovers [1/s]."""


@internal
def return_velocity(state: State, velocity: np.ndarray) -> None:
    """Write the velocity of the body while feet return to their last footholds.

    Args:
        state: State of the engine.
        velocity: Written: vx, vy [m/s] and wz [rad/s], shape (3,).
    """
    x, y = 0.0, 0.0
    for leg in range(state.leg_count):
        if is_returning(state, leg):
            x += state.last_foothold[leg, 0] - state.missed_foothold[leg, 0]
            y += state.last_foothold[leg, 1] - state.missed_foothold[leg, 1]
    size = max(math.sqrt(x * x + y * y), 1e-6)
    c, s = math.cos(state.path[2]), math.sin(state.path[2])
    velocity[0] = RETURN_SPEED * (c * x + s * y) / size
    velocity[1] = RETURN_SPEED * (c * y - s * x) / size
    velocity[2] = 0.0


@internal
def advance_body(state: State, model: Model, reference: Reference, h: float) -> None:
    """Advance velocity, path, pose and ground plane towards the reference."""
    clock, speed, pose = state.clock, state.velocity_filter, state.pose_filter
    probing, looking, returns = False, False, False
    for leg in range(state.leg_count):
        probing = probing or state.leg_phase[leg] == LegPhase.PROBING
        looking = looking or is_searching(state, leg)
        returns = returns or is_returning(state, leg)
    velocity = reference.velocity.copy()
    if returns:
        return_velocity(state, velocity)
    share = region_speed_share(state, model, reference, velocity, clock.phase)
    share = min(share, support_speed_share(state, reference.used, velocity))
    if reference.gait_pending:
        share = min(share, clock.velocity_share * math.exp(-4 * h))
    if not returns and (looking or (clock.lift_wait > 0.0 and not probing)):
        # While a lift waits only for a probing foot, the body goes on as far as its feet allow.
        share = 0.0
    if reference.sway > 0.0:
        # A body that does not sway yet would move beyond its feet before one may lift.
        share *= clock.sway_share
    clock.velocity_share = 0.0 if returns else share
    target, old = np.empty(3), np.empty(3)
    for i in range(3):
        target[i] = share * velocity[i]
    next_reference = np.empty(6)
    for i in range(6):
        next_reference[i] = reference.pose[i] + reference.pose_correction[i]
    draft, goal = speed[0].copy(), pose[0].copy()
    approach(draft, target, 0, model.radius, model.acceleration * h)
    approach(goal, next_reference, 0, 1.0, POSE_SPEED * h)
    approach(goal, next_reference, 3, 1.0, POSE_TURN_SPEED * h)
    changes = not (is_settled(pose, next_reference, 1e-4) and is_settled(speed, target, 1e-3))
    if changes and not is_recoverable(state, model, reference, draft, goal):
        # The pose waits; if that is not enough, the walk does.
        goal[:] = pose[0]
        if not is_recoverable(state, model, reference, draft, goal):
            clock.velocity_share = 0.0
            draft[:] = speed[0]
            approach(draft, np.zeros(3), 0, model.radius, model.acceleration * h)
    for i in range(3):
        old[i] = speed[2, i]
        speed[0, i] = draft[i]
    follow(speed, VELOCITY_BANDWIDTH, h)
    for i in range(3):
        old[i] = (old[i] + speed[2, i]) / 2
    state.path[0], state.path[1], state.path[2] = integrate_twist(state.path, old, h)
    for i in range(6):
        pose[0, i] = goal[i]
    follow(pose, POSE_BANDWIDTH, h)
    n, ground = reference.ground_normal, state.ground_filter
    ground[0, 0], ground[0, 1], ground[0, 2] = reference.ground_height, -n[0] / n[2], -n[1] / n[2]
    follow(ground, POSE_BANDWIDTH, h)


@internal
def advance_sway(state: State, model: Model, reference: Reference, h: float) -> None:
    """Let the body sway with the gait's clock, and lean where that is commanded."""
    clock, sway, aside = state.clock, state.sway_filter, np.empty((3, 2))
    # What the filter's three lags delay and weaken is made up for, at the gait's own rate.
    x = 2 * math.pi / (reference.period * SWAY_BANDWIDTH)
    lead, gain = 3 * math.atan(x) / (2 * math.pi), (1 + x * x) ** 1.5
    sway_wave(model, reference, clock.phase + lead, aside)
    for i in range(2):
        sway[0, i] = clock.sway_share * gain * aside[0, i] + clock.lean[i]
    follow(sway, SWAY_BANDWIDTH, h)


@internal
def solve_leg_ik(state: State, model: Model, h: float) -> bool:
    """Write joint angles, speeds and accelerations for body and feet; return whether all reach."""
    R = state.R_odom_body
    p, v, a = np.empty(3), np.empty(3), np.empty(3)
    rp, rv, ra, hip = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    w, wd = state.angular_velocity, state.angular_acceleration
    for i in range(3):
        state.com[i] = model.body_moment[i]
    for leg in range(state.leg_count):
        if state.leg_phase[leg] == LegPhase.HELD:
            hold_leg(state, model, leg, h)
            moment_of(model, leg, state.q[leg], state.com)
            continue
        for i in range(3):
            p[i] = state.foot[leg, i] - state.body_position[i]
            v[i] = state.foot_velocity[leg, i] - state.body_velocity[i]
            a[i] = state.foot_acceleration[leg, i] - state.body_acceleration[i]
        # In the turning body: v' = v - w x p, a' = a - w' x p - 2 w x v' - w x (w x p).
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            rv[i] = w[j] * p[k] - w[k] * p[j]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            ra[i] = (
                a[i]
                - (wd[j] * p[k] - wd[k] * p[j])
                - (w[j] * rv[k] - w[k] * rv[j])
                - 2 * (w[j] * (v[k] - rv[k]) - w[k] * (v[j] - rv[j]))
            )
        for i in range(3):
            rv[i] = v[i] - rv[i]
        R_hip = model.R_body_hip[leg]
        to_hip(R, p, rp)
        for i in range(3):
            rp[i] -= model.p_body_hip[leg, i]
        to_hip(R_hip, rp, hip)
        # A probing foot may come from a swing that was softened at the joint limits.
        swings = state.leg_phase[leg] in (LegPhase.SWING, LegPhase.PROBING)
        room = joint_limit_margin(model, leg, hip, state.q[leg])
        bent = state.q[leg, 2] < STRAIGHT
        if room < HARD and (room == -math.inf or not (swings and bent)):
            return False
        to_hip(R, rv, rp)
        to_hip(R_hip, rp, v)
        to_hip(R, ra, rp)
        to_hip(R_hip, rp, a)
        lengths, qd, qdd = model.lengths[leg], state.qd[leg], state.qdd[leg]
        joint_motion(lengths, lengths[3], state.q[leg], v, a, qd, qdd)
        if swings and not soften_joint_limits(state, model, leg):
            return False
        moment_of(model, leg, state.q[leg], state.com)
    for i in range(3):
        state.com[i] /= model.mass
    return True


@internal
def measure_support(state: State) -> float:
    """Return the present support margin of the whole robot [m]."""
    R, com, trunk = state.R_odom_body, state.com, state.body_position
    standing = np.zeros(state.leg_count, dtype=np.int64)
    for leg in range(state.leg_count):
        standing[leg] = 1 if state.leg_phase[leg] == LegPhase.STANCE else 0
    x = trunk[0] + R[0, 0] * com[0] + R[0, 1] * com[1] + R[0, 2] * com[2]
    y = trunk[1] + R[1, 0] * com[0] + R[1, 1] * com[1] + R[1, 2] * com[2]
    return support_margin(state.foot, standing, x, y)


@internal
def change_gait(
    state: State, model: Model, reference: Reference, next_reference: Reference
) -> None:
    """Change to the pending gait as soon as all feet stay in their foothold regions in it."""
    if not reference.gait_pending:
        return
    phase, share = best_phase(state, model, next_reference)
    speed, commanded = 0.0, 0.0
    for i in range(3):
        scale = model.radius if i == 2 else 1.0
        speed += (scale * state.velocity_filter[2, i]) ** 2
        commanded += (scale * next_reference.velocity[i]) ** 2
    ready = state.clock.gait_running == 0 or share >= 1.0 - 1e-9 or speed < 1e-8
    if not ready and not share > 0:
        return
    if ready or math.sqrt(speed) <= share * math.sqrt(commanded):
        reference.duty_factor, reference.period, reference.sway = (
            next_reference.duty_factor,
            next_reference.period,
            next_reference.sway,
        )
        reference.lift_phase[:] = next_reference.lift_phase
        reference.used[:] = next_reference.used
        reference.gait_pending = 0
        if share >= 0:
            state.clock.phase = phase


@inlined
def advance(state: State, model: Model, reference: Reference, h: float, held: bool) -> bool:
    """Advance the whole motion by a time step; return whether all feet are reachable.

    Args:
        state: State of the engine, changed.
        model: The robot.
        reference: Reference of the motion.
        h: Time step [s].
        held: Whether the trunk stays at rest.
    """
    if not held:
        advance_body(state, model, reference, h)
    # Feet land before others lift: in many gaits they do so at the same instant.
    move_feet(state, model, reference, h)
    advance_phase(state, model, reference, h)
    if not held:
        advance_sway(state, model, reference, h)
    set_body_motion(state, model)
    if not solve_leg_ik(state, model, h):
        return False
    state.clock.support_margin = measure_support(state)
    return True


@internal
def scale_stages(stages: np.ndarray, share: float) -> None:
    """Scale the differences of a filter's stages to its last one."""
    last = len(stages) - 1
    for i in range(stages.shape[1]):
        for k in range(last):
            stages[k, i] = stages[last, i] + share * (stages[k, i] - stages[last, i])


@internal
def brake(state: State, share: float) -> None:
    """Scale the speed of the trunk's motion at once."""
    for i in range(3):
        for k in range(3):
            state.velocity_filter[k, i] *= share
    scale_stages(state.pose_filter, share)
    scale_stages(state.sway_filter, share)


@internal
def update_region(state: State, model: Model, leg: int) -> None:
    """Compute a foothold region anew if body, ground or foot have changed by `STALE`."""
    g, posed, slope = state.ground_filter[3], state.region_pose[leg], np.empty(3)
    c, s = math.cos(state.path[2]), math.sin(state.path[2])
    slope[0], slope[1] = c * g[1] + s * g[2], c * g[2] - s * g[1]
    foot = state.touchdown[leg]
    slope[2] = foot[2] - g[0] - g[1] * foot[0] - g[2] * foot[1]
    # Angles count by the distance that they move a foot.
    away = abs(slope[2] - posed[8])
    for i in range(3):
        away = max(away, abs(state.pose_filter[3, i] - posed[i]))
        away = max(away, model.radius * abs(state.pose_filter[3, 3 + i] - posed[3 + i]))
    for i in range(2):
        away = max(away, model.radius * abs(slope[i] - posed[6 + i]))
    if away < STALE and state.region[leg, 0, 0] != 0.0:
        return
    for i in range(6):
        posed[i] = state.pose_filter[3, i]
    posed[6], posed[7], posed[8] = slope[0], slope[1], slope[2]
    bound_region(model, leg, state.pose_filter[3], slope, state.region[leg])


@internal
def stop_manoeuvre(state: State, leg: int) -> None:
    """Set the manoeuvre of a stopped foot; a foot that was rising draws back next."""
    if state.manoeuvre[leg] == Manoeuvre.DRAW_BACK:
        state.manoeuvre[leg] = Manoeuvre.STOPPED
    elif state.manoeuvre[leg] == Manoeuvre.RISE:
        state.manoeuvre[leg] = Manoeuvre.DRAW_BACK


@compiled
def place(memories: np.ndarray) -> bool:
    """Compute regions, body motion and joint angles at rest; return whether all feet are reachable.

    Args:
        memories: Record of `Memory`, changed, shape (1,).
    """
    state, model = memories[0].states[0], memories[0].model
    for leg in range(state.leg_count):
        update_region(state, model, leg)
    set_body_motion(state, model)
    if not solve_leg_ik(state, model, 0.0):
        return False
    state.clock.support_margin = measure_support(state)
    return True


@compiled
def advance_engine(
    states: list[State], references: list[Reference], model: Model, dt: float
) -> int:
    """Advance the motion by an update period, slower where a limit demands it.

    Args:
        states: State of the engine, changed, and one for trials.
        references: Reference, and the same with the pending gait.
        model: The robot.
        dt: Update period [s].

    Returns:
        0; 1: slowed, for the speed of a joint; 2: the trunk was braked, since a foot was out of
        reach or the support margin too small; 3: nothing could move.
    """
    state, trial = states[0], states[1]
    reference, next_reference = references[0], references[1]
    clock = state.clock
    change_gait(state, model, reference, next_reference)
    state.clock.region_leg = (state.clock.region_leg + 1) % state.leg_count
    update_region(state, model, state.clock.region_leg)
    slow, outcome, failed = min(1.0, clock.time_scale + RECOVERY * dt), 0, 0
    most = model.joint_speed * dt
    for _ in range(12):
        states[1] = states[0]
        held = failed >= 3
        good = advance(trial, model, reference, slow * dt, held)
        topples = (
            trial.clock.support_margin < LEAST * SUPPORT_MARGIN
            and trial.clock.support_margin < clock.support_margin
        )
        if good and topples and not held:
            good = False
        if not good:
            if held:
                break
            failed += 1
            brake(state, 0.5 if failed < 3 else 0.0)
            outcome = 2
            continue
        ratio = 0.0
        for leg in range(state.leg_count):
            for k in range(3):
                ratio = max(ratio, abs(trial.q[leg, k] - state.q[leg, k]) / most)
        if ratio <= 1.0:
            trial.clock.time = clock.time + dt
            trial.clock.time_scale = slow
            states[0] = states[1]
            return outcome
        slow *= 0.99 / ratio
        outcome = max(outcome, 1)
        if slow < STUCK:
            break
    # No trial was feasible: stay. Feet in the air continue from rest, straight.
    brake(state, 0.0)
    arm = np.empty(3)
    for leg in range(state.leg_count):
        if state.leg_phase[leg] != LegPhase.STANCE and state.leg_phase[leg] != LegPhase.HELD:
            # The joints' position is within reach; that of the swing curve may not be.
            foot_at_joints(state, model, leg, arm)
        swings = state.leg_phase[leg] == LegPhase.SWING
        # A foot that draws back goes straight before it is stopped.
        stopped = (
            swings
            and state.swing_height[leg] == 0.0
            and state.manoeuvre[leg] != Manoeuvre.DRAW_BACK
        )
        if state.leg_phase[leg] in (LegPhase.STANCE, LegPhase.PROBING, LegPhase.SETTLING) or (
            stopped and reference.contact[leg] == 1
        ):
            # It reaches neither farther down nor straight on: it stands.
            stand(state, leg)
            end_search(state, leg, reference.contact[leg] == 1)
        elif stopped:
            # It probes for ground here.
            land_here(state, model, reference, leg)
        elif swings:
            state.swing_elapsed[leg], state.swing_height[leg] = 0.0, 0.0
            stop_manoeuvre(state, leg)
            for i in range(3):
                state.line_position[leg, i] = state.foot[leg, i]
                state.line_velocity[leg, i] = state.line_acceleration[leg, i] = 0.0
                state.foot_velocity[leg, i] = state.foot_acceleration[leg, i] = 0.0
    clock.time += dt
    clock.time_scale = slow
    state.qd[:] = 0.0
    state.qdd[:] = 0.0
    return 3


@compiled
def update(memories: np.ndarray, dt: float, results: np.ndarray) -> None:
    """Advance engines by an update period: estimate the ground, walk, compute feed-forward.

    Args:
        memories: Records of `Memory`, changed, shape (N,).
        dt: Update period [s].
        results: Written: result of `advance_engine`, and `EstimatorEvent` bits, shape (N, 2).
    """
    for i in range(len(memories)):
        memory = memories[i]
        state, reference = memory.states[0], memory.references[0]
        results[i, 1] = 0
        if memory.estimates_ground != 0:
            results[i, 1] = estimate_ground(
                state,
                reference,
                memory.estimator,
                memory.estimator_parameters,
                memory.measurements,
            )
        results[i, 0] = advance_engine(memory.states, memory.references, memory.model, dt)
        if memory.computes_torque != 0:
            compute_feed_forward(
                state, reference, memory.feed_forward, memory.feed_forward_parameters
            )
