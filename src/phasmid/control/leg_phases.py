"""Phases of the legs: feet lift, land where they meet ground, go on down, draw back and settle."""

from __future__ import annotations

import math

from phasmid.compiled import compiled
from phasmid.control.body_motion import ground_height
from phasmid.control.footholds import (
    choose_foothold,
    end_search,
    neutral_landing,
    set_search,
    start_search,
)
from phasmid.control.reach import is_reachable
from phasmid.control.swing import advance_quintic, raise_foot, restart_line, set_times, stop_foot
from phasmid.control.types import (
    Contact,
    LegPhase,
    Manoeuvre,
    Model,
    Reference,
    SearchStage,
    State,
)
from phasmid.kinematics.vector_kernels import turned

LOWEST_LIFT = 0.5
"""Part of the swing before which a contact does not count as a landing."""

PROBING_SPEED, ROUGH_PROBING_SPEED = 0.2, 0.15
"""Speed at which a foot without contact goes on down, and that on rough ground, where the body
follows it [m/s]."""

REPEATED_SHARE = 0.6
"""Duration of a repeated swing, over a hit obstacle or to a search goal, as a share of that of the
gait's swing."""

MOST_LATERAL, LATERAL_STEP = 0.06, 0.015
"""Largest lateral displacement of a swing, and the steps in which it is sought [m]."""

LEAST_LATERAL, AT_REST = 0.5, 1e-3
"""Least share of a foot's distance from its hip that is lateral, for a displacement; speed below
which the body does not move on [m/s]."""

SHAPES = 16
"""Attempts to bring the top of a swing within reach: five displacements, then lower swings at the
largest one."""

FROZEN = 0.7
"""Part of the swing after which the touchdown no longer changes."""

STOPS_SHORT = 0.004
"""Distance to its depth at which a foot without contact has reached it [m]."""

MOST_HITS = 3
"""Most obstacles in a swing over which a foot lifts; at the next one it lands."""

SETTLE = 0.012
"""Time in which a foot comes to rest after contact [s]."""

PRESS, PRESSED = 0.08, 5e-4
"""Time in which a settled foot goes down by its sag, to take its share of the load [s]; least sag
for which it does [m]."""

FOLD, BRAKES = 0.8, 10.0
"""Time in which a leg folds [s]; deceleration at its begin, as a multiple of speed over time: the
quintic overshoots the least, by 0.06 of their product."""

BACK, BACK_RISE, BACK_TIME = 0.01, 0.01, 0.16
"""Distance by which a foot draws back from an obstacle and rises [m], and time for it [s]."""

LOST_AFTER, LEAST_DEPTH = 0.08, 0.01
"""Time without contact after which a stance foot is lowered [s], and depth that it must reach for
that [m]."""

LANDING_SPEED, LANDING_TIME, COASTING = 0.4, 0.08, 0.3
"""Landing of all feet at once: largest speed [m/s], least time [s], and part of that time for which
a foot keeps its horizontal velocity."""


@compiled
def height_above_ground(state: State, leg: int) -> float:
    """Return the height of a foot above the estimated ground [m]."""
    foot = state.foot[leg]
    return float(foot[2] - ground_height(state, foot[0], foot[1]))


@compiled
def reaches_height(state: State, model: Model, leg: int, height: float) -> bool:
    """Return whether a foot reaches so far above its place from the present pose [m]."""
    foot = state.foot[leg]
    return is_reachable(state, model, leg, foot[0], foot[1], foot[2] + height)


@compiled
def lateral_direction(state: State, model: Model, leg: int) -> tuple[float, float]:
    """Return the unit vector in odom across the body's motion that points away from a leg's hip.

    Where the body does not move on, it points from the hip to the neutral foot. It is zero for a
    leg that swings along its own direction.
    """
    out, v = model.neutral[leg] - model.p_body_hip[leg], state.velocity_filter[2]
    x, y = out[0], out[1]
    length, speed = math.hypot(x, y), math.hypot(v[0], v[1])
    if speed > AT_REST:
        across = (v[0] * y - v[1] * x) / speed
        if abs(across) < LEAST_LATERAL * length:
            return 0.0, 0.0
        side = 1.0 if across > 0.0 else -1.0
        x, y, length = -side * v[1], side * v[0], speed
    return turned(state.path[2], x / length, y / length)


@compiled
def shape_swing(state: State, model: Model, reference: Reference, leg: int) -> None:
    """Bring the top of a swing within reach: displace it laterally, then lower it by 20 % each.

    The knee limits how high a foot rises near the body; farther out it rises higher.
    """
    foot, time, v = state.foot[leg], state.swing_duration[leg], state.velocity_filter[2]
    _, _, x, y = neutral_landing(state, model, reference, leg, time)
    vx, vy = turned(state.path[2], v[0], v[1])
    # Where the foot will be over the body at half of the swing.
    x, y = (foot[0] + x - vx * time) / 2, (foot[1] + y - vy * time) / 2
    away_x, away_y = lateral_direction(state, model, leg)
    lateral = 0.0
    for _ in range(SHAPES):
        px, py, z = x + lateral * away_x, y + lateral * away_y, foot[2] + state.swing_height[leg]
        if is_reachable(state, model, leg, px, py, z):
            state.swing_lateral[leg, 0], state.swing_lateral[leg, 1] = (
                lateral * away_x,
                lateral * away_y,
            )
            break
        if lateral < MOST_LATERAL:
            lateral += LATERAL_STEP
        else:
            state.swing_height[leg] *= 0.8


@compiled
def lift_off(
    state: State, model: Model, reference: Reference, leg: int, elapsed: float, duration: float
) -> None:
    """Begin the swing of a leg, with the time since lift-off and its duration [s]."""
    if state.leg_phase[leg] == LegPhase.STANCE:
        if reference.contact[leg] == Contact.GROUND:
            state.last_foothold[leg] = state.foot[leg]
        if state.search_stage[leg] == SearchStage.RETURNED:
            set_search(state, leg, SearchStage.NONE)
    state.leg_phase[leg] = LegPhase.SWING
    state.manoeuvre[leg] = Manoeuvre.NONE
    set_times(state, leg, duration, max(reference.step_height, reference.swing_height[leg]))
    state.swing_elapsed[leg] = elapsed
    shape_swing(state, model, reference, leg)
    state.touchdown[leg] = state.foot[leg]
    restart_line(state, leg)


@compiled
def reachable_depth(
    state: State, model: Model, leg: int, x: float, y: float, depth: float
) -> float:
    """Return a depth below a foot that its leg reaches at a point (x, y) of odom [m], at most this.

    It is 0 where the leg reaches no depth that was tried.
    """
    for _ in range(4):
        if is_reachable(state, model, leg, x, y, state.foot[leg, 2] - depth):
            return depth
        depth *= 0.7
    return 0.0


@compiled
def probe_down(state: State, model: Model, reference: Reference, leg: int, depth: float) -> None:
    """Let a foot at rest go straight down by a depth [m], or as far as its leg reaches."""
    foot = state.foot[leg]
    depth = reachable_depth(state, model, leg, foot[0], foot[1], depth)
    state.touchdown[leg, 2] = foot[2] - depth
    state.time_without_contact[leg] = 0.0
    rough = reference.landing_depth > model.landing_depth
    speed = ROUGH_PROBING_SPEED if rough else PROBING_SPEED
    set_times(state, leg, max(1.875 * depth / speed, 0.05), 0.0)


@compiled
def land_here(state: State, model: Model, reference: Reference, leg: int) -> None:
    """Let a foot go straight down from rest, with contact sensing below the estimated ground."""
    stop_foot(state, leg)
    state.leg_phase[leg] = LegPhase.PROBING
    # An obstacle that stopped it here would stop it on its path elsewhere.
    set_search(state, leg, SearchStage.LAND_HERE)
    depth = height_above_ground(state, leg)
    if reference.contact[leg] != Contact.UNKNOWN:
        depth += reference.landing_depth
    probe_down(state, model, reference, leg, max(depth, 0.0))


@compiled
def stand(state: State, leg: int) -> None:
    """Begin the stance of a foot where it is."""
    stop_foot(state, leg)
    state.leg_phase[leg] = LegPhase.STANCE
    set_times(state, leg, 0.0, 0.0)
    state.time_without_contact[leg] = 0.0


@compiled
def end_curve(state: State, model: Model, reference: Reference, leg: int) -> None:
    """Let a foot at the end of its curve stand; without contact it goes on down or searches."""
    state.foot[leg] = state.touchdown[leg]
    phase, in_air = state.leg_phase[leg], reference.contact[leg] == Contact.AIR
    if phase == LegPhase.SWING and in_air and reference.landing_depth > 0:
        stop_foot(state, leg)
        state.leg_phase[leg] = LegPhase.PROBING
        # After hitting obstacles a foot aims above the estimated ground.
        depth = max(height_above_ground(state, leg), 0.0) + reference.landing_depth
        probe_down(state, model, reference, leg, depth)
        return
    if (
        phase == LegPhase.PROBING
        and in_air
        and reference.used[leg] == 1
        and state.search_stage[leg] < SearchStage.RETURNED
    ):
        deep = height_above_ground(state, leg) + reference.landing_depth
        foot = state.foot[leg]
        deep = reachable_depth(state, model, leg, foot[0], foot[1], deep)
        if deep > STOPS_SHORT:
            # The body has come down after the foot.
            probe_down(state, model, reference, leg, deep)
            return
        if start_search(state, reference, leg):
            return
        set_search(state, leg, SearchStage.GAVE_UP)
    settled = phase == LegPhase.SETTLING
    end_search(state, leg, settled)
    stand(state, leg)
    if settled and reference.foot_sag[leg] > PRESSED:
        # Compliant legs let it touch the ground above its target; going on down loads it.
        state.touchdown[leg, 2] = state.foot[leg, 2] - reference.foot_sag[leg]
        set_times(state, leg, PRESS, 0.0)


@compiled
def draw_back(state: State, model: Model, leg: int) -> None:
    """Let a swinging foot go back and up from an obstacle, as far as its leg reaches.

    It continues its present motion.
    """
    foot, goal = state.foot[leg], state.touchdown[leg]
    away = foot - goal
    away *= BACK / max(math.hypot(away[0], away[1]), 1e-6)
    away[2] = BACK_RISE
    for _ in range(4):
        goal[:] = foot + away
        if is_reachable(state, model, leg, goal[0], goal[1], goal[2]):
            break
        away *= 0.5
    state.manoeuvre[leg] = Manoeuvre.DRAW_BACK
    set_times(state, leg, BACK_TIME, 0.0)
    restart_line(state, leg)


@compiled
def stop_at_contact(state: State, leg: int) -> None:
    """Bring a foot to rest a little beyond its contact, without a jump of its velocity."""
    state.touchdown[leg] = state.foot[leg] + 0.4 * SETTLE * state.foot_velocity[leg]
    state.manoeuvre[leg] = Manoeuvre.NONE
    set_times(state, leg, SETTLE, 0.0)
    restart_line(state, leg)


@compiled
def has_lost_ground(state: State, model: Model, reference: Reference, leg: int, h: float) -> bool:
    """Return whether a stance foot has had no contact for `LOST_AFTER` and can be lowered."""
    if reference.contact[leg] != Contact.AIR or state.clock.gait_running == 0:
        state.time_without_contact[leg] = 0.0
        return False
    state.time_without_contact[leg] += h
    if state.time_without_contact[leg] < LOST_AFTER:
        return False
    if height_above_ground(state, leg) < -reference.landing_depth:
        return False
    return reaches_height(state, model, leg, -LEAST_DEPTH)


@compiled
def land_swing_legs(state: State, model: Model, reference: Reference) -> None:
    """Let all swinging feet land from where they are, without a jump of position or velocity.

    With contact sensing they go on to the landing depth below the ground plane.
    """
    for leg in range(state.leg_count):
        # A leg that is not used goes on folding.
        if state.leg_phase[leg] == LegPhase.SWING and reference.used[leg]:
            drop = max(height_above_ground(state, leg), 0.0)
            drop += reference.landing_depth if reference.contact[leg] != Contact.UNKNOWN else 0.0
            time = max(1.875 * drop / LANDING_SPEED, LANDING_TIME)
            restart_line(state, leg)
            goal = state.foot[leg] + COASTING * time * state.foot_velocity[leg]
            goal[2] = state.foot[leg, 2] - reachable_depth(
                state, model, leg, goal[0], goal[1], drop
            )
            state.touchdown[leg] = goal
            state.manoeuvre[leg] = Manoeuvre.NONE
            set_times(state, leg, time, 0.0)
            state.time_without_contact[leg] = 0.0
            state.leg_phase[leg] = LegPhase.PROBING
        if state.leg_phase[leg] == LegPhase.PROBING:
            # A foot that searches for ground would bear no load meanwhile.
            set_search(state, leg, SearchStage.LAND_HERE)


@compiled
def move_feet(state: State, model: Model, reference: Reference, h: float) -> None:
    """Advance the feet that are not at rest by a time step."""
    if reference.tipping:
        land_swing_legs(state, model, reference)
    for leg in range(state.leg_count):
        phase, contact = state.leg_phase[leg], reference.contact[leg]
        returned = state.search_stage[leg] == SearchStage.RETURNED
        if phase == LegPhase.HELD or (
            phase == LegPhase.STANCE and contact != Contact.AIR and not returned
        ):
            set_search(state, leg, SearchStage.NONE)
        if phase == LegPhase.HELD:
            continue
        if phase == LegPhase.STANCE and state.swing_elapsed[leg] >= state.swing_duration[leg]:
            if not has_lost_ground(state, model, reference, leg, h):
                continue
            stop_foot(state, leg)
            depth = height_above_ground(state, leg) + reference.landing_depth
            probe_down(state, model, reference, leg, depth)
            state.manoeuvre[leg] = Manoeuvre.LOWER
        before = state.swing_elapsed[leg]
        state.swing_elapsed[leg] += h
        part = state.swing_elapsed[leg] / state.swing_duration[leg]
        swings = phase == LegPhase.SWING
        if swings and not reference.used[leg] and 0.5 <= part < 0.9:
            state.leg_phase[leg] = LegPhase.HELD
            set_times(state, leg, FOLD, 0.0)
            # With the acceleration at the top of a swing it would first go down to the ground.
            state.qdd[leg] = -BRAKES / FOLD * state.qd[leg]
            continue
        if swings and contact == Contact.OBSTACLE:
            draw_back(state, model, leg)
            before, state.swing_elapsed[leg] = 0.0, h
        retreats = swings and state.manoeuvre[leg] != Manoeuvre.NONE
        if retreats and state.swing_elapsed[leg] >= state.swing_duration[leg] - 1e-9:
            # It lifts again, over the obstacle or to a search goal.
            if reference.obstacle_hits[leg] > MOST_HITS:
                land_here(state, model, reference, leg)
                continue
            ago = state.swing_elapsed[leg] - state.swing_duration[leg]
            time = REPEATED_SHARE * (1.0 - reference.duty_factor) * reference.period
            lift_off(state, model, reference, leg, ago, time)
            before, retreats = ago - h, False
            part = ago / time
        lowered = phase == LegPhase.STANCE and state.manoeuvre[leg] == Manoeuvre.LOWER
        if lowered:
            # Without contact sensing a stance foot goes no deeper.
            lands = contact != Contact.AIR or state.clock.gait_running == 0
        else:
            late = phase == LegPhase.PROBING or (swings and part > LOWEST_LIFT)
            lands = contact == Contact.GROUND and late and not retreats
        if lands:
            stop_at_contact(state, leg)
            before, state.swing_elapsed[leg] = 0.0, h
            if not lowered:
                state.leg_phase[leg] = LegPhase.SETTLING
        elif swings and part < FROZEN and not retreats:
            left = state.swing_duration[leg] - state.swing_elapsed[leg]
            choose_foothold(state, model, reference, leg, left)
        if state.swing_elapsed[leg] > state.swing_duration[leg] - 1e-9:
            end_curve(state, model, reference, leg)
            continue
        advance_quintic(
            state.line_position[leg],
            state.line_velocity[leg],
            state.line_acceleration[leg],
            state.touchdown[leg],
            state.swing_duration[leg] - before,
            state.swing_elapsed[leg] - before,
        )
        raise_foot(state, leg)
