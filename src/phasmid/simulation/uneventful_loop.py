"""Updates of a driven run of which nothing is to be said, as a loop of machine code.

Importing this module needs numba.
"""

from __future__ import annotations

import math
from importlib import import_module
from inspect import unwrap
from typing import Any, NamedTuple

import numpy as np

from phasmid.compiled import compiled, heed_sources, inlined, internal, is_kept
from phasmid.control.dynamics.effort import MISSING
from phasmid.control.dynamics.servo_goal import SLOW, fill_goals
from phasmid.control.dynamics.stage import FASTER
from phasmid.control.loads import HEAT_STEP, add_loads
from phasmid.control.remarks import goings_on
from phasmid.control.safe import faulty
from phasmid.control.safety import look
from phasmid.control.state import STANCE
from phasmid.simulation.calling import call_engine, call_turn, calling
from phasmid.simulation.hold import fill_setpoints
from phasmid.simulation.joint_drive import PRESCRIBED, SERVO
from phasmid.simulation.servo import FIELDS, RUNNING
from phasmid.simulation.unlocked import AT, COUNT, END, LOST, MADE

numba: Any = import_module("numba")

CODE, NUMBERS = numba.int64, numba.types.UniTuple(numba.float64, 3)
"""What the locomotion engine's stages return: `feel_order` and `tick`, and `weigh`."""

FEEL, TICK, WEIGH, APPLY, TURN, BATCH, STEPS, TABLE = range(8)
"""Places in memory: of the engine's stages, of functions of the physics engine, and of a batch of
its own, of the loop of steps, and of that loop's table."""

TIME, SINCE, SHARE, HAD, NEEDED, DEMAND = range(6)
"""Numbers that updates change: time of the last [s], how long the servos' loads have been added up
[s], the part of the velocity that can be had, the part that is in the order, the friction that the
feet's forces need, and the largest torque as a part of what its servo gives."""

GAP, TILT, TIP, LONGEST, HOT, FASTEST, FRICTION, GRAVITY, STALL, PERIOD, STEP = range(11)
"""Numbers that stay: the time without an observation [s] and the tilt [rad] of which safety speaks,
the time to tip [s], how long a servo may give nearly all that it can [s], the temperature that is
too high [°C], the largest speed of targets [rad/s], the friction that may be used, gravity [m/s²],
a servo's torque [N·m], the time from one update to the next and a time step [s]."""

USUAL, TROUBLE, FAILED, WEIGHED, UNUSUAL = range(5)
"""How updates end: with the last wanted, or one out of the usual that is undone; with trouble in
the last's steps; with a failure of the physics engine in them; in the midst of one, whose forces
have to be found within their limits. The last is what an update is that is undone."""

ANEW, FOUND, NOT_FOUND = range(3)
"""How they begin: anew, or in the midst of such an update for which forces were found, or not."""

DUTY, SHUTDOWN = FIELDS.index("duty"), FIELDS.index("shutdown")


class Parts(NamedTuple):
    """All that updates are made of; L legs, J joints, U updates of n steps in a block.

    Attributes:
        places: Of functions and tables, as named above, shape (8,).
        numbers: Of the locomotion engine's memory; changed, as all is up to `ends`; an update
            that is out of the usual has changed none of the last three.
        codes: The same.
        felt: Numbers of what it feels.
        felt_codes: The same.
        shares: What its stage of dynamics keeps.
        work: In which that stage finds forces.
        loads: Of the `Guard`, shape (3, L, 3).
        scalars: Numbers as named above, shape (6,).
        last: Angles, speeds and torques of the last targets, shape (3, L, 3).
        law_memory: What the drive's law remembers, shape (2, J).
        ends: Of the `Hold`, shape (4, J).
        tuning: How the ground is felt.
        times: As `weigh` takes them; so are the next two.
        masses: Of the robot.
        servo: Its numbers.
        views: In `numbers` and `codes`: clock, mode, legs, speed, joints, and the velocities of
            both orders; and the torques in `work`.
        told: In `felt`: what the sensors tell, the first seven of `Senses`.
        is_guarded: Whether there is a `SafeController` with its `Guard`.
        admitted: The velocity that is admitted, shape (3,).
        limits: Of the `SafeController`, shape (2, L, 3).
        heating: Of the `Guard`.
        constants: Numbers as named above, shape (11,).
        angles: The physics engine's, shape (7 + J,).
        speeds: The same, shape (6 + J,).
        sensors: The same.
        sampled: The buffer's rows of speeds and of torques.
        warnings: How often the engine has warned, by kind.
        servos: What drives with a memory remember, one row for each of `FIELDS`.
        weights: Of the `Hold`.
        law: The drive's, and its numbers.
        goals: Takes what the drive is told at each step, shape (n, J).
        wanted: Takes what joints shall do in each period, shape (U, 3, n, J).
        stance: Takes which feet stand at each update, shape (U, L).
        telemetry: Take each update's velocity, slow-down, support margin and phase.
        table: Of the loop of steps.
        kept: Rows for what an unusual update has changed, but for the codes.
        kept_codes: The same for the codes.
    """

    places: np.ndarray
    numbers: np.ndarray
    codes: np.ndarray
    felt: np.ndarray
    felt_codes: np.ndarray
    shares: np.ndarray
    work: np.ndarray
    loads: np.ndarray
    scalars: np.ndarray
    last: np.ndarray
    law_memory: np.ndarray
    ends: np.ndarray
    tuning: np.ndarray
    times: np.ndarray
    masses: np.ndarray
    servo: np.ndarray
    views: tuple[np.ndarray, ...]
    told: tuple[np.ndarray, ...]
    is_guarded: bool
    admitted: np.ndarray
    limits: np.ndarray
    heating: np.ndarray
    constants: np.ndarray
    angles: np.ndarray
    speeds: np.ndarray
    sensors: np.ndarray
    sampled: tuple[np.ndarray, np.ndarray]
    warnings: np.ndarray
    servos: np.ndarray
    weights: np.ndarray
    law: tuple[int, np.ndarray]
    goals: np.ndarray
    wanted: np.ndarray
    stance: np.ndarray
    telemetry: tuple[np.ndarray, ...]
    table: np.ndarray
    kept: tuple[np.ndarray, ...]
    kept_codes: tuple[np.ndarray, ...]


call_for_code, call_for_numbers = calling(CODE), calling(NUMBERS)
_fill_goals, _fill_setpoints = compiled(fill_goals), compiled(fill_setpoints)
_look, _add_loads, _faulty = compiled(look), compiled(add_loads), compiled(faulty)


@internal
def copy_all(given: Any, taken: Any) -> None:
    """Copy rows to others of the same lengths."""
    for k in range(len(given)):
        taken[k][:] = given[k]


@internal
def fill_law(
    law: int,
    rows: np.ndarray,
    torque: np.ndarray,
    numbers: np.ndarray,
    dt: float,
    memory: np.ndarray,
    goals: np.ndarray,
) -> None:
    """Write what the drives' `targets` return.

    Args:
        law: Of the drive.
        rows: Angles, speeds and accelerations at each step, shape (3, N, J).
        torque: Fed forward, shape (N, J).
        numbers: Of the drive.
        dt: Time step [s].
        memory: Of the drive, changed.
        goals: Written, shape (N, J).
    """
    if law == SERVO:
        _fill_goals(rows[0], rows[1], torque, numbers, dt, memory, goals)
        return
    a, b, c = numbers[0], numbers[1], numbers[2]
    for k in range(goals.shape[0]):
        for j in range(goals.shape[1]):
            speed = rows[1, k, j]
            if law == PRESCRIBED:
                goals[k, j] = rows[0, k, j] + (b * speed + c * rows[2, k, j]) / a
            else:
                turning = min(max(speed / SLOW, -1.0), 1.0)
                goals[k, j] = rows[0, k, j] + (torque[k, j] + b * speed + c * turning) / a


@inlined
def sense(p: Parts, row: int, time: float) -> bool:
    """Tell the locomotion engine what its senses tell, and look after safety.

    Args:
        p: What updates are made of.
        row: The buffer's of this time.
        time: Of the update [s].

    Returns:
        Whether all is as usual.
    """
    loads, scalars, constants, servos = p.loads, p.scalars, p.constants, p.servos
    positions, outputs, contacts, forces, orientation, spin, acceleration = p.told
    speeds, torques = p.sampled
    legs = loads.shape[1]
    q, qd = p.angles[7:].reshape(legs, 3), p.speeds[6:].reshape(legs, 3)
    rates, whole = p.speeds[3:6], p.angles[3:7]
    load, force, away = np.empty((legs, 3)), np.empty(3), np.empty(4)
    is_usual = True
    dt = time - scalars[TIME]
    for leg in range(legs):
        for i in range(3):
            if p.law[0] == SERVO:
                load[leg, i] = servos[DUTY, 3 * leg + i]
                is_usual = is_usual and servos[SHUTDOWN, 3 * leg + i] == RUNNING
            else:
                load[leg, i] = torques[row - 1, 3 * leg + i] / constants[STALL]
            loads[0, leg, i] += dt * load[leg, i] * load[leg, i]
            positions[leg, i] = q[leg, i]
            outputs[leg, i] = load[leg, i]
        contacts[leg] = 1.0 if p.sensors[4 * leg] > 0 else 0.0
        forces[leg] = p.sensors[4 * leg + 3]
    for i in range(3):
        spin[i] = rates[i]
        force[i] = (p.speeds[i] - speeds[row - 1, i]) / constants[STEP]
    force[2] += constants[GRAVITY]
    for i in range(4):
        orientation[i] = whole[i]
        away[i] = whole[i] if i == 0 else -whole[i]
    call_turn(p.places[TURN], acceleration.ctypes.data, force.ctypes.data, away.ctypes.data)
    scalars[TIME] = time
    if p.is_guarded:
        bad, tilt = _look(q, qd, load, whole, rates, constants[TIP])
        is_usual = is_usual and bad == 0 and tilt <= constants[TILT] and dt <= constants[GAP]
        scalars[SINCE] += dt
        if scalars[SINCE] >= HEAT_STEP:
            _add_loads(load, scalars[SINCE], loads, p.heating)
            scalars[SINCE] = 0.0
            is_loaded, is_hot = loads[1].max() > constants[LONGEST], loads[2].max() > constants[HOT]
            is_usual = is_usual and not (is_loaded or is_hot)
    return is_usual


@inlined
def move(p: Parts, time: float, known: tuple[bool, bool, int, bool]) -> int:
    """Let the locomotion engine go on, and find what its motion takes.

    Args:
        p: What updates are made of.
        time: Of the update [s].
        known: What the engine is about, by `goings_on`.

    Returns:
        `USUAL`; `WEIGHED` where the forces are not within their limits; else `UNUSUAL`.
    """
    numbers, codes, scalars, constants, places = (
        p.numbers,
        p.codes,
        p.scalars,
        p.constants,
        p.places,
    )
    clock, mode, _, _, _, ordered, wished, _ = p.views
    legs = p.loads.shape[1]
    if time > clock[1]:
        clock[1] = time
    rows = (numbers, codes, legs, p.felt, p.felt_codes, p.tuning)
    is_usual = call_for_code(places[FEEL], rows) == 0
    if scalars[SHARE] != scalars[HAD]:
        scalars[HAD] = scalars[SHARE]
        for i in range(3):
            ordered[i] = wished[i] = scalars[HAD] * p.admitted[i]
    if is_usual:
        code = call_for_code(places[TICK], (numbers, codes, legs, constants[PERIOD]))
        is_usual = code == 0 and goings_on(clock, mode) == known
    found = UNUSUAL
    if is_usual:
        given = (numbers, codes, legs, p.times, p.shares, p.masses, p.servo, p.work)
        missing, friction, demand = call_for_numbers(places[WEIGH], given)
        scalars[NEEDED], scalars[DEMAND] = friction, demand
        if missing <= MISSING:
            found = USUAL if friction <= constants[FRICTION] and demand <= 1.0 else WEIGHED
    return found


@inlined
def tell(p: Parts, update: int, position: np.ndarray, velocity: np.ndarray) -> None:
    """Tell the joints what to do, and a recording what is done.

    Args:
        p: What updates are made of.
        update: Index of the update in its block.
        position: What the joints shall have at its end [rad], shape (L, 3).
        velocity: The same [rad/s].
    """
    last, ends, wanted = p.last, p.ends, p.wanted[update]
    clock, _, doing, speed, _, _, _, torque = p.views
    speed_told, slow_told, margin_told, phase_told = p.telemetry
    legs = position.shape[0]
    fed = np.empty(p.goals.shape)
    for leg in range(legs):
        for i in range(3):
            j = 3 * leg + i
            last[0, leg, i], last[1, leg, i] = position[leg, i], velocity[leg, i]
            last[2, leg, i] = torque[leg, i]
            ends[0, j], ends[1, j] = ends[2, j], ends[3, j]
            ends[2, j], ends[3, j] = position[leg, i], velocity[leg, i]
            for k in range(len(fed)):
                fed[k, j] = torque[leg, i]
        p.stance[update, leg] = doing[leg] == STANCE
    _fill_setpoints(p.weights, ends, wanted)
    fill_law(p.law[0], wanted, fed, p.law[1], p.constants[STEP], p.law_memory, p.goals)
    slow = clock[3]
    for i in range(3):
        speed_told[update, i] = slow * speed[2, i]
    slow_told[update], margin_told[update] = slow, clock[5]
    phase_told[update] = clock[0]


@compiled
def make_updates(
    most: int, now: int, at: int, begin: int, known: tuple[bool, bool, int, bool], parts: Parts
) -> tuple[int, int]:
    """Make updates, and the steps after each, until one is out of the usual.

    Args:
        most: How many updates at most.
        now: Index of the first's time step.
        at: The buffer's row of that step, not the first row.
        begin: How, as named above.
        known: What the locomotion engine is about, by `goings_on`.
        parts: What they are made of.

    Returns:
        How many were made, and how they end, as named above.
    """
    p = parts
    constants, scalars, table, places = p.constants, p.scalars, p.table, p.places
    clock, _, _, _, motion, _, _, torque = p.views
    qpos, qvel, period, legs = p.angles, p.speeds, p.wanted.shape[2], p.stance.shape[1]
    position, velocity = p.last[0].copy(), np.empty((legs, 3))
    # The scalars come last: how they were is looked up there.
    changed = (
        p.numbers,
        p.felt,
        p.shares,
        p.work,
        p.loads.reshape(-1),
        scalars,
    )
    changed_codes = (p.codes, p.felt_codes)
    warned = p.warnings.sum()
    made = 0
    while made < most:
        row, update = at + made * period, (at + made * period) // period
        time = (now + made * period) * constants[STEP]
        is_usual = begin != NOT_FOUND
        if begin == ANEW:
            copy_all(changed, p.kept)
            copy_all(changed_codes, p.kept_codes)
            is_usual = sense(p, row, time)
            if is_usual:
                found = move(p, time, known)
                if found == WEIGHED:
                    return made, WEIGHED
                is_usual = found == USUAL
        begin = ANEW
        if is_usual:
            scalars[SHARE] = min(1.0, scalars[SHARE] + FASTER * constants[PERIOD])
            for leg in range(legs):
                for i in range(3):
                    position[leg, i] = motion[0, leg, i]
                    velocity[leg, i] = motion[1, leg, i]
                    if clock[3] != 1.0:
                        velocity[leg, i] *= clock[3]
            dt = time - p.kept[-1][TIME]
            farthest = constants[FASTEST] * dt if p.is_guarded else math.inf
            low, high = p.limits[0], p.limits[1]
            is_usual = _faulty(position, velocity, torque, p.last[0], low, high, farthest) == 0
            is_usual = is_usual and dt > 0.0
        if not is_usual:
            copy_all(p.kept, changed)
            copy_all(p.kept_codes, changed_codes)
            return made, USUAL
        tell(p, update, position, velocity)
        table[COUNT], table[END], table[AT], table[MADE], table[LOST] = period, -1, row, 0, 0
        failed = call_engine(places[APPLY], places[BATCH], places[STEPS], places[TABLE])
        made += 1
        total = 0.0
        for i in range(len(qpos)):
            total += qpos[i] * qpos[i]
        for i in range(len(qvel)):
            total += qvel[i] * qvel[i]
        lost = failed != 0 or table[LOST] != 0 or table[MADE] != period
        if lost or p.warnings.sum() != warned or not math.isfinite(total):
            return made, FAILED if failed != 0 else TROUBLE
    return made, USUAL


if is_kept(make_updates):
    # It holds what is written in that room, too.
    heed_sources(make_updates, unwrap(look))
