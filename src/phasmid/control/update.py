"""The compiled update of the locomotion engine.

`LocomotionEngine` calls `update` on the record of its `Memory`.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, inlined
from phasmid.control.body_motion import (
    POSE_BANDWIDTH,
    SWAY_BANDWIDTH,
    VELOCITY_BANDWIDTH,
    approach,
    com_in_odom,
    follow,
    leg_moment,
    set_body_motion,
    speed_of,
    sway_wave,
)
from phasmid.control.estimation.estimator import estimate_ground
from phasmid.control.feed_forward.feed_forward import compute_feed_forward
from phasmid.control.footholds import end_search, is_returning, is_searching
from phasmid.control.gait_scheduler import advance_phase, best_phase
from phasmid.control.leg_phases import land_here, land_swing_legs, move_feet, stand
from phasmid.control.reach import HARD, bound_region, joints_at, to_hip_frame
from phasmid.control.reference_governor import is_recoverable, is_settled
from phasmid.control.swing import foot_at_joints, halt_foot, hold_leg, soften_joint_limits
from phasmid.control.terrain_map import TerrainSource
from phasmid.control.terrain_mapping import align_map, update_map
from phasmid.control.types import (
    SUPPORT_MARGIN,
    Contact,
    LegPhase,
    Manoeuvre,
    Model,
    Reference,
    State,
)
from phasmid.control.vectors import cross, integrate_twist, rotate_back
from phasmid.control.velocity_limits import region_speed_share, support_speed_share
from phasmid.gait.support_kernels import line_margin
from phasmid.kinematics.leg_kernels import joint_motion
from phasmid.kinematics.vector_kernels import turned

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


@compiled
def return_velocity(state: State) -> np.ndarray:
    """Return the velocity vx, vy, wz of the body while feet return to their last footholds."""
    back = np.zeros(3)
    for leg in range(state.leg_count):
        if is_returning(state, leg):
            back += state.last_foothold[leg] - state.missed_foothold[leg]
    speed = RETURN_SPEED / max(math.hypot(back[0], back[1]), 1e-6)
    vx, vy = turned(-state.path[2], speed * back[0], speed * back[1])
    return np.array((vx, vy, 0.0))


@compiled
def advance_body(state: State, model: Model, reference: Reference, h: float) -> None:
    """Advance velocity, path, pose and ground plane towards the reference."""
    clock, speed, pose = state.clock, state.velocity_filter, state.pose_filter
    probing, looking, returns = False, False, False
    for leg in range(state.leg_count):
        probing = probing or state.leg_phase[leg] == LegPhase.PROBING
        looking = looking or is_searching(state, leg)
        returns = returns or is_returning(state, leg)
    velocity = return_velocity(state) if returns else reference.velocity.copy()
    share = region_speed_share(state, model, reference, velocity, clock.phase)
    share = min(share, support_speed_share(state, reference, velocity))
    if reference.gait_pending:
        share = min(share, clock.velocity_share * math.exp(-4 * h))
    if not returns and (looking or (clock.lift_wait > 0.0 and not probing)):
        # While a lift waits only for a probing foot, the body goes on as far as its feet allow.
        share = 0.0
    if reference.sway > 0.0:
        # A body that does not sway yet would move beyond its feet before one may lift.
        share *= clock.sway_share
    clock.velocity_share = 0.0 if returns else share
    target, next_pose = share * velocity, reference.pose + reference.pose_correction
    draft, goal = speed[0].copy(), pose[0].copy()
    approach(draft, target, model.radius, model.acceleration * h)
    approach(goal[:3], next_pose[:3], 1.0, POSE_SPEED * h)
    approach(goal[3:], next_pose[3:], 1.0, POSE_TURN_SPEED * h)
    changes = not (is_settled(pose, next_pose, 1e-4) and is_settled(speed, target, 1e-3))
    if changes and not is_recoverable(state, model, reference, draft, goal):
        # The pose waits; if that is not enough, the walk does.
        goal[:] = pose[0]
        if not is_recoverable(state, model, reference, draft, goal):
            clock.velocity_share = 0.0
            draft[:] = speed[0]
            approach(draft, np.zeros(3), model.radius, model.acceleration * h)
    before = speed[2].copy()
    speed[0] = draft
    follow(speed, VELOCITY_BANDWIDTH, h)
    mean = (before + speed[2]) / 2
    state.path[0], state.path[1], state.path[2] = integrate_twist(state.path, mean, h)
    pose[0] = goal
    follow(pose, POSE_BANDWIDTH, h)
    n, ground = reference.ground_normal, state.ground_filter
    ground[0, 0], ground[0, 1], ground[0, 2] = reference.ground_height, -n[0] / n[2], -n[1] / n[2]
    follow(ground, POSE_BANDWIDTH, h)


@compiled
def advance_sway(state: State, model: Model, reference: Reference, h: float) -> None:
    """Let the body sway with the gait's clock, and lean where that is commanded."""
    clock, sway = state.clock, state.sway_filter
    # What the filter's three lags delay and weaken is made up for, at the gait's own rate.
    x = 2 * math.pi / (reference.period * SWAY_BANDWIDTH)
    lead, gain = 3 * math.atan(x) / (2 * math.pi), (1 + x * x) ** 1.5
    wave = sway_wave(model, reference, clock.phase + lead)[0]
    sway[0] = clock.sway_share * gain * wave + clock.lean
    follow(sway, SWAY_BANDWIDTH, h)


@compiled
def solve_leg_ik(state: State, model: Model, h: float) -> int:
    """Write joint angles, speeds and accelerations for body and feet.

    Returns:
        The first leg that does not reach its foot, -1 for none.
    """
    R, w, wd = state.R_odom_body, state.angular_velocity, state.angular_acceleration
    moment = model.body_moment.copy()
    for leg in range(state.leg_count):
        q = state.q[leg]
        if state.leg_phase[leg] == LegPhase.HELD:
            hold_leg(state, model, leg, h)
            moment += leg_moment(model, leg, q)
            continue
        foot = state.foot[leg]
        x, y, z = to_hip_frame(model, leg, R, state.body_position, foot[0], foot[1], foot[2])
        # In the turning body: v' = v - w x p, a' = a - w' x p - w x (w x p) - 2 w x v'.
        p = foot - state.body_position
        v = state.foot_velocity[leg] - state.body_velocity - cross(w, p)
        a = state.foot_acceleration[leg] - state.body_acceleration
        a = a - cross(wd, p) - cross(w, cross(w, p)) - 2 * cross(w, v)
        # A probing foot may come from a swing that was softened at the joint limits.
        swings = state.leg_phase[leg] in (LegPhase.SWING, LegPhase.PROBING)
        q[0], q[1], q[2], margin = joints_at(model, leg, x, y, z)
        if margin < HARD and (margin == -math.inf or not (swings and q[2] < STRAIGHT)):
            return leg
        v_hip = rotate_back(model.R_body_hip[leg], rotate_back(R, v))
        a_hip = rotate_back(model.R_body_hip[leg], rotate_back(R, a))
        lengths, qd, qdd = model.lengths[leg], state.qd[leg], state.qdd[leg]
        joint_motion(lengths, lengths[3], q, v_hip, a_hip, qd, qdd)
        if swings and not soften_joint_limits(state, model, leg):
            return leg
        moment += leg_moment(model, leg, q)
    state.com[:] = moment / model.mass
    return -1


@compiled
def measure_support(state: State) -> float:
    """Return the present support margin of the whole robot [m]."""
    x, y = com_in_odom(state)
    return line_margin(
        state.foot, state.leg_phase[: state.leg_count] == LegPhase.STANCE.value, x, y
    )


@compiled
def stop_walking(state: State, model: Model, reference: Reference) -> None:
    """Let all feet land, and the body stay at its present pose and sway."""
    land_swing_legs(state, model, reference)
    reference.pose[:] = state.pose_filter[0] - reference.pose_correction
    state.clock.lean[:] = state.sway_filter[1]


@compiled
def change_gait(
    state: State, model: Model, reference: Reference, next_reference: Reference
) -> None:
    """Change to the pending gait as soon as all feet stay in their foothold regions in it.

    A robot whose remaining legs cannot walk stops at once.
    """
    if not reference.gait_pending:
        return
    phase, share = best_phase(state, model, next_reference)
    speed = speed_of(state.velocity_filter[2], model.radius)
    commanded = speed_of(next_reference.velocity, model.radius)
    ready = state.clock.gait_running == 0 or share >= 1.0 - 1e-9 or speed < 1e-4
    ready = ready or next_reference.walks == 0
    if ready or (share > 0 and speed <= share * commanded):
        reference.duty_factor, reference.period = next_reference.duty_factor, next_reference.period
        reference.sway, reference.gait_pending = next_reference.sway, 0
        reference.lift_phase[:] = next_reference.lift_phase
        reference.used[:] = next_reference.used
        if reference.walks == 1 and next_reference.walks == 0:
            stop_walking(state, model, reference)
        reference.walks = next_reference.walks
        if share >= 0:
            state.clock.phase = phase


@inlined
def advance(state: State, model: Model, reference: Reference, h: float, held: bool) -> int:
    """Advance the whole motion by a time step.

    Args:
        state: State of the engine, changed.
        model: The robot.
        reference: Reference of the motion.
        h: Time step [s].
        held: Whether the trunk stays at rest.

    Returns:
        The first leg that does not reach its foot, -1 for none.
    """
    if not held:
        advance_body(state, model, reference, h)
    # Feet land before others lift: in many gaits they do so at the same instant.
    move_feet(state, model, reference, h)
    advance_phase(state, model, reference, h)
    if not held:
        advance_sway(state, model, reference, h)
    set_body_motion(state, model)
    short = solve_leg_ik(state, model, h)
    if short < 0:
        state.clock.support_margin = measure_support(state)
    return short


@compiled
def brake(state: State, share: float) -> None:
    """Scale the speed of the trunk's motion at once."""
    state.velocity_filter *= share
    pose, sway = state.pose_filter, state.sway_filter
    for k in range(3):
        pose[k] = pose[3] + share * (pose[k] - pose[3])
        sway[k] = sway[3] + share * (sway[k] - sway[3])


@compiled
def update_region(state: State, model: Model, leg: int) -> None:
    """Compute a foothold region anew if body, ground or foot have changed by `STALE`."""
    g, foot, now = state.ground_filter[3], state.touchdown[leg], np.empty(9)
    now[:6] = state.pose_filter[3]
    now[6], now[7] = turned(-state.path[2], g[1], g[2])
    now[8] = foot[2] - g[0] - g[1] * foot[0] - g[2] * foot[1]
    # Angles count by the distance that they move a foot.
    change = np.abs(now - state.region_pose[leg])
    change[3:8] *= model.radius
    if change.max() >= STALE or state.region[leg, 0, 0] == 0.0:
        state.region_pose[leg] = now
        bound_region(model, leg, now[:6], now[6:], state.region[leg])


@compiled
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
    if solve_leg_ik(state, model, 0.0) >= 0:
        return False
    state.clock.support_margin = measure_support(state)
    return True


@compiled
def land(memories: np.ndarray) -> None:
    """Let all swinging feet land at once, without a jump of their motion.

    Args:
        memories: Record of `Memory`, changed, shape (1,).
    """
    memory = memories[0]
    land_swing_legs(memory.states[0], memory.model, memory.references[0])


@compiled
def stop_leg(state: State, model: Model, reference: Reference, leg: int) -> None:
    """Stop a leg at once. A foot in the air continues from rest, without a lift."""
    phase, touches = state.leg_phase[leg], reference.contact[leg] == Contact.GROUND
    if phase not in (LegPhase.STANCE, LegPhase.HELD):
        # The joints' position is within reach; that of the swing curve may not be.
        foot_at_joints(state, model, leg)
    swings = phase == LegPhase.SWING
    # A foot that draws back goes straight before it is stopped.
    straight = state.swing_height[leg] == 0.0
    stopped = swings and straight and state.manoeuvre[leg] != Manoeuvre.DRAW_BACK
    if phase != LegPhase.HELD and (not swings or (stopped and touches)):
        # It reaches neither farther down nor straight on: it stands.
        stand(state, leg)
        end_search(state, leg, touches)
    elif stopped:
        # It probes for ground here.
        land_here(state, model, reference, leg)
    elif swings:
        # Its lateral displacement stays: farther out the leg is not at its limit.
        state.swing_elapsed[leg], state.swing_height[leg] = 0.0, 0.0
        stop_manoeuvre(state, leg)
        halt_foot(state, leg)


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
        0; 1: slowed, for the speed of a joint; 2: the trunk was braked, and legs out of reach
        stopped, or the support margin is too small; 3: nothing could move.
    """
    state, trial = states[0], states[1]
    reference, next_reference = references[0], references[1]
    clock = state.clock
    change_gait(state, model, reference, next_reference)
    clock.region_leg = (clock.region_leg + 1) % state.leg_count
    update_region(state, model, clock.region_leg)
    slow, outcome, failed = min(1.0, clock.time_scale + RECOVERY * dt), 0, 0
    legs = state.leg_count
    most = model.joint_speed[:legs] * dt
    for _ in range(12):
        states[1] = states[0]
        held = failed >= 3
        short = advance(trial, model, reference, slow * dt, held)
        good = short < 0
        if good and not held:
            good = trial.clock.support_margin >= min(LEAST * SUPPORT_MARGIN, clock.support_margin)
        if not good:
            if held:
                # The other legs go on.
                stop_leg(state, model, reference, short)
                continue
            failed += 1
            brake(state, 0.5 if failed < 3 else 0.0)
            outcome = 2
            continue
        ratio = (np.abs(trial.q[:legs] - state.q[:legs]) / most).max()
        if ratio <= 1.0:
            trial.clock.time = clock.time + dt
            trial.clock.time_scale = slow
            states[0] = states[1]
            return outcome
        slow *= 0.99 / ratio
        outcome = max(outcome, 1)
        if slow < STUCK:
            break
    stay(state, model, reference)
    clock.time += dt
    clock.time_scale = slow
    return 3


@compiled
def stay(state: State, model: Model, reference: Reference) -> None:
    """Stop everything at once."""
    brake(state, 0.0)
    state.qd[:] = 0.0
    state.qdd[:] = 0.0
    for leg in range(state.leg_count):
        stop_leg(state, model, reference, leg)


@compiled
def update(memories: np.ndarray, dt: float) -> tuple[int, int]:
    """Advance the engine by an update period: estimate the ground, walk, compute feed-forward.

    Args:
        memories: Record of `Memory`, changed, shape (1,).
        dt: Update period [s].

    Returns:
        Result of `advance_engine`, and `EstimatorEvent` bits.
    """
    memory, events = memories[0], 0
    state, reference = memory.states[0], memory.references[0]
    source = memory.maps_terrain
    if memory.estimates_ground != 0:
        R = state.R_odom_body.copy()
        events = estimate_ground(
            state,
            reference,
            memory.estimator,
            memory.estimator_parameters,
            memory.measurements,
            memory.model,
        )
        if source != TerrainSource.NONE:
            align_map(R, state, memory.terrain_map, memory.body_poses, source)
    result = advance_engine(memory.states, memory.references, memory.model, dt)
    if source != TerrainSource.NONE:
        update_map(state, reference, memory.terrain_map, memory.body_poses, source)
    if memory.computes_torque != 0:
        compute_feed_forward(state, reference, memory.feed_forward, memory.feed_forward_parameters)
    return result, events
