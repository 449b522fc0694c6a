"""Reference governor: takes a step of velocity and pose only if the robot can come to rest from it.

With the pose at its reference then, every foot must be within reach, and the centre of mass over
the stance feet. Since that stays possible from update to update, nothing has to stop at once.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import inlined, internal
from phasmid.control.body_motion import (
    POSE_BANDWIDTH,
    VELOCITY_BANDWIDTH,
    approach,
    follow,
    integrate_twist,
    place_body,
    sway_wave,
)
from phasmid.control.reach import AT_ENOUGH, ENOUGH, is_within, joint_limit_margin, to_hip_frame
from phasmid.control.types import SUPPORT_MARGIN, LegPhase, Model, Reference, State
from phasmid.gait.support_kernels import edge_margin, support_edges

LOOKS, SPAN = 5, 0.07
"""Number of samples of the motion to rest, and time between them [s]."""

HOLDS = 0.75
"""Share of the support margin that is kept on it."""

FOLLOWS = 0.05
"""Time after its lift-off for which a foot counts as standing [s]."""


@internal
def is_settled(stages: np.ndarray, goal: np.ndarray, close: float) -> bool:
    """Return whether all stages of a filter are close to a goal."""
    return bool(np.abs(stages - goal).max() < close)


@inlined
def leg_margin(
    model: Model,
    leg: int,
    R: np.ndarray,
    body: np.ndarray,
    x: float,
    y: float,
    z: float,
) -> float:
    """Return the margin of a leg with its foot at a point of odom, `ENOUGH` at most."""
    x, y, z = to_hip_frame(model, leg, R, body, x, y, z)
    if is_within(model, AT_ENOUGH, leg, x, y, z):
        return ENOUGH
    p, q = np.array((x, y, z)), np.empty(3)
    return min(joint_limit_margin(model, leg, p, q), ENOUGH)


@internal
def remaining_stance(state: State, reference: Reference, leg: int) -> float:
    """Return the time until a stance foot lifts [s]; infinite at rest and while a lift waits."""
    clock = state.clock
    if clock.gait_running == 0 or clock.lift_wait > 0.0:
        return math.inf
    return float((1.0 - (clock.phase - reference.lift_phase[leg]) % 1.0) * reference.period)


@internal
def is_recoverable(
    state: State,
    model: Model,
    reference: Reference,
    velocity: np.ndarray,
    goal: np.ndarray,
) -> bool:
    """Return whether the robot can come to rest from new references of velocity and pose.

    It brakes from the velocity, and the pose goes to its reference. Where a leg or the support has
    less margin already, it must not lose any.
    """
    legs, clock, com = state.leg_count, state.clock, state.com
    speed, pose = state.velocity_filter.copy(), state.pose_filter.copy()
    path = state.path[0], state.path[1], state.path[2]
    rest, mean, R, body = np.zeros(3), np.empty(3), np.empty((3, 3)), np.empty(3)
    sway, least, stays = np.zeros((3, 2)), np.full(legs, ENOUGH), np.full(legs, math.inf)
    stance, left = np.zeros(legs, dtype=np.int64), 0.0
    for leg in range(legs):
        if state.leg_phase[leg] == LegPhase.STANCE and reference.used[leg]:
            foot, stance[leg] = state.foot[leg], 1
            R_now, p_now = state.R_odom_body, state.body_position
            least[leg] = leg_margin(model, leg, R_now, p_now, foot[0], foot[1], foot[2])
            stays[leg] = remaining_stance(state, reference, leg)
        elif state.leg_phase[leg] == LegPhase.SWING:
            # From then on it stands where it lands.
            stays[leg] = state.swing_duration[leg] - state.swing_elapsed[leg]
            left = max(left, stays[leg])
    speed[0], pose[0] = velocity, goal
    edges = np.empty((legs * legs, 5))
    count = support_edges(state.foot, stance, edges) if left > 0.0 else 0
    time, holds = 0.0, 0.0
    for look in range(LOOKS + 1):
        if look > 0:
            time += SPAN
            # Braking half before and half after is exact to second order.
            approach(speed[0], rest, 0, model.radius, model.acceleration * SPAN / 2)
            mean[:] = speed[2] / 2
            follow(speed, VELOCITY_BANDWIDTH, SPAN)
            mean += speed[2] / 2
            approach(speed[0], rest, 0, model.radius, model.acceleration * SPAN / 2)
            path = integrate_twist(path, mean, SPAN)
            follow(pose, POSE_BANDWIDTH, SPAN)
        sway_wave(model, reference, clock.phase + time / reference.period, sway)
        x, y = state.sway_filter[3, 0], state.sway_filter[3, 1]
        if look > 0:
            x = clock.sway_share * sway[0, 0] + clock.lean[0]
            y = clock.sway_share * sway[0, 1] + clock.lean[1]
        place_body(state, model, path, pose[0 if look == LOOKS else 3], x, y, R, body)
        for leg in range(legs):
            phase, foot = state.leg_phase[leg], state.touchdown[leg]
            if phase == LegPhase.HELD or (phase == LegPhase.SWING and time < stays[leg]):
                continue
            if phase == LegPhase.STANCE:
                if not stance[leg] or time > stays[leg] + FOLLOWS:
                    continue
                foot = state.foot[leg]
            margin = leg_margin(model, leg, R, body, foot[0], foot[1], foot[2])
            if phase != LegPhase.STANCE and phase != LegPhase.SWING and look == 0:
                least[leg] = margin
            if not margin >= least[leg] - 1e-9:
                return False
        if left > 0.0 and time <= left + SPAN:
            x = body[0] + R[0, 0] * com[0] + R[0, 1] * com[1] + R[0, 2] * com[2]
            y = body[1] + R[1, 0] * com[0] + R[1, 1] * com[1] + R[1, 2] * com[2]
            support = edge_margin(edges, count, x, y)
            if look == 0:
                holds = min(HOLDS * SUPPORT_MARGIN, support)
            if support < holds - 1e-9:
                return False
    return True
