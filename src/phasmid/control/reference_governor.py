"""Whether the body may go on so: what its feet would have to reach if it came to rest from there.

A step of the references of pose and velocity is taken only if the robot could then stop, the pose
where its reference is, with every foot within reach and the centre of mass over the feet that
stand. That way out stays open from update to update: nothing ever has to be stopped at once.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import inlined, internal
from phasmid.control.body_kernels import rotation
from phasmid.control.foothold_region import joint_limit_margin, sway_wave, to_hip_frame
from phasmid.control.reach_bounds import AT_ENOUGH, ENOUGH, is_within
from phasmid.control.trunk import approach, follow, integrate_twist
from phasmid.control.types import LegPhase, Model, Parameters, Reference, State
from phasmid.gait.support_kernels import edge_margin, support_edges

LOOKS, SPAN = 5, 0.07
"""How many times, and how far apart, the way to rest is looked at [s]."""

HOLDS = 0.75
"""Share of the support margin that is kept on it."""

FOLLOWS = 0.05
"""A foot that lifts is as good as standing for as long [s]."""


@internal
def is_settled(stages: np.ndarray, goal: np.ndarray, close: float) -> bool:
    """Whether all stages of a filter are where they go to."""
    away = 0.0
    for k in range(len(stages)):
        for i in range(len(goal)):
            away = max(away, abs(stages[k, i] - goal[i]))
    return away < close


@inlined
def leg_margin(
    model: Model,
    parameters: Parameters,
    leg: int,
    R: np.ndarray,
    trunk: np.ndarray,
    x: float,
    y: float,
    z: float,
) -> float:
    """Room that a leg has with its foot in odom and the body at a place, `ENOUGH` at the most."""
    x, y, z = to_hip_frame(model, leg, R, trunk, x, y, z)
    if is_within(model.lengths, model.reach, AT_ENOUGH, leg, x, y, z):
        return ENOUGH
    p, q = np.array((x, y, z)), np.empty(3)
    return min(joint_limit_margin(model, parameters, leg, p, q), ENOUGH)


@internal
def is_foothold(
    state: State, model: Model, leg: int, paths: np.ndarray, x: float, y: float, z: float
) -> bool:
    """Whether a foot can land at a place, with each of these paths, in the pose of now and to come.

    Args:
        state: Where the engine is.
        model: The robot.
        leg: The leg's index.
        paths: Where the path is then, shape (N, 3).
        x: The place in odom [m].
        y: The same.
        z: The same.
    """
    R, trunk, g = np.empty((3, 3)), np.empty(3), state.ground_filter[3]
    for path in paths:
        c, s = math.cos(path[2]), math.sin(path[2])
        for k in (0, 3):
            b = state.pose_filter[k]
            ahead, aside = b[0] + state.sway_filter[3, 0], b[1] + state.sway_filter[3, 1]
            rotation(b[3], b[4], b[5] + path[2], R)
            trunk[0], trunk[1] = path[0] + c * ahead - s * aside, path[1] + s * ahead + c * aside
            trunk[2] = g[0] + g[1] * path[0] + g[2] * path[1] + model.height + b[2]
            u, v, w = to_hip_frame(model, leg, R, trunk, x, y, z)
            if not is_within(model.lengths, model.reach, AT_ENOUGH, leg, u, v, w):
                return False
    return True


@internal
def remaining_stance(state: State, reference: Reference, leg: int) -> float:
    """How long a foot that stands still stays there, as far as the clock knows [s]."""
    clock = state.clock
    if state.clock.gait_running == 0 or clock.lift_wait > 0.0:
        return math.inf
    return float((1.0 - (clock.phase - reference.lift_phase[leg]) % 1.0) * reference.period)


@internal
def is_recoverable(
    state: State,
    model: Model,
    reference: Reference,
    parameters: Parameters,
    velocity: np.ndarray,
    goal: np.ndarray,
) -> bool:
    """Whether the robot can come to rest from where it is, with other references.

    A foot that has less room already, or a support that is weaker, may not lose any.

    Args:
        state: Where the engine is.
        model: The robot.
        reference: What is to be done.
        parameters: The margins.
        velocity: Reference of the path's velocity, from which it brakes, shape (3,).
        goal: Reference of the pose, which stays, shape (6,).
    """
    legs, clock, g = state.leg_count, state.clock, state.ground_filter[3]
    speed, pose, path = state.velocity_filter.copy(), state.pose_filter.copy(), state.path.copy()
    rest, mean, R, trunk = np.zeros(3), np.empty(3), np.empty((3, 3)), np.empty(3)
    aside = np.zeros((3, 2))
    least, stays = np.empty(legs), np.empty(legs)
    foot, landing, now = state.foot, state.touchdown, state.body_position
    standing, left = np.zeros(legs, dtype=np.int64), 0.0
    for leg in range(legs):
        doing = state.leg_phase[leg]
        if doing == LegPhase.STANCE and reference.used[leg]:
            standing[leg] = 1
            least[leg] = leg_margin(
                model,
                parameters,
                leg,
                state.R_odom_body,
                now,
                foot[leg, 0],
                foot[leg, 1],
                foot[leg, 2],
            )
            stays[leg] = remaining_stance(state, reference, leg)
        elif doing == LegPhase.SWING:
            # From then on it stands where it lands.
            stays[leg] = state.swing_duration[leg] - state.swing_elapsed[leg]
            left = max(left, stays[leg])
            least[leg] = ENOUGH
    for i in range(3):
        speed[0, i] = velocity[i]
    for i in range(6):
        pose[0, i] = goal[i]
    edges = np.empty((legs * legs, 5))
    count = support_edges(foot, standing, edges) if left > 0.0 else 0
    time, holds = 0.0, 0.0
    for look in range(LOOKS + 1):
        if look > 0:
            time += SPAN
            # Braked half before and half after: to second order what it does in between.
            approach(speed[0], rest, 0, model.radius, parameters.acceleration * SPAN / 2)
            for i in range(3):
                mean[i] = speed[2, i] / 2
            follow(speed, parameters.velocity_bandwidth, SPAN)
            for i in range(3):
                mean[i] += speed[2, i] / 2
            approach(speed[0], rest, 0, model.radius, parameters.acceleration * SPAN / 2)
            integrate_twist(path, mean, SPAN, path)
            follow(pose, parameters.pose_bandwidth, SPAN)
        last = 0 if look == LOOKS else 3
        if reference.sway != 0.0:
            phase = clock.phase + time / reference.period
            sway_wave(model, reference, phase, aside)
        x, y = (
            clock.sway_share * aside[0, 0] + clock.lean[0],
            clock.sway_share * aside[0, 1] + clock.lean[1],
        )
        if look == 0:
            x, y = state.sway_filter[3, 0], state.sway_filter[3, 1]
        x, y = x + pose[last, 0], y + pose[last, 1]
        c, s = math.cos(path[2]), math.sin(path[2])
        rotation(pose[last, 3], pose[last, 4], pose[last, 5] + path[2], R)
        trunk[0], trunk[1] = path[0] + c * x - s * y, path[1] + s * x + c * y
        trunk[2] = g[0] + g[1] * path[0] + g[2] * path[1] + model.height
        trunk[2] += pose[last, 2]
        for leg in range(legs):
            doing = state.leg_phase[leg]
            if doing == LegPhase.HELD or (doing == LegPhase.STANCE and not standing[leg]):
                continue
            if doing == LegPhase.STANCE:
                if time > stays[leg] + FOLLOWS:
                    continue
                x, y, z = foot[leg, 0], foot[leg, 1], foot[leg, 2]
            elif doing == LegPhase.SWING and time < stays[leg]:
                continue
            else:
                x, y, z = landing[leg, 0], landing[leg, 1], landing[leg, 2]
            room = leg_margin(model, parameters, leg, R, trunk, x, y, z)
            if doing != LegPhase.STANCE and doing != LegPhase.SWING and look == 0:
                least[leg] = room
            if not room >= least[leg] - 1e-9:
                return False
        if left > 0.0 and time <= left + SPAN:
            com = state.com
            x = trunk[0] + R[0, 0] * com[0] + R[0, 1] * com[1] + R[0, 2] * com[2]
            y = trunk[1] + R[1, 0] * com[0] + R[1, 1] * com[1] + R[1, 2] * com[2]
            margin = edge_margin(edges, count, x, y)
            if look == 0:
                holds = min(HOLDS * parameters.support_margin, margin)
            if margin < holds - 1e-9:
                return False
    return True
