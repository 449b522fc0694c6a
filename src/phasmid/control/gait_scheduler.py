"""When feet lift and land: the gait's clock, which waits where a foot could not be spared."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import internal
from phasmid.control.foothold_region import is_reached, speed_share, sway_wave
from phasmid.control.foothold_search import is_searching, set_search
from phasmid.control.types import (
    LegPhase,
    Manoeuvre,
    Model,
    Parameters,
    Reference,
    SearchStage,
    State,
)
from phasmid.gait.support_kernels import edge_margin, support_edges

DEEP = 0.01
"""A foot that is farther than this below the ground that is believed is in a hole [m]."""

HOME, STAYS = 5e-4, 4e-3
"""A foot nearer than this to its neutral place need not step there [m]; and than this where the
robot stands already, since feet seem to move as it learns how the ground lies."""

LEAN_AFTER, LEAN_SPEED, FARTHEST_LEAN = 0.1, 0.04, 0.08
"""How long a lift waits before the body leans [s], how fast [m/s] and how far it does [m]."""

OVERRUN = 3 * LEAN_SPEED / 15.0
"""Way that the body goes on after its lean is told to end: three lags of 15/s [m]."""

FORESIGHT = 0.004
"""What the legs' own motion makes of the centre of mass until a foot lands is not foreseen [m]."""

UPRIGHT = 1.0
"""How fast a body comes back that has leant [1/s]."""

ON_ITS_WAY = 2e-3
"""A pose farther than this from its reference is on its way there [m, rad]."""

LEAST_RISE = 0.4
"""Share of a step to which a foot shall rise at least."""

ALMOST = 1e-9
"""Phases closer than this are one instant."""


@internal
def stays_at_foothold(state: State, reference: Reference, leg: int) -> bool:
    """Whether a foot has come back from where no ground is, of a robot that is to stand."""
    v = reference.velocity
    return bool(
        state.search_stage[leg] == SearchStage.RETURNED
        and v[0] == 0.0
        and v[1] == 0.0
        and v[2] == 0.0
    )


@internal
def distance_from_neutral(state: State, model: Model, reference: Reference, leg: int) -> float:
    """Distance of a foot from its neutral place on the path, from above [m].

    One that stays where it has come back to is as good as there.
    """
    if stays_at_foothold(state, reference, leg):
        return 0.0
    c, s = math.cos(state.path[2]), math.sin(state.path[2])
    x = state.path[0] + c * model.neutral[leg, 0] - s * model.neutral[leg, 1]
    y = state.path[1] + s * model.neutral[leg, 0] + c * model.neutral[leg, 1]
    dx, dy = state.foot[leg, 0] - x, state.foot[leg, 1] - y
    return math.sqrt(dx * dx + dy * dy)


@internal
def is_commanded_to_move(state: State, reference: Reference) -> bool:
    """Whether the body moves over ground, or shall."""
    moves = False
    for i in range(3):
        moves = moves or reference.velocity[i] != 0.0 or abs(state.velocity_filter[2, i]) > 1e-4
    return moves


@internal
def margin_without_legs(
    state: State, model: Model, reference: Reference, lifted: np.ndarray, time: float, turn: float
) -> float:
    """Smallest support margin of the feet that stay, now and after a time at this speed [m].

    Args:
        state: Where the engine is.
        model: The robot.
        reference: Its gait's sway is regarded.
        lifted: Legs that leave the ground, 1 or 0, shape (L,).
        time: How long they are in the air [s].
        turn: How far the gait's clock goes meanwhile.
    """
    legs = len(lifted)
    standing = np.zeros(legs, dtype=np.int64)
    for leg in range(legs):
        if state.leg_phase[leg] == LegPhase.STANCE and reference.used[leg] and not lifted[leg]:
            standing[leg] = 1
    R, com, path, v = state.R_odom_body, state.com, state.path, state.velocity_filter[2]
    rx = R[0, 0] * com[0] + R[0, 1] * com[1] + R[0, 2] * com[2] + state.body_position[0]
    ry = R[1, 0] * com[0] + R[1, 1] * com[1] + R[1, 2] * com[2] + state.body_position[1]
    edges = np.empty((legs * legs, 5))
    count = support_edges(state.foot, standing, edges)
    now = edge_margin(edges, count, rx, ry)
    c, s = math.cos(path[2]), math.sin(path[2])
    wx = c * v[0] - s * v[1] - v[2] * (ry - path[1])
    wy = s * v[0] + c * v[1] + v[2] * (rx - path[0])
    if reference.sway != 0.0:
        a, b = np.empty((3, 2)), np.empty((3, 2))
        sway_wave(model, reference, state.clock.phase, a)
        sway_wave(model, reference, state.clock.phase + turn, b)
        dx, dy = b[0, 0] - a[0, 0], b[0, 1] - a[0, 1]
        rx, ry = (
            rx + state.clock.sway_share * (c * dx - s * dy),
            ry + state.clock.sway_share * (s * dx + c * dy),
        )
    then = edge_margin(edges, count, rx + wx * time, ry + wy * time)
    return min(now, then + FORESIGHT)


@internal
def best_phase(
    state: State,
    model: Model,
    reference: Reference,
    out: np.ndarray,
) -> None:
    """Write the phase, just before a lift, from which a gait lets the body go fastest.

    Args:
        state: Where the engine is.
        model: The robot.
        reference: Gait and velocity.
        out: Written: the phase, and the share of the velocity, shape (2,).
    """
    offsets, legs = reference.lift_phase, state.leg_count
    out[1] = -1.0
    for k in range(legs):
        if not reference.used[k]:
            continue
        phase = (offsets[k] - ALMOST) % 1.0
        good = True
        for leg in range(legs):
            if reference.used[leg] and state.leg_phase[leg] == LegPhase.SWING:
                left = state.swing_duration[leg] - state.swing_elapsed[leg]
                good = good and (1.0 - (phase - offsets[leg]) % 1.0) * reference.period >= left
        if not good:
            continue
        share = speed_share(state, model, reference, reference.velocity, phase)
        if share > out[1] + 1e-9:
            out[0], out[1] = phase, share


@internal
def is_deep(state: State, leg: int) -> bool:
    """Whether a foot goes down deeper than the ground was believed to be."""
    g, foot = state.ground_filter[3], state.foot[leg]
    ground = g[0] + g[1] * foot[0] + g[2] * foot[1]
    return bool(state.leg_phase[leg] == LegPhase.PROBING and foot[2] < ground - DEEP)


@internal
def rises(state: State, model: Model, leg: int, height: float) -> bool:
    """Whether a foot reaches a height above where it is, as the body is now [m]."""
    foot = state.foot[leg]
    return is_reached(state, model, leg, foot[0], foot[1], foot[2] + height)


@internal
def is_hindered_by_pose(state: State, model: Model, reference: Reference, leg: int) -> bool:
    """Whether a foot rises hardly, and may do better when the pose is where it goes to."""
    away = 0.0
    for i in range(6):
        away = max(away, abs(state.pose_filter[3, i] - state.pose_filter[0, i]))
    return away > ON_ITS_WAY and not rises(state, model, leg, LEAST_RISE * reference.step_height)


@internal
def lift_off(
    state: State, model: Model, reference: Reference, leg: int, ago: float, time: float
) -> None:
    """Let a foot begin its swing.

    Args:
        state: Where the engine is.
        model: The robot.
        reference: It has the height of the step, of which less is taken where that is out of reach.
        leg: The leg's index.
        ago: Time since it lifted [s].
        time: Of the swing [s].
    """
    if state.leg_phase[leg] == LegPhase.STANCE:
        if reference.contact[leg] == 1:
            for i in range(3):
                state.last_foothold[leg, i] = state.foot[leg, i]
        if state.search_stage[leg] == SearchStage.RETURNED:
            set_search(state, leg, SearchStage.NONE)
    state.leg_phase[leg] = LegPhase.SWING
    state.manoeuvre[leg] = Manoeuvre.NONE
    state.swing_elapsed[leg], state.swing_duration[leg], state.swing_height[leg] = (
        ago,
        time,
        reference.step_height,
    )
    for _ in range(9):
        if rises(state, model, leg, state.swing_height[leg]):
            break
        state.swing_height[leg] *= 0.8
    for i in range(3):
        state.touchdown[leg, i] = state.line_position[leg, i] = state.foot[leg, i]
        state.line_velocity[leg, i] = state.foot_velocity[leg, i]
        state.line_acceleration[leg, i] = state.foot_acceleration[leg, i]


@internal
def can_lean(state: State, model: Model, x: float, y: float) -> bool:
    """Whether all feet would be reached from farther in a direction in odom."""
    for leg in range(state.leg_count):
        if state.leg_phase[leg] == LegPhase.HELD:
            continue
        # As much as the body still goes on after it has been told not to.
        place = state.touchdown[leg]
        px, py = place[0] - OVERRUN * x, place[1] - OVERRUN * y
        if not is_reached(state, model, leg, px, py, place[2]):
            return False
    return True


@internal
def lean(state: State, model: Model, lifted: np.ndarray, h: float) -> None:
    """Let the body lean towards the middle of the feet that stay, for a lift that waits.

    Args:
        state: Where the engine is, changed.
        model: The robot.
        lifted: Legs that are due to lift, 1 or 0, shape (L,).
        h: Step of time [s].
    """
    if state.clock.lift_wait < LEAN_AFTER:
        return
    x, y, count = 0.0, 0.0, 0
    for leg in range(len(lifted)):
        if state.leg_phase[leg] == LegPhase.STANCE and not lifted[leg]:
            x += state.foot[leg, 0]
            y += state.foot[leg, 1]
            count += 1
    if count < 3:
        return
    R, com, path = state.R_odom_body, state.com, state.path
    x = x / count - R[0, 0] * com[0] - R[0, 1] * com[1] - R[0, 2] * com[2] - state.body_position[0]
    y = y / count - R[1, 0] * com[0] - R[1, 1] * com[1] - R[1, 2] * com[2] - state.body_position[1]
    length = math.sqrt(x * x + y * y)
    if length < 1e-3:
        return
    c, s = math.cos(path[2]), math.sin(path[2])
    way = LEAN_SPEED * h / length
    dx, dy = way * (c * x + s * y), way * (c * y - s * x)
    leant = math.sqrt((state.clock.lean[0] + dx) ** 2 + (state.clock.lean[1] + dy) ** 2)
    if leant < FARTHEST_LEAN and can_lean(state, model, x / length, y / length):
        state.clock.lean[0] += dx
        state.clock.lean[1] += dy


@internal
def end_lean(state: State, h: float) -> None:
    """Let the body come back from where it leant, while its feet hold it easily."""
    left = 1 - min(UPRIGHT * h, 1.0)
    state.clock.lean[0] *= left
    state.clock.lean[1] *= left


@internal
def step_to_neutral(
    state: State, model: Model, reference: Reference, parameters: Parameters, time: float
) -> None:
    """Let the foot that can best be spared step to its neutral place, one at a time.

    Args:
        state: Where the engine is, changed.
        model: The robot.
        reference: What is to be done.
        parameters: The margins.
        time: Of a swing [s].
    """
    lifted = np.zeros(state.leg_count, dtype=np.int64)
    best, most = -1, parameters.support_margin
    for leg in range(state.leg_count):
        if state.leg_phase[leg] == LegPhase.HELD:
            continue
        if state.leg_phase[leg] != LegPhase.STANCE:
            return
        if (
            reference.used[leg]
            and distance_from_neutral(state, model, reference, leg) > HOME
            and not is_hindered_by_pose(state, model, reference, leg)
        ):
            lifted[leg] = 1
            margin = margin_without_legs(state, model, reference, lifted, time, 0.0)
            lifted[leg] = 0
            if margin > most:
                best, most = leg, margin
    if best >= 0:
        lift_off(state, model, reference, best, 0.0, time)


@internal
def advance_phase(
    state: State, model: Model, reference: Reference, parameters: Parameters, h: float
) -> None:
    """Let the gait's clock go on by a step of time, and feet lift that are due.

    Args:
        state: Where the engine is, changed.
        model: The robot.
        reference: What is to be done.
        parameters: The margins.
        h: Step of time [s].
    """
    legs, clock, period = state.leg_count, state.clock, reference.period
    moving = is_commanded_to_move(state, reference)
    away, near = False, STAYS if state.clock.gait_running == 0 else HOME
    for leg in range(legs):
        if reference.used[leg]:
            away = (
                away
                or state.leg_phase[leg] != LegPhase.STANCE
                or distance_from_neutral(state, model, reference, leg) > near
            )
        elif state.leg_phase[leg] != LegPhase.HELD:
            away = True
    if not (moving or away):
        state.clock.gait_running = 0
    elif state.clock.gait_running == 0:
        found = np.empty(2)
        best_phase(state, model, reference, found)
        clock.phase = found[0] if found[1] >= 0 else clock.phase
        state.clock.gait_running = 1
    walking = 1.0 if state.clock.gait_running == 1 else 0.0
    most = 2 * h / period
    clock.sway_share += min(max(walking - clock.sway_share, -most), most)
    if state.clock.gait_running == 0:
        clock.lift_wait = 0.0
        end_lean(state, h)
        return
    step = h / period
    lifted = np.zeros(legs, dtype=np.int64)
    due, wait, short = 0, False, False
    state.clock.pose_hinders = 0
    for leg in range(legs):
        if not reference.used[leg]:
            # A leg that is no longer walked on leaves the ground as soon as it can be spared.
            if state.leg_phase[leg] == LegPhase.STANCE:
                lifted[leg] = 1
                if (
                    margin_without_legs(state, model, reference, lifted, 0.5 * period, 0.0)
                    > parameters.support_margin
                ):
                    lift_off(state, model, reference, leg, 0.0, 0.3)
                lifted[leg] = 0
            continue
        # A body that sways would go on over a foot that goes down into a hole.
        wait = wait or is_searching(state, leg) or (reference.sway != 0.0 and is_deep(state, leg))
        if 1.0 - (clock.phase - reference.lift_phase[leg]) % 1.0 > step:
            continue
        if state.leg_phase[leg] != LegPhase.STANCE and state.leg_phase[leg] != LegPhase.HELD:
            # One that has only just lifted is not late.
            wait = wait or state.swing_elapsed[leg] > 0.25 * state.swing_duration[leg]
        elif stays_at_foothold(state, reference, leg):
            continue
        elif (
            state.leg_phase[leg] == LegPhase.HELD
            or moving
            or distance_from_neutral(state, model, reference, leg) > HOME
        ):
            lifted[leg] = 1
            due += 1
            if state.leg_phase[leg] == LegPhase.STANCE and is_hindered_by_pose(
                state, model, reference, leg
            ):
                state.clock.pose_hinders = 1
    time = (1.0 - reference.duty_factor) * period
    if due > 0 and not wait:
        margin = margin_without_legs(
            state, model, reference, lifted, time, 1.0 - reference.duty_factor
        )
        short = margin < parameters.support_margin
        wait = short or state.clock.pose_hinders == 1
    if wait:
        clock.lift_wait += h
        if state.clock.pose_hinders == 0 and short:
            lean(state, model, lifted, h)
        if clock.lift_wait > parameters.patience:
            step_to_neutral(state, model, reference, parameters, time)
        return
    if clock.support_margin > 4 * parameters.support_margin + 0.01:
        end_lean(state, h)
    clock.lift_wait = 0.0
    for leg in range(legs):
        if lifted[leg]:
            ago = h - (1.0 - (clock.phase - reference.lift_phase[leg]) % 1.0) * period
            lift_off(state, model, reference, leg, max(ago, 0.0), time)
    clock.phase = (clock.phase + step) % 1.0
