"""How feet travel at one update: where they land, how they meet the ground, how they search it."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import internal
from phasmid.control.foothold_region import is_reached, region_share
from phasmid.control.foothold_search import (
    end_search,
    is_returning,
    is_searching,
    set_search,
    start_search,
)
from phasmid.control.gait_scheduler import lift_off
from phasmid.control.reference_governor import is_foothold
from phasmid.control.swing import advance_quintic, raise_foot, stop_foot
from phasmid.control.trunk import approach, integrate_twist
from phasmid.control.types import (
    Contact,
    LegPhase,
    Manoeuvre,
    Model,
    Parameters,
    Reference,
    SearchStage,
    State,
)

STOPS = 0.08
"""For as long the body goes on at its speed that is to come to rest [s]."""

POSED = 1e-3
"""A pose farther than this from the usual one takes of the legs' reach [m, rad]."""

TRIES, NEARER = 4, 0.012
"""How often the neutral place of a foot is moved towards the body, and how far each time [m], where
a pose has it out of reach."""

FROZEN = 0.7
"""Part of the swing from which on its landing place stays."""

SETTLE = 0.012
"""Time in which a foot that has met the ground comes to rest [s]."""

PRESS = 0.08
"""Time in which it then takes on its load, where the legs give way [s]."""

PRESSED = 5e-4
"""Sag for which that is worth it [m]."""

FOLD = 0.8
"""Time in which a leg folds [s]."""

BACK, BACK_RISE, BACK_TIME = 0.01, 0.01, 0.16
"""How far a foot draws back from an obstacle, how far up [m], and in what time [s]."""

LOST_AFTER, LEAST_DEPTH = 0.08, 0.01
"""Time without contact after which a stance foot is lowered to the ground [s], if it reaches at
least so far down [m]."""


@internal
def choose_landing(
    state: State, model: Model, reference: Reference, parameters: Parameters, leg: int, left: float
) -> None:
    """Write where a foot shall land: amid its next stance it is neutral, if the body goes on so."""
    mean, then, goal, ways = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    v, there, kept, rest = state.velocity_filter[2].copy(), ways[0], ways[1], ways[2]
    for i in range(3):
        goal[i] = state.clock.velocity_share * reference.velocity[i]
        if is_returning(state, leg):
            # So does the body.
            goal[i] = state.velocity_filter[0, i]
    approach(v, goal, 0, model.radius, parameters.acceleration * left)
    for i in range(3):
        mean[i] = (v[i] + state.velocity_filter[2, i]) / 2
    integrate_twist(state.path, mean, left, there)
    # That the walk may become faster until then is not certain.
    integrate_twist(state.path, state.velocity_filter[2], left, kept)
    # Nor that it goes on at all: in its usual pose a robot has that room within its limits.
    poses = np.abs(state.pose_filter[0]).max() > POSED or np.abs(state.pose_filter[3]).max() > POSED
    if poses:
        integrate_twist(state.path, state.velocity_filter[2], min(left, STOPS), rest)
    else:
        ways = ways[:2]
    integrate_twist(there, v, reference.duty_factor * reference.period / 2, then)
    nx, ny = model.neutral[leg, 0], model.neutral[leg, 1]
    c, s = math.cos(then[2]), math.sin(then[2])
    x, y = then[0] + c * nx - s * ny - there[0], then[1] + s * nx + c * ny - there[1]
    c, s = math.cos(there[2]), math.sin(there[2])
    dx, dy = c * x + s * y - nx, c * y - s * x - ny
    if is_searching(state, leg):
        x, y = state.search_goal[leg, 0] - there[0], state.search_goal[leg, 1] - there[1]
        dx, dy = c * x + s * y - nx, c * y - s * x - ny
    share, g, z = (
        region_share(state.region[leg], dx, dy, 0.0),
        state.ground_filter[3],
        reference.touchdown_height[leg],
    )
    c, s = math.cos(there[2]), math.sin(there[2])
    flat = not math.isfinite(z)
    # From the neutral place towards the body, where it will be.
    inward_x = state.pose_filter[0, 0] + state.sway_filter[3, 0] - nx
    inward_y = state.pose_filter[0, 1] + state.sway_filter[3, 1] - ny
    size = max(math.sqrt(inward_x * inward_x + inward_y * inward_y), 1e-6)
    for attempt in range(4 + TRIES + 1):
        # The region is round about what is reached; near its corners it is asked for itself.
        nearer = NEARER * (attempt - 3) / size if 4 <= attempt < 4 + TRIES else 0.0
        px, py = nx + share * dx + nearer * inward_x, ny + share * dy + nearer * inward_y
        x, y = there[0] + c * px - s * py, there[1] + s * px + c * py
        if flat:
            z = g[0] + g[1] * x + g[2] * y
        if is_foothold(state, model, leg, ways, x, y, z):
            break
        share *= 0.5 if attempt < 2 else 0.0
    state.touchdown[leg, 0], state.touchdown[leg, 1], state.touchdown[leg, 2] = x, y, z


@internal
def above(state: State, leg: int) -> float:
    """How far a foot is over the ground that is believed [m]."""
    g, foot = state.ground_filter[3], state.foot[leg]
    return float(foot[2] - (g[0] + g[1] * foot[0] + g[2] * foot[1]))


@internal
def probe_down(state: State, model: Model, parameters: Parameters, leg: int, depth: float) -> None:
    """Let a foot at rest go straight down, by a depth or as far as its leg reaches [m]."""
    foot = state.foot[leg]
    for _ in range(4):
        if is_reached(state, model, leg, foot[0], foot[1], foot[2] - depth):
            break
        depth *= 0.7
    else:
        depth = 0.0
    state.touchdown[leg, 2] = foot[2] - depth
    state.time_without_contact[leg] = 0.0
    state.swing_elapsed[leg], state.swing_height[leg] = 0.0, 0.0
    state.swing_duration[leg] = max(1.875 * depth / parameters.landing_speed, 0.05)


@internal
def land_here(
    state: State, model: Model, reference: Reference, parameters: Parameters, leg: int
) -> None:
    """Let a foot go straight down from rest, and beyond the ground where it feels for it."""
    stop_foot(state, leg)
    state.leg_phase[leg] = LegPhase.PROBING
    # What has stopped it here would stop it on its way elsewhere.
    set_search(state, leg, SearchStage.LAND_HERE)
    depth = above(state, leg)
    if reference.contact[leg] >= 0:
        depth += parameters.landing_depth
    probe_down(state, model, parameters, leg, max(depth, 0.0))


@internal
def end_swing(
    state: State, model: Model, reference: Reference, parameters: Parameters, leg: int
) -> None:
    """Let a foot stand at the end of its curve, or go on down where it feels no ground."""
    for i in range(3):
        state.foot[leg, i] = state.touchdown[leg, i]
    if (
        state.leg_phase[leg] == LegPhase.SWING
        and reference.contact[leg] == 0
        and parameters.landing_depth > 0
    ):
        stop_foot(state, leg)
        state.leg_phase[leg] = LegPhase.PROBING
        # Where it has met obstacles it lands above the ground that is believed.
        probe_down(
            state, model, parameters, leg, max(above(state, leg), 0.0) + parameters.landing_depth
        )
        return
    missed = (
        state.leg_phase[leg] == LegPhase.PROBING
        and reference.contact[leg] == 0
        and reference.used[leg] == 1
    )
    if missed and state.search_stage[leg] < SearchStage.RETURNED:
        if start_search(state, reference, leg):
            return
        set_search(state, leg, SearchStage.GAVE_UP)
    settled = state.leg_phase[leg] == LegPhase.SETTLING
    end_search(state, leg, settled)
    stop_foot(state, leg)
    state.leg_phase[leg] = LegPhase.STANCE
    end_of_swing(state, leg)
    if settled and reference.foot_sag[leg] > PRESSED:
        # Body and leg give way, so that it has met the ground above where it is told to be; it goes
        # on there, and so takes its part of the load.
        press(state, leg, reference.foot_sag[leg])


@internal
def end_of_swing(state: State, leg: int) -> None:
    """Clear the times and the height of a foot's swing."""
    state.swing_elapsed[leg] = state.swing_duration[leg] = 0.0
    state.swing_height[leg] = state.time_without_contact[leg] = 0.0


@internal
def press(state: State, leg: int, depth: float) -> None:
    """Let a standing foot go down."""
    state.touchdown[leg, 2] = state.foot[leg, 2] - depth
    state.swing_elapsed[leg], state.swing_duration[leg], state.swing_height[leg] = 0.0, PRESS, 0.0


@internal
def draw_back(state: State, leg: int) -> None:
    """Let a swinging foot go back and up from what it has met, with the motion that it has."""
    foot, landing = state.foot[leg], state.touchdown[leg]
    dx, dy = foot[0] - landing[0], foot[1] - landing[1]
    size = max(math.sqrt(dx * dx + dy * dy), 1e-6)
    landing[0], landing[1] = foot[0] + BACK * dx / size, foot[1] + BACK * dy / size
    landing[2] = foot[2] + BACK_RISE
    state.manoeuvre[leg] = Manoeuvre.DRAW_BACK
    state.swing_elapsed[leg], state.swing_duration[leg], state.swing_height[leg] = (
        0.0,
        BACK_TIME,
        0.0,
    )
    for i in range(3):
        state.line_position[leg, i] = foot[i]
        state.line_velocity[leg, i] = state.foot_velocity[leg, i]
        state.line_acceleration[leg, i] = state.foot_acceleration[leg, i]


@internal
def stop_at_contact(state: State, leg: int) -> None:
    """Bring a foot to rest a little beyond its contact, without a jump of its velocity."""
    for i in range(3):
        state.line_position[leg, i] = state.foot[leg, i]
        state.line_velocity[leg, i] = state.foot_velocity[leg, i]
        state.line_acceleration[leg, i] = state.foot_acceleration[leg, i]
        state.touchdown[leg, i] = state.foot[leg, i] + 0.4 * SETTLE * state.foot_velocity[leg, i]
    state.swing_elapsed[leg], state.swing_duration[leg], state.swing_height[leg] = 0.0, SETTLE, 0.0
    state.manoeuvre[leg] = Manoeuvre.NONE


@internal
def has_lost_ground(
    state: State, model: Model, reference: Reference, parameters: Parameters, leg: int, h: float
) -> bool:
    """Return whether a stance foot has had no contact for `LOST_AFTER` and can be lowered."""
    if reference.contact[leg] != 0 or state.clock.gait_running == 0:
        state.time_without_contact[leg] = 0.0
        return False
    state.time_without_contact[leg] += h
    if state.time_without_contact[leg] < LOST_AFTER:
        return False
    foot = state.foot[leg]
    if above(state, leg) < -parameters.landing_depth:
        return False
    return bool(is_reached(state, model, leg, foot[0], foot[1], foot[2] - LEAST_DEPTH))


@internal
def move_feet(
    state: State, model: Model, reference: Reference, parameters: Parameters, h: float
) -> None:
    """Let the feet that are in the air go on."""
    for leg in range(state.leg_count):
        doing = state.leg_phase[leg]
        stands = (
            doing == LegPhase.STANCE
            and reference.contact[leg] != 0
            and state.search_stage[leg] != SearchStage.RETURNED
        )
        if doing == LegPhase.HELD or stands:
            set_search(state, leg, SearchStage.NONE)
        if doing == LegPhase.STANCE and state.swing_elapsed[leg] >= state.swing_duration[leg]:
            if not has_lost_ground(state, model, reference, parameters, leg, h):
                continue
            stop_foot(state, leg)
            probe_down(state, model, parameters, leg, above(state, leg) + parameters.landing_depth)
            state.manoeuvre[leg] = Manoeuvre.LOWER
        if doing == LegPhase.HELD:
            continue
        before = state.swing_elapsed[leg]
        state.swing_elapsed[leg] += h
        part = state.swing_elapsed[leg] / state.swing_duration[leg]
        if not reference.used[leg] and doing == LegPhase.SWING and 0.5 <= part < 0.9:
            state.leg_phase[leg] = LegPhase.HELD
            state.swing_elapsed[leg], state.swing_duration[leg] = 0.0, FOLD
            continue
        if reference.contact[leg] == Contact.OBSTACLE and doing == LegPhase.SWING:
            draw_back(state, leg)
            before, state.swing_elapsed[leg] = 0.0, h
        retreats = doing == LegPhase.SWING and state.manoeuvre[leg] != Manoeuvre.NONE
        if retreats and state.swing_elapsed[leg] >= state.swing_duration[leg] - 1e-9:
            # Then it steps over the obstacle, or elsewhere.
            ago = state.swing_elapsed[leg] - state.swing_duration[leg]
            time = (1.0 - reference.duty_factor) * reference.period
            lift_off(state, model, reference, leg, ago, time)
            before, retreats = ago - h, False
            part = ago / time
        lowered = doing == LegPhase.STANCE and state.manoeuvre[leg] == Manoeuvre.LOWER
        met = (
            reference.contact[leg] == 1
            and doing in (LegPhase.SWING, LegPhase.PROBING)
            and not retreats
        )
        # Without knowledge of its contact a stance foot goes no deeper.
        met = met or (lowered and (reference.contact[leg] != 0 or state.clock.gait_running == 0))
        if met and (doing != LegPhase.SWING or part > parameters.lowest_lift):
            stop_at_contact(state, leg)
            if not lowered:
                state.leg_phase[leg] = LegPhase.SETTLING
            before, state.swing_elapsed[leg] = 0.0, h
        elif doing == LegPhase.SWING and part < FROZEN and not retreats:
            choose_landing(
                state,
                model,
                reference,
                parameters,
                leg,
                state.swing_duration[leg] - state.swing_elapsed[leg],
            )
        if state.swing_elapsed[leg] > state.swing_duration[leg] - 1e-9:
            end_swing(state, model, reference, parameters, leg)
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
