"""One update of the engine: all its parts, and the governor that slows them down together."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, inlined, internal
from phasmid.control.bounds import HARD
from phasmid.control.clock import best_phase, run_clock
from phasmid.control.elsewhere import end_search, goes_back, is_looking
from phasmid.control.feet import land_here, move_feet
from phasmid.control.governor import is_settled, may_go_on
from phasmid.control.limbs import margin_of, moment_of, speeds_of, to_hip
from phasmid.control.reach import (
    bound_region,
    room_of,
    speed_share,
    support_share,
    wave,
)
from phasmid.control.state import (
    HELD,
    PROBING,
    SETTLING,
    STANCE,
    STILL,
    SWING,
    Model,
    Order,
    State,
    Tuning,
)
from phasmid.control.swing import (
    foot_at_joints,
    hold_leg,
    plant,
    yield_to_limits,
)
from phasmid.control.trunk import approach, follow, place_trunk, ride

OFFSET_SPEED = 0.1
"""Largest speed at which offsets of feet are followed [m/s]."""

LEAST = 0.5
"""Share of the margin of a lift below which the trunk may not take the centre of mass."""

STRAIGHT = -0.2
"""A knee that is bent less than this turns too fast for the foot's speed [rad]."""

STALE = 1e-3
"""Where a foot may stand is looked at anew once body, ground or foot are off by this [m]."""

RETURN_SPEED = 0.06
"""Of the body that comes back from where a foot has found no ground [m/s]."""

STUCK = 1e-3
"""A slow-down to less than this does not end by itself."""

RECOVERY = 2.0
"""How fast the slow-down ends, per second."""


@internal
def way_back(state: State, velocity: np.ndarray) -> None:
    """Write the velocity at which the body comes back with feet that go back to where they stood.

    Args:
        state: Where the engine is.
        velocity: Written: ahead, left [m/s] and turn [rad/s], shape (3,).
    """
    x, y = 0.0, 0.0
    for leg in range(state.leg_count):
        if goes_back(state, leg):
            x += state.sought[2, leg, 0] - state.sought[1, leg, 0]
            y += state.sought[2, leg, 1] - state.sought[1, leg, 1]
    size = max(math.sqrt(x * x + y * y), 1e-6)
    c, s = math.cos(state.path[2]), math.sin(state.path[2])
    velocity[0] = RETURN_SPEED * (c * x + s * y) / size
    velocity[1] = RETURN_SPEED * (c * y - s * x) / size
    velocity[2] = 0.0


@internal
def move_trunk(state: State, model: Model, order: Order, tuning: Tuning, h: float) -> None:
    """Let the path's velocity, the path, the pose and the sway follow what is asked."""
    clock, speed, pose = state.clock, state.speed, state.pose
    probing, looking, returns = False, False, False
    for leg in range(state.leg_count):
        probing = probing or state.leg[leg] == PROBING
        looking = looking or is_looking(state, leg)
        returns = returns or goes_back(state, leg)
    velocity = order.velocity.copy()
    if returns:
        way_back(state, velocity)
    share = speed_share(state, model, order.used, velocity, order.offsets, order.gait, clock.phase)
    share = min(share, support_share(state, tuning, order.used, velocity))
    if order.gait[3] > 0:
        share = min(share, clock.velocity_share * math.exp(-4 * h))
    if not returns and (looking or (clock.lift_wait > 0.0 and not probing)):
        # A lift that waits for the ground alone lets the body go on, as far as its feet do.
        share = 0.0
    if order.gait[2] > 0.0:
        # A body that does not sway yet would leave its feet behind before one may lift.
        share *= clock.sway_share
    clock.velocity_share = 0.0 if returns else share
    target, old = np.empty(3), np.empty(3)
    for i in range(3):
        target[i] = share * velocity[i]
    wanted = np.empty(6)
    for i in range(6):
        wanted[i] = order.pose[i] + order.correction[i]
    draft, goal = speed[0].copy(), pose[0].copy()
    approach(draft, target, 0, model.radius, tuning.acceleration * h)
    approach(goal, wanted, 0, 1.0, tuning.pose_speed * h)
    approach(goal, wanted, 3, 1.0, tuning.pose_turn_speed * h)
    changes = not (is_settled(pose, wanted, 1e-4) and is_settled(speed, target, 1e-3))
    if changes and not may_go_on(state, model, order, tuning, draft, goal):
        # The pose waits; if that is not enough, the walk does.
        goal[:] = pose[0]
        if not may_go_on(state, model, order, tuning, draft, goal):
            clock.velocity_share = 0.0
            draft[:] = speed[0]
            approach(draft, np.zeros(3), 0, model.radius, tuning.acceleration * h)
    for i in range(3):
        old[i] = speed[2, i]
        speed[0, i] = draft[i]
    follow(speed, tuning.velocity_bandwidth, h)
    for i in range(3):
        old[i] = (old[i] + speed[2, i]) / 2
    ride(state.path, old, h, state.path)
    for i in range(6):
        pose[0, i] = goal[i]
    follow(pose, tuning.pose_bandwidth, h)
    n, ground = order.plane, state.ground
    ground[0, 0], ground[0, 1], ground[0, 2] = n[3], -n[0] / n[2], -n[1] / n[2]
    follow(ground, tuning.pose_bandwidth, h)
    for leg in range(state.leg_count):
        approach(state.offset[leg], order.foot_offset[leg], 0, 1.0, OFFSET_SPEED * h)


@internal
def move_aside(state: State, model: Model, order: Order, tuning: Tuning, h: float) -> None:
    """Let the body sway with the gait's clock, and lean where that has been asked."""
    clock, sway, aside = state.clock, state.sway, np.empty((3, 2))
    # What the filter's three lags delay and weaken is made up for, at the gait's own rate.
    x = 2 * math.pi / (order.gait[1] * tuning.sway_bandwidth)
    lead, gain = 3 * math.atan(x) / (2 * math.pi), (1 + x * x) ** 1.5
    wave(model, order.used, order.offsets, order.gait, clock.phase + lead, aside)
    for i in range(2):
        sway[0, i] = clock.sway_share * gain * aside[0, i] + clock.lean[i]
    follow(sway, tuning.sway_bandwidth, h)


@internal
def bend_legs(state: State, model: Model, tuning: Tuning, h: float) -> bool:
    """Write the joint angles, speeds and accelerations that put the feet where they are.

    Returns:
        Whether all feet can be reached.
    """
    R, trunk = state.body, state.trunk
    p, v, a = np.empty(3), np.empty(3), np.empty(3)
    rp, rv, ra, hip = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    w, wd = trunk[2], trunk[4]
    for i in range(3):
        state.com[i] = model.body_moment[i]
    for leg in range(state.leg_count):
        if state.leg[leg] == HELD:
            hold_leg(state, model, leg, h)
            moment_of(model, leg, state.q[0, leg], state.com)
            continue
        for i in range(3):
            p[i] = state.foot[leg, i] + state.offset[leg, i] - trunk[0, i]
            v[i] = state.motion[0, leg, i] - trunk[1, i]
            a[i] = state.motion[1, leg, i] - trunk[3, i]
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
        # One that looks for the ground may come out of a swing that has yielded.
        swings = state.leg[leg] in (SWING, PROBING)
        room = room_of(model, tuning, leg, hip, state.q[0, leg])
        bent = state.q[0, leg, 2] < STRAIGHT
        if room < HARD and (room == -math.inf or not (swings and bent)):
            return False
        to_hip(R, rv, rp)
        to_hip(R_hip, rp, v)
        to_hip(R, ra, rp)
        to_hip(R_hip, rp, a)
        speeds_of(model.lengths[leg], state.q[0, leg], v, a, state.q[1, leg], state.q[2, leg])
        if swings and not yield_to_limits(state, model, tuning, leg):
            return False
        moment_of(model, leg, state.q[0, leg], state.com)
    for i in range(3):
        state.com[i] /= model.mass
    return True


@internal
def measure_support(state: State) -> float:
    """Support margin of the whole robot now [m]."""
    R, com, trunk = state.body, state.com, state.trunk[0]
    standing = np.zeros(state.leg_count, dtype=np.int64)
    for leg in range(state.leg_count):
        standing[leg] = 1 if state.leg[leg] == STANCE else 0
    x = trunk[0] + R[0, 0] * com[0] + R[0, 1] * com[1] + R[0, 2] * com[2]
    y = trunk[1] + R[1, 0] * com[0] + R[1, 1] * com[1] + R[1, 2] * com[2]
    return margin_of(state.foot, standing, x, y)


@internal
def change_gait(state: State, model: Model, order: Order, wanted: Order) -> None:
    """Take the gait that is wanted as soon as no foot would leave its region in it."""
    if order.gait[3] == 0.0:
        return
    found = np.empty(2)
    best_phase(state, model, wanted.used, wanted.velocity, wanted.offsets, wanted.gait, found)
    speed, asked = 0.0, 0.0
    for i in range(3):
        scale = model.radius if i == 2 else 1.0
        speed += (scale * state.speed[2, i]) ** 2
        asked += (scale * wanted.velocity[i]) ** 2
    ready = state.clock.mode == STILL or found[1] >= 1.0 - 1e-9 or speed < 1e-8
    if not ready and not found[1] > 0:
        return
    if ready or math.sqrt(speed) <= found[1] * math.sqrt(asked):
        order.gait[:] = wanted.gait
        order.offsets[:] = wanted.offsets
        order.used[:] = wanted.used
        order.gait[3] = 0.0
        if found[1] >= 0:
            state.clock.phase = found[0]


@inlined
def advance(state: State, model: Model, order: Order, tuning: Tuning, h: float, held: bool) -> bool:
    """Let everything go on by a step of time; whether all feet can be reached there.

    Args:
        state: Where the engine is, changed.
        model: The robot.
        order: What is to be done.
        tuning: The margins.
        h: Step of time [s].
        held: Whether the trunk stays where it is.
    """
    if not held:
        move_trunk(state, model, order, tuning, h)
    # Feet land before others lift: in many gaits they do so at the same instant.
    move_feet(state, model, order, tuning, h)
    run_clock(state, model, order, tuning, h)
    if not held:
        move_aside(state, model, order, tuning, h)
    place_trunk(state, model, tuning)
    if not bend_legs(state, model, tuning, h):
        return False
    state.clock.support_margin = measure_support(state)
    return True


@internal
def draw_near(stages: np.ndarray, share: float) -> None:
    """Leave a share of what a filter's stages differ from its last one."""
    last = len(stages) - 1
    for i in range(stages.shape[1]):
        for k in range(last):
            stages[k, i] = stages[last, i] + share * (stages[k, i] - stages[last, i])


@internal
def brake(state: State, share: float) -> None:
    """Take from the trunk's motion all but a share of its speed, at once."""
    for i in range(3):
        for k in range(3):
            state.speed[k, i] *= share
    draw_near(state.pose, share)
    draw_near(state.sway, share)


@internal
def refresh_region(state: State, model: Model, leg: int) -> None:
    """Bound anew where one leg's foot may stand, if body, ground or foot are off by `STALE`."""
    g, posed, slope = state.ground[3], state.posed[leg], np.empty(3)
    c, s = math.cos(state.path[2]), math.sin(state.path[2])
    slope[0], slope[1] = c * g[1] + s * g[2], c * g[2] - s * g[1]
    foot = state.landing[leg]
    slope[2] = foot[2] - g[0] - g[1] * foot[0] - g[2] * foot[1]
    # By how much foot and body are about elsewhere, turns counted by how far they move a foot.
    away = abs(slope[2] - posed[8])
    for i in range(3):
        away = max(away, abs(state.pose[3, i] - posed[i]))
        away = max(away, model.radius * abs(state.pose[3, 3 + i] - posed[3 + i]))
    for i in range(2):
        away = max(away, model.radius * abs(slope[i] - posed[6 + i]))
    if away < STALE and state.region[leg, 0, 0] != 0.0:
        return
    for i in range(6):
        posed[i] = state.pose[3, i]
    posed[6], posed[7], posed[8] = slope[0], slope[1], slope[2]
    bound_region(model, leg, state.pose[3], slope, state.region[leg])


@inlined
def update(
    states: np.ndarray, model: Model, order: Order, wanted: Order, tuning: Tuning, dt: float
) -> int:
    """One update of the engine.

    Args:
        states: Where it is, changed, and a state to try in, shape (2,).
        model: The robot.
        order: What is to be done.
        wanted: The same with the gait that is wanted, where that is to change.
        tuning: The margins.
        dt: Time from the last update [s].

    Returns:
        0; 1: slowed for a joint's speed; 2: the trunk was braked or stopped, since a leg could not
        follow or the feet would not have held it; 3: nothing could be moved at all.
    """
    state, trial = states[0], states[1]
    clock = state.clock
    change_gait(state, model, order, wanted)
    state.clock.region_leg = (state.clock.region_leg + 1) % state.leg_count
    refresh_region(state, model, state.clock.region_leg)
    slow, said, failed = min(1.0, clock.time_scale + RECOVERY * dt), 0, 0
    most = model.joint_speed * dt
    for _ in range(12):
        states[1] = states[0]
        held = failed >= 3
        good = advance(trial, model, order, tuning, slow * dt, held)
        topples = (
            trial.clock.support_margin < LEAST * tuning.support_margin
            and trial.clock.support_margin < clock.support_margin
        )
        if good and topples and not held:
            good = False
        if not good:
            if held:
                break
            failed += 1
            brake(state, 0.5 if failed < 3 else 0.0)
            said = 2
            continue
        ratio = 0.0
        for leg in range(state.leg_count):
            for k in range(3):
                ratio = max(ratio, abs(trial.q[0, leg, k] - state.q[0, leg, k]) / most)
        if ratio <= 1.0:
            trial.clock.time = clock.time + dt
            trial.clock.time_scale = slow
            trial.clock.joint_speed_ratio = ratio
            states[0] = states[1]
            return said
        slow *= 0.99 / ratio
        said = max(said, 1)
        if slow < STUCK:
            break
    # Nothing of what was tried can be done: stay. Feet in the air go on from rest, straight.
    brake(state, 0.0)
    arm = np.empty(3)
    for leg in range(state.leg_count):
        if state.leg[leg] != STANCE and state.leg[leg] != HELD:
            # Where the joints are, and not where the curve is, is surely within reach.
            foot_at_joints(state, model, leg, arm)
        swings = state.leg[leg] == SWING
        # One that draws back goes straight before it is stopped.
        stopped = swings and state.swing[leg, 2] == 0.0 and state.retreat[leg] != 1.0
        if state.leg[leg] in (STANCE, PROBING, SETTLING) or (stopped and order.touch[leg] == 1):
            # Farther down it may not reach, and straight on it does not go either: it stands.
            plant(state, leg)
            state.leg[leg] = STANCE
            state.swing[leg] = 0.0
            end_search(state, leg, order.touch[leg] == 1)
        elif stopped:
            # It looks for the ground where it is.
            land_here(state, model, order, tuning, leg)
        elif swings:
            state.swing[leg, 0], state.swing[leg, 2] = 0.0, 0.0
            state.retreat[leg] *= 2.0
            for i in range(3):
                state.line[0, leg, i] = state.foot[leg, i]
                state.line[1, leg, i] = state.line[2, leg, i] = 0.0
                state.motion[0, leg, i] = state.motion[1, leg, i] = 0.0
    clock.time += dt
    clock.time_scale = slow
    state.q[1] = 0.0
    state.q[2] = 0.0
    return 3


@compiled
def tick(
    states: np.ndarray, orders: np.ndarray, models: np.ndarray, tunings: np.ndarray, dt: float
) -> int:
    """One update of the engine in a `Memory`; see `update`.

    With no time from the last update everything is only put where its numbers say, from the feet
    and the body to the joints: 1 where a foot cannot be reached there, 0 elsewhere.
    """
    state, model, tuning = states[0], models[0], tunings[0]
    if dt == 0.0:
        for leg in range(state.leg_count):
            refresh_region(state, model, leg)
        place_trunk(state, model, tuning)
        if not bend_legs(state, model, tuning, 0.0):
            return 1
        state.clock.support_margin = measure_support(state)
        return 0
    return update(states, model, orders[0], orders[1], tuning, dt)
