"""How feet travel at one update: where they land, how they meet the ground, how they search it."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import internal
from phasmid.control.clock import lift_off
from phasmid.control.elsewhere import (
    GAVE_UP,
    HERE,
    RETURNED,
    end_search,
    goes_back,
    is_looking,
    looks_elsewhere,
    set_search,
)
from phasmid.control.governor import is_landing
from phasmid.control.reach import is_reached, within
from phasmid.control.state import (
    HELD,
    LOWERED,
    OBSTACLE,
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
from phasmid.control.swing import plant, raise_foot, steer
from phasmid.control.trunk import approach, ride

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
    state: State, model: Model, order: Order, tuning: Tuning, leg: int, left: float
) -> None:
    """Write where a foot shall land: amid its next stance it is neutral, if the body goes on so."""
    mean, then, goal, ways = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    v, there, kept, rest = state.speed[2].copy(), ways[0], ways[1], ways[2]
    for i in range(3):
        goal[i] = state.clock.velocity_share * order.velocity[i]
        if goes_back(state, leg):
            # So does the body.
            goal[i] = state.speed[0, i]
    approach(v, goal, 0, model.radius, tuning.acceleration * left)
    for i in range(3):
        mean[i] = (v[i] + state.speed[2, i]) / 2
    ride(state.path, mean, left, there)
    # That the walk may become faster until then is not certain.
    ride(state.path, state.speed[2], left, kept)
    # Nor that it goes on at all: in its usual pose a robot has that room within its limits.
    poses = np.abs(state.pose[0]).max() > POSED or np.abs(state.pose[3]).max() > POSED
    if poses:
        ride(state.path, state.speed[2], min(left, STOPS), rest)
    else:
        ways = ways[:2]
    ride(there, v, order.gait[0] * order.gait[1] / 2, then)
    nx, ny = model.neutral[leg, 0], model.neutral[leg, 1]
    c, s = math.cos(then[2]), math.sin(then[2])
    x, y = then[0] + c * nx - s * ny - there[0], then[1] + s * nx + c * ny - there[1]
    c, s = math.cos(there[2]), math.sin(there[2])
    dx, dy = c * x + s * y - nx, c * y - s * x - ny
    if is_looking(state, leg):
        x, y = state.sought[0, leg, 0] - there[0], state.sought[0, leg, 1] - there[1]
        dx, dy = c * x + s * y - nx, c * y - s * x - ny
    share, g, z = within(state.region[leg], dx, dy, 0.0), state.ground[3], order.landing[leg]
    c, s = math.cos(there[2]), math.sin(there[2])
    flat = not math.isfinite(z)
    # From the neutral place towards the body, where it will be.
    inward_x = state.pose[0, 0] + state.sway[3, 0] - nx
    inward_y = state.pose[0, 1] + state.sway[3, 1] - ny
    size = max(math.sqrt(inward_x * inward_x + inward_y * inward_y), 1e-6)
    for attempt in range(4 + TRIES + 1):
        # The region is round about what is reached; near its corners it is asked for itself.
        nearer = NEARER * (attempt - 3) / size if 4 <= attempt < 4 + TRIES else 0.0
        px, py = nx + share * dx + nearer * inward_x, ny + share * dy + nearer * inward_y
        x, y = there[0] + c * px - s * py, there[1] + s * px + c * py
        if flat:
            z = g[0] + g[1] * x + g[2] * y
        if is_landing(state, model, leg, ways, x, y, z):
            break
        share *= 0.5 if attempt < 2 else 0.0
    state.landing[leg, 0], state.landing[leg, 1], state.landing[leg, 2] = x, y, z


@internal
def above(state: State, leg: int) -> float:
    """How far a foot is over the ground that is believed [m]."""
    g, foot = state.ground[3], state.foot[leg]
    return float(foot[2] - (g[0] + g[1] * foot[0] + g[2] * foot[1]))


@internal
def look_down(state: State, model: Model, tuning: Tuning, leg: int, depth: float) -> None:
    """Let a foot at rest go straight down, by a depth or as far as its leg reaches [m]."""
    foot = state.foot[leg]
    for _ in range(4):
        if is_reached(state, model, leg, foot[0], foot[1], foot[2] - depth):
            break
        depth *= 0.7
    else:
        depth = 0.0
    state.landing[leg, 2] = foot[2] - depth
    state.swing[leg, 0], state.swing[leg, 2] = 0.0, 0.0
    state.swing[leg, 1] = max(1.875 * depth / tuning.landing_speed, 0.05)


@internal
def land_here(state: State, model: Model, order: Order, tuning: Tuning, leg: int) -> None:
    """Let a foot go straight down from rest, and beyond the ground where it feels for it."""
    plant(state, leg)
    state.leg[leg] = PROBING
    # What has stopped it here would stop it on its way elsewhere.
    set_search(state, leg, HERE)
    depth = above(state, leg)
    if order.touch[leg] >= 0:
        depth += tuning.landing_depth
    look_down(state, model, tuning, leg, max(depth, 0.0))


@internal
def end_swing(state: State, model: Model, order: Order, tuning: Tuning, leg: int) -> None:
    """Let a foot stand at the end of its curve, or go on down where it feels no ground."""
    for i in range(3):
        state.foot[leg, i] = state.landing[leg, i]
    if state.leg[leg] == SWING and order.touch[leg] == 0 and tuning.landing_depth > 0:
        plant(state, leg)
        state.leg[leg] = PROBING
        # Where it has met obstacles it lands above the ground that is believed.
        look_down(state, model, tuning, leg, max(above(state, leg), 0.0) + tuning.landing_depth)
        return
    missed = state.leg[leg] == PROBING and order.touch[leg] == 0 and order.used[leg] == 1
    if missed and state.search[leg] < RETURNED:
        if looks_elsewhere(state, order, leg):
            return
        set_search(state, leg, GAVE_UP)
    settled = state.leg[leg] == SETTLING
    end_search(state, leg, settled)
    plant(state, leg)
    state.leg[leg] = STANCE
    state.swing[leg] = 0.0
    if settled and order.sag[leg] > PRESSED:
        # Body and leg give way, so that it has met the ground above where it is told to be; it goes
        # on there, and so takes its part of the load.
        press(state, leg, order.sag[leg])


@internal
def press(state: State, leg: int, depth: float) -> None:
    """Let a standing foot go down."""
    state.landing[leg, 2] = state.foot[leg, 2] - depth
    state.swing[leg, 0], state.swing[leg, 1], state.swing[leg, 2] = 0.0, PRESS, 0.0


@internal
def draw_back(state: State, leg: int) -> None:
    """Let a swinging foot go back and up from what it has met, with the motion that it has."""
    foot, landing = state.foot[leg], state.landing[leg]
    dx, dy = foot[0] - landing[0], foot[1] - landing[1]
    size = max(math.sqrt(dx * dx + dy * dy), 1e-6)
    landing[0], landing[1] = foot[0] + BACK * dx / size, foot[1] + BACK * dy / size
    landing[2] = foot[2] + BACK_RISE
    state.retreat[leg] = 1.0
    state.swing[leg, 0], state.swing[leg, 1], state.swing[leg, 2] = 0.0, BACK_TIME, 0.0
    for i in range(3):
        state.line[0, leg, i] = foot[i]
        for k in range(2):
            state.line[1 + k, leg, i] = state.motion[k, leg, i]


@internal
def stop_at_contact(state: State, leg: int) -> None:
    """Bring a foot to rest a little beyond its contact, without a jump of its velocity."""
    for i in range(3):
        state.line[0, leg, i] = state.foot[leg, i]
        state.line[1, leg, i] = state.motion[0, leg, i]
        state.line[2, leg, i] = state.motion[1, leg, i]
        state.landing[leg, i] = state.foot[leg, i] + 0.4 * SETTLE * state.motion[0, leg, i]
    state.swing[leg, 0], state.swing[leg, 1], state.swing[leg, 2] = 0.0, SETTLE, 0.0
    state.retreat[leg] = 0.0


@internal
def has_lost_ground(
    state: State, model: Model, order: Order, tuning: Tuning, leg: int, h: float
) -> bool:
    """Return whether a stance foot has had no contact for `LOST_AFTER` and can be lowered."""
    if order.touch[leg] != 0 or state.clock.mode == STILL:
        state.swing[leg, 2] = 0.0
        return False
    # In stance this element counts the time without contact.
    state.swing[leg, 2] += h
    if state.swing[leg, 2] < LOST_AFTER:
        return False
    foot = state.foot[leg]
    if above(state, leg) < -tuning.landing_depth:
        return False
    return bool(is_reached(state, model, leg, foot[0], foot[1], foot[2] - LEAST_DEPTH))


@internal
def move_feet(state: State, model: Model, order: Order, tuning: Tuning, h: float) -> None:
    """Let the feet that are in the air go on."""
    for leg in range(state.leg_count):
        doing = state.leg[leg]
        swing = state.swing[leg]
        stands = doing == STANCE and order.touch[leg] != 0 and state.search[leg] != RETURNED
        if doing == HELD or stands:
            set_search(state, leg, 0.0)
        if doing == STANCE and swing[0] >= swing[1]:
            if not has_lost_ground(state, model, order, tuning, leg, h):
                continue
            plant(state, leg)
            look_down(state, model, tuning, leg, above(state, leg) + tuning.landing_depth)
            state.retreat[leg] = LOWERED
        if doing == HELD:
            continue
        before = swing[0]
        swing[0] += h
        part = swing[0] / swing[1]
        if not order.used[leg] and doing == SWING and 0.5 <= part < 0.9:
            state.leg[leg] = HELD
            swing[0], swing[1] = 0.0, FOLD
            continue
        if order.touch[leg] == OBSTACLE and doing == SWING:
            draw_back(state, leg)
            before, swing[0] = 0.0, h
        retreats = doing == SWING and state.retreat[leg] != 0.0
        if retreats and swing[0] >= swing[1] - 1e-9:
            # Then it steps over the obstacle, or elsewhere.
            ago = swing[0] - swing[1]
            time = (1.0 - order.gait[0]) * order.gait[1]
            lift_off(state, model, order, leg, ago, time)
            before, retreats = ago - h, False
            part = ago / time
        lowered = doing == STANCE and state.retreat[leg] == LOWERED
        met = order.touch[leg] == 1 and doing in (SWING, PROBING) and not retreats
        # Without knowledge of its contact a stance foot goes no deeper.
        met = met or (lowered and (order.touch[leg] != 0 or state.clock.mode == STILL))
        if met and (doing != SWING or part > tuning.lowest_lift):
            stop_at_contact(state, leg)
            if not lowered:
                state.leg[leg] = SETTLING
            before, swing[0] = 0.0, h
        elif doing == SWING and part < FROZEN and not retreats:
            choose_landing(state, model, order, tuning, leg, swing[1] - swing[0])
        if swing[0] > swing[1] - 1e-9:
            end_swing(state, model, order, tuning, leg)
            continue
        steer(state.line, leg, state.landing[leg], swing[1] - before, swing[0] - before)
        raise_foot(state, leg)
