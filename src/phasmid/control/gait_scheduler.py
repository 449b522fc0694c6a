"""Gait scheduler: the gait's clock, which lifts feet when they are due and can be spared."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.body_motion import (
    SWAY_BANDWIDTH,
    bears_load,
    com_in_odom,
    standing_feet,
    sway_wave,
)
from phasmid.control.footholds import is_searching
from phasmid.control.leg_phases import height_above_ground, lift_off, reaches_height
from phasmid.control.reach import is_reachable
from phasmid.control.types import SUPPORT_MARGIN, LegPhase, Model, Reference, SearchStage, State
from phasmid.control.vectors import in_odom, is_zero, point_velocity
from phasmid.control.velocity_limits import region_speed_share, time_to_lift
from phasmid.gait.support_kernels import edge_margin, support_edges
from phasmid.kinematics.vector_kernels import turned

DEEP = 0.01
"""Depth below the estimated ground from which a foot is in a hole [m]."""

HOME, STAYS = 5e-4, 4e-3
"""Distance from the neutral place within which a foot need not step [m], and within which it need
not while the robot is at rest, where the estimate of the ground still moves."""

LEAN_AFTER, LEAN_SPEED, FARTHEST_LEAN = 0.1, 0.04, 0.08
"""Time that a lift waits before the body leans [s], velocity [m/s] and largest distance [m] of the
lean."""

OVERRUN = 3 * LEAN_SPEED / SWAY_BANDWIDTH
"""Distance that the body still moves after its lean ends, by the three lags of the sway [m]."""

FORESIGHT = 0.004
"""Shortfall of the margin predicted for touchdown at which a foot may lift: the prediction does
not know the legs' own motion [m]."""

PATIENCE = 1.0
"""Time for which a lift waits for support before feet step to neutral [s]."""

UPRIGHT = 1.0
"""Rate at which the lean decays [1/s]."""

ON_ITS_WAY = 2e-3
"""Distance from its reference at which a pose is still changing [m, rad]."""

LEAST_STEP_SHARE = 0.4
"""Share of the step height that a foot should reach."""

LOST_SWING = 0.3
"""Duration of the swing in which a lost leg leaves the ground [s]."""

ALMOST = 1e-9
"""Difference of phases that counts as none."""


@compiled
def stays_at_foothold(state: State, reference: Reference, leg: int) -> bool:
    """Return whether a foot of a robot that is to stand has returned to its last foothold."""
    returned = state.search_stage[leg] == SearchStage.RETURNED
    return bool(returned and is_zero(reference.velocity))


@compiled
def is_away(state: State, model: Model, reference: Reference, leg: int, near: float) -> bool:
    """Return whether a foot is farther than `near` from its neutral place, from above [m].

    One that stays at its last foothold counts as there.
    """
    if stays_at_foothold(state, reference, leg):
        return False
    x, y = in_odom(state.path, model.neutral[leg, 0], model.neutral[leg, 1])
    return math.hypot(state.foot[leg, 0] - x, state.foot[leg, 1] - y) > near


@compiled
def margin_without_legs(
    state: State, model: Model, reference: Reference, lifted: np.ndarray, time: float, turn: float
) -> float:
    """Return the least support margin without the lifted legs, now and after a time [m].

    In that time [s] the phase of the gait changes by `turn`.
    """
    legs, path = len(lifted), state.path
    stance = standing_feet(state, reference) & ~lifted
    x, y = com_in_odom(state)
    edges = np.empty((legs * legs, 5))
    count = support_edges(state.foot, stance, edges)
    now = edge_margin(edges, count, x, y)
    vx, vy = point_velocity(path, state.velocity_filter[2], x, y)
    if reference.sway != 0.0:
        phase = state.clock.phase
        sway = sway_wave(model, reference, phase + turn) - sway_wave(model, reference, phase)
        dx, dy = turned(path[2], sway[0, 0], sway[0, 1])
        x, y = x + state.clock.sway_share * dx, y + state.clock.sway_share * dy
    then = edge_margin(edges, count, x + vx * time, y + vy * time)
    return min(now, then + FORESIGHT)


@compiled
def best_phase(state: State, model: Model, reference: Reference) -> tuple[float, float]:
    """Return the phase, just before a lift, at which the gait allows the largest velocity.

    The second number is the feasible share of the velocity; -1 where no phase fits the swing legs.
    """
    best, most = 0.0, -1.0
    for k in range(state.leg_count):
        if not reference.used[k]:
            continue
        phase, fits = (reference.lift_phase[k] - ALMOST) % 1.0, True
        for leg in range(state.leg_count):
            if reference.used[leg] and state.leg_phase[leg] == LegPhase.SWING:
                left = state.swing_duration[leg] - state.swing_elapsed[leg]
                fits = fits and time_to_lift(reference, leg, phase) >= left
        if fits:
            share = region_speed_share(state, model, reference, reference.velocity, phase)
            if share > most + 1e-9:
                best, most = phase, share
    return best, most


@compiled
def is_hindered_by_pose(state: State, model: Model, reference: Reference, leg: int) -> bool:
    """Return whether a foot can hardly rise while the pose is still changing."""
    away = np.abs(state.pose_filter[3] - state.pose_filter[0]).max()
    height = LEAST_STEP_SHARE * reference.step_height
    return away > ON_ITS_WAY and not reaches_height(state, model, leg, height)


@compiled
def can_lean(state: State, model: Model, x: float, y: float) -> bool:
    """Return whether all feet stay within reach if the body moves on in a direction of odom."""
    for leg in range(state.leg_count):
        if state.leg_phase[leg] != LegPhase.HELD:
            foot = state.touchdown[leg]
            px, py = foot[0] - OVERRUN * x, foot[1] - OVERRUN * y
            if not is_reachable(state, model, leg, px, py, foot[2]):
                return False
    return True


@compiled
def lean(state: State, model: Model, lifted: np.ndarray, h: float) -> None:
    """Let the body lean towards the middle of the remaining stance feet while a lift waits."""
    if state.clock.lift_wait < LEAN_AFTER:
        return
    middle, count = np.zeros(3), 0
    for leg in range(len(lifted)):
        if state.leg_phase[leg] == LegPhase.STANCE and not lifted[leg]:
            middle += state.foot[leg]
            count += 1
    if count < 3:
        return
    x, y = com_in_odom(state)
    x, y = middle[0] / count - x, middle[1] / count - y
    length = math.sqrt(x * x + y * y)
    if length < 1e-3:
        return
    ahead, aside = turned(-state.path[2], LEAN_SPEED * h / length * x, LEAN_SPEED * h / length * y)
    leant = state.clock.lean + np.array((ahead, aside))
    near = math.hypot(leant[0], leant[1]) < FARTHEST_LEAN
    if near and can_lean(state, model, x / length, y / length):
        state.clock.lean[:] = leant


@compiled
def step_to_neutral(state: State, model: Model, reference: Reference, time: float) -> None:
    """Lift the foot that leaves the largest support margin, to step to its neutral place.

    Only one foot at a time is in the air. The swing takes a time [s].
    """
    lifted = np.zeros(state.leg_count, dtype=np.bool_)
    best, most = -1, SUPPORT_MARGIN
    for leg in range(state.leg_count):
        if state.leg_phase[leg] == LegPhase.HELD:
            continue
        if state.leg_phase[leg] != LegPhase.STANCE:
            return
        if (
            reference.used[leg]
            and is_away(state, model, reference, leg, HOME)
            and not is_hindered_by_pose(state, model, reference, leg)
        ):
            lifted[leg] = True
            margin = margin_without_legs(state, model, reference, lifted, time, 0.0)
            lifted[leg] = False
            if margin > most:
                best, most = leg, margin
    if best >= 0:
        lift_off(state, model, reference, best, 0.0, time)


@compiled
def update_running(
    state: State, model: Model, reference: Reference, h: float, moving: bool
) -> None:
    """Start the gait where a foot or the body has to move, and stop it where none has to."""
    clock, away = state.clock, False
    near = STAYS if clock.gait_running == 0 else HOME
    for leg in range(state.leg_count):
        phase = state.leg_phase[leg]
        if bears_load(state, reference, leg):
            away = away or (reference.walks == 1 and is_away(state, model, reference, leg, near))
        else:
            away = away or reference.used[leg] == 1 or phase != LegPhase.HELD
    if not (moving or away):
        clock.gait_running = 0
    elif clock.gait_running == 0:
        phase, share = best_phase(state, model, reference)
        clock.phase = phase if share >= 0 else clock.phase
        clock.gait_running = 1
    step = 2 * h / reference.period
    clock.sway_share += min(max(clock.gait_running - clock.sway_share, -step), step)


@compiled
def spare_lost_legs(state: State, model: Model, reference: Reference) -> None:
    """Lift the lost leg that can best be spared, and write which others are needed.

    A lost leg is needed while it stands and the centre of mass would leave the support polygon
    without it. In that polygon a robot that only stands also has its other needed legs.
    """
    lifted = np.zeros(state.leg_count, dtype=np.bool_)
    for leg in range(state.leg_count):
        stands = state.leg_phase[leg] == LegPhase.STANCE
        state.needed[leg] = 1 if stands and reference.used[leg] == 0 else 0
    if reference.tipping == 1:
        return
    best, most = -1, SUPPORT_MARGIN
    for leg in range(state.leg_count):
        if state.needed[leg] == 1:
            lifted[leg] = True
            time = 0.5 * reference.period
            margin = margin_without_legs(state, model, reference, lifted, time, 0.0)
            lifted[leg] = False
            if margin > most:
                best, most = leg, margin
    if best >= 0:
        state.needed[best] = 0
        lift_off(state, model, reference, best, 0.0, LOST_SWING)


@compiled
def advance_phase(state: State, model: Model, reference: Reference, h: float) -> None:
    """Advance the gait's clock by a time step, and lift the feet that are due.

    The clock waits while a due foot cannot be spared, or a foot is late.
    """
    legs, clock, period = state.leg_count, state.clock, reference.period
    moving = not is_zero(reference.velocity) or np.abs(state.velocity_filter[2]).max() > 1e-4
    spare_lost_legs(state, model, reference)
    update_running(state, model, reference, h, moving)
    step, time = h / period, (1.0 - reference.duty_factor) * period
    in_air = False
    for leg in range(legs):
        in_air = in_air or state.leg_phase[leg] not in (LegPhase.STANCE, LegPhase.HELD)
    for leg in range(legs):
        lands = not in_air or time_to_lift(reference, leg, clock.phase) <= h
        if lands and reference.used[leg] and state.leg_phase[leg] == LegPhase.HELD:
            # A leg that is no longer lost lands when it is due, or before others lift.
            lift_off(state, model, reference, leg, 0.0, time)
            in_air = True
    if reference.walks == 0:
        clock.lift_wait = 0.0
        return
    if clock.gait_running == 0:
        clock.lift_wait = 0.0
        clock.lean *= 1 - min(UPRIGHT * h, 1.0)
        return
    lifted = np.zeros(legs, dtype=np.bool_)
    due, wait, short = 0, reference.tipping == 1, False
    clock.pose_hinders = 0
    for leg in range(legs):
        stands = state.leg_phase[leg] == LegPhase.STANCE
        if not reference.used[leg]:
            continue
        wait = wait or is_searching(state, leg)
        if reference.sway != 0.0 and state.leg_phase[leg] == LegPhase.PROBING:
            # A body that sways would move on over a foot that goes down into a hole.
            wait = wait or height_above_ground(state, leg) < -DEEP
        if time_to_lift(reference, leg, clock.phase) > h:
            continue
        if not stands:
            # One that has only just lifted is not late.
            wait = wait or state.swing_elapsed[leg] > 0.25 * state.swing_duration[leg]
        elif not stays_at_foothold(state, reference, leg) and (
            moving or is_away(state, model, reference, leg, HOME)
        ):
            lifted[leg] = True
            due += 1
            if is_hindered_by_pose(state, model, reference, leg):
                clock.pose_hinders = 1
    if due > 0 and not wait:
        turn = 1.0 - reference.duty_factor
        margin = margin_without_legs(state, model, reference, lifted, time, turn)
        short = margin < SUPPORT_MARGIN
        wait = short or clock.pose_hinders == 1
    if wait:
        clock.lift_wait += h
        if clock.pose_hinders == 0 and short:
            lean(state, model, lifted, h)
        if clock.lift_wait > PATIENCE and not reference.tipping:
            step_to_neutral(state, model, reference, time)
        return
    if clock.support_margin > 4 * SUPPORT_MARGIN + 0.01:
        clock.lean *= 1 - min(UPRIGHT * h, 1.0)
    clock.lift_wait = 0.0
    for leg in range(legs):
        if lifted[leg]:
            ago = h - time_to_lift(reference, leg, clock.phase)
            lift_off(state, model, reference, leg, max(ago, 0.0), time)
    clock.phase = (clock.phase + step) % 1.0
