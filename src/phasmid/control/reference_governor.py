"""Reference governor: takes a step of velocity and pose only if the robot can come to rest from it.

With the pose at its reference then, every foot must be within reach, and the centre of mass over
the stance feet. Since that stays possible from update to update, nothing has to stop at once.
"""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.body_motion import (
    POSE_BANDWIDTH,
    VELOCITY_BANDWIDTH,
    approach,
    bears_load,
    follow,
    place_body,
    sway_wave,
)
from phasmid.control.reach import ENOUGH, reach_margin
from phasmid.control.types import SUPPORT_MARGIN, LegPhase, Model, Reference, State
from phasmid.control.vectors import integrate_twist, rotate
from phasmid.control.velocity_limits import time_to_lift
from phasmid.gait.support_kernels import edge_margin, support_edges

LOOKS, SPAN = 5, 0.07
"""Number of samples of the motion to rest, and time between them [s]."""

HOLDS = 0.75
"""Share of the support margin that is kept on it."""

FOLLOWS = 0.05
"""Time after its lift-off for which a foot counts as standing [s]."""


@compiled
def is_settled(stages: np.ndarray, goal: np.ndarray, close: float) -> bool:
    """Return whether all stages of a filter are close to a goal."""
    return bool(np.abs(stages - goal).max() < close)


@compiled
def leg_margin(model: Model, leg: int, R: np.ndarray, body: np.ndarray, foot: np.ndarray) -> float:
    """Return the margin of a leg with its foot at a point of odom, `ENOUGH` at most."""
    return min(reach_margin(model, leg, R, body, foot[0], foot[1], foot[2]), ENOUGH)


@compiled
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
    legs, clock = state.leg_count, state.clock
    speed, pose = state.velocity_filter.copy(), state.pose_filter.copy()
    path = state.path[0], state.path[1], state.path[2]
    rest, least, stays = np.zeros(3), np.full(legs, ENOUGH), np.full(legs, math.inf)
    stance, left = np.zeros(legs, dtype=np.bool_), 0.0 if reference.walks == 1 else math.inf
    for leg in range(legs):
        if bears_load(state, reference, leg):
            R, body, stance[leg] = state.R_odom_body, state.body_position, True
            least[leg] = leg_margin(model, leg, R, body, state.foot[leg])
            # At rest and while a lift waits it stays.
            if clock.gait_running == 1 and clock.lift_wait == 0.0:
                stays[leg] = time_to_lift(reference, leg, clock.phase)
        elif state.leg_phase[leg] == LegPhase.SWING:
            # From then on it stands where it lands.
            stays[leg] = state.swing_duration[leg] - state.swing_elapsed[leg]
            left = max(left, stays[leg])
        elif state.leg_phase[leg] == LegPhase.HELD and reference.used[leg]:
            left = math.inf
    speed[0], pose[0] = velocity, goal
    edges = np.empty((legs * legs, 5))
    count = support_edges(state.foot, stance, edges) if left > 0.0 else 0
    time, holds = 0.0, 0.0
    for look in range(LOOKS + 1):
        if look > 0:
            time += SPAN
            # Braking half before and half after is exact to second order.
            approach(speed[0], rest, model.radius, model.acceleration * SPAN / 2)
            before = speed[2].copy()
            follow(speed, VELOCITY_BANDWIDTH, SPAN)
            approach(speed[0], rest, model.radius, model.acceleration * SPAN / 2)
            path = integrate_twist(path, (before + speed[2]) / 2, SPAN)
            follow(pose, POSE_BANDWIDTH, SPAN)
        aside = state.sway_filter[3].copy()
        if look > 0:
            wave = sway_wave(model, reference, clock.phase + time / reference.period)
            aside = clock.sway_share * wave[0] + clock.lean
        stage = pose[0 if look == LOOKS else 3]
        R, body = place_body(state, model, path, stage, aside[0], aside[1])
        for leg in range(legs):
            phase, foot = state.leg_phase[leg], state.touchdown[leg]
            if phase == LegPhase.HELD or (phase == LegPhase.SWING and time < stays[leg]):
                continue
            if phase == LegPhase.STANCE:
                if not stance[leg] or time > stays[leg] + FOLLOWS:
                    continue
                foot = state.foot[leg]
            margin = leg_margin(model, leg, R, body, foot)
            if phase != LegPhase.STANCE and phase != LegPhase.SWING and look == 0:
                least[leg] = margin
            if not margin >= least[leg] - 1e-9:
                return False
        if left > 0.0 and time <= left + SPAN:
            centre = body + rotate(R, state.com)
            support = edge_margin(edges, count, centre[0], centre[1])
            if look == 0:
                holds = min(HOLDS * SUPPORT_MARGIN, support)
            if support < holds - 1e-9:
                return False
    return True
