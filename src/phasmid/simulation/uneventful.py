"""Updates of a driven run of which nothing is to be said, made at once.

Nearly all updates of a walk are alike: sensors, safety, sequences and engine find nothing new, and
what takes the time is Python between them. Here such updates are made one after the other, with the
engine's steps, in one call of machine code. An update in which anything is out of the usual is
undone and left to Python, which makes it anew: what is found, said and decided stays in one place,
and the bits are those of Python's own updates.

Importing this module needs numba.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeGuard, TypeVar

import numpy as np

from phasmid.control import (
    Command,
    JointTargets,
    LocomotionEngine,
    SafeController,
    Sequencer,
)
from phasmid.control.dynamics.stage import weigh
from phasmid.control.feel.stage import feel_order
from phasmid.control.remarks import PATIENT
from phasmid.control.state import STILL
from phasmid.control.step import tick
from phasmid.simulation.calling import address, address_of
from phasmid.simulation.uneventful_loop import CODE, NUMBERS, Parts, make_updates
from phasmid.simulation.unlocked import UnlockedLoop

if TYPE_CHECKING:
    from phasmid.simulation.driven import DrivenRun

Kind = TypeVar("Kind")

WAIT = 3
"""Where no update could be made, Python makes so many more before the next try."""

STANCE, TELEMETRY = "stance", ("velocity_reference", "slow_down", "support_margin", "gait_phase")
"""Channels that each of these updates tells anew."""

STAYING = ("velocity_command", "sequence", "safety_mode")
"""Those that stay as Python's last update has told them."""


def is_ours(thing: object, kind: type[Kind]) -> TypeGuard[Kind]:
    """Whether something is of a class itself, and nobody has given it methods of its own."""
    return type(thing) is kind and not vars(thing).keys() & vars(kind).keys()


class Uneventful:
    """Makes updates of a driven run for as long as nothing happens.

    Args:
        run: The run.

    Raises:
        OSError: Its controller, its drive or its loop of steps is not one of which these updates
            are known.
    """

    def __init__(self, run: DrivenRun) -> None:
        safe, steps, law = run.controller, run.unlocked, run.drive.law(run.dt)
        if not (is_ours(safe, SafeController) and is_ours(safe.controller, Sequencer)):
            raise OSError("a controller of somebody's own")
        engine = safe.controller.walker
        if not (is_ours(engine, LocomotionEngine) and is_ours(steps, UnlockedLoop)):
            raise OSError("something else walks, or steps")
        if engine.feel is None or engine.dynamics is None:
            raise OSError("a stage is missing")
        if law is None or not is_ours(run.drive, type(run.drive)):
            raise OSError("a drive of which no law is known")
        if run.told_now.keys() != {STANCE, *TELEMETRY, *STAYING}:
            raise OSError("other telemetry")
        self._run, self._safe, self._sequencer = run, safe, safe.controller
        self._engine, self._feel, self._dynamics = engine, engine.feel, engine.dynamics
        self._steps, self._law = steps, law
        self._parts: Parts | None = None
        self._wait = 0

    def advance(self, at: int, most: int, command: Command) -> int:
        """Make updates and their steps, as many as there are of which nothing is to be said.

        Args:
            at: The buffer's row of the first step, not the first row.
            most: How many updates at most.
            command: What the robot is told in all of them, and was told in the last.

        Returns:
            How many steps were made.
        """
        if self._wait > 0:
            self._wait -= 1
            return 0
        safe, engine, run = self._safe, self._engine, self._run
        steady = (part.is_steady(command) for part in (safe, self._sequencer, engine))
        if most < 1 or not all(steady):
            return 0
        if self._parts is None:
            # The stages' machine code is there from their first update on.
            self._parts = self._gathered()
            # The compiler does its work here, before anything is changed.
            make_updates(0, run.now, at, self._parts)
        guard, clock, mode = safe.guard, engine.state.clock, engine.state.mode
        last, scalars, known = self._parts.last, self._parts.scalars, self._parts.known
        assert safe.last is not None
        last[:] = safe.last.position, safe.last.velocity, safe.last.torque
        scalars[:] = guard.time, guard.since, self._dynamics.velocity_share, engine.had
        waits = clock[4] > PATIENT
        known[:] = waits, waits and mode[2] == 1, mode[3], mode[0] == STILL
        made, trouble, friction, demand = make_updates(most, run.now, at, self._parts)
        if made == 0:
            self._wait = WAIT
            return 0
        time, guard.since, share, had = scalars.tolist()
        targets = JointTargets(*last.copy())
        guard.catch_up(time, self._feel.senses.joint_position.copy())
        safe.catch_up(time, targets)
        self._sequencer.catch_up(time, targets)
        engine.catch_up(share, had, friction, demand)
        first = at // run.period_steps
        for name in STAYING:
            told = run.told_now[name]
            told[first : first + made] = told[first - 1]
        if not trouble:
            return made * run.period_steps
        block = self._steps.made(failed=trouble > 1)
        run.note(block)
        return (made - 1) * run.period_steps + block.steps

    def _gathered(self) -> Parts:
        """What the machine code works on.

        Raises:
            OSError: A stage's own cannot be found.
        """
        run, safe, guard, engine = self._run, self._safe, self._safe.guard, self._engine
        memory, feed, hold, data = engine.memory, self._dynamics.feed, run.hold, run.data
        felt, felt_codes, tuning = self._feel.rows
        rows = memory.numbers, memory.codes, memory.legs
        law, law_numbers, law_memory = self._law
        takes = self._dynamics.times, self._dynamics.own, feed.masses, feed.numbers, feed.work
        period, joints = engine.settings.update_period, 3 * memory.legs
        places = [
            address_of(feel_order, CODE, *rows, *self._feel.rows),
            address_of(tick, CODE, *rows, period),
            address_of(weigh, NUMBERS, *rows, *takes),
            address("mjb_apply"),
            address("mju_rotVecQuat"),
            *self._steps.given,
        ]
        constants = [
            guard.settings.tilt_share * guard.tip_angle,
            guard.tip_time,
            guard.settings.load_time,
            guard.hot,
            safe.speed,
            feed.friction,
            run.scenario.model.gravity,
            run.robot.servo.stall_torque,
            period,
            run.dt,
        ]
        state, orders = engine.state, (memory.order.velocity, memory.wanted.velocity)
        last, scalars = np.zeros((3, memory.legs, 3)), np.zeros(4)
        changed = (
            *(memory.numbers, felt, self._dynamics.own, feed.work),
            *(last, guard.loads, scalars, law_memory, hold.ends),
        )
        wanted = run.wanted
        return Parts(
            places=np.array(places),
            numbers=memory.numbers,
            codes=memory.codes,
            felt=felt,
            felt_codes=felt_codes,
            shares=self._dynamics.own,
            work=feed.work,
            last=last,
            loads=guard.loads,
            scalars=scalars,
            law_memory=law_memory,
            ends=hold.ends,
            tuning=tuning,
            times=self._dynamics.times,
            masses=feed.masses,
            servo=feed.numbers,
            views=(state.clock, state.mode, state.leg, state.speed, state.q, *orders, feed.torque),
            told=tuple(self._feel.senses[:7]),
            admitted=engine.admitted,
            limits=safe.limits,
            heating=guard.heating,
            constants=np.array(constants),
            known=np.zeros(4, dtype=np.int64),
            angles=data.qpos,
            speeds=data.qvel,
            sensors=data.sensordata,
            sampled=(run.buffer.qvel, run.buffer.torque),
            warnings=data.warning.number,
            servos=run.drive.state.reshape(-1, joints),
            weights=hold.weights,
            law=(law, law_numbers),
            goals=self._steps.targets[: run.period_steps],
            wanted=wanted.reshape(*wanted.shape[:3], joints),
            stance=run.told_now[STANCE],
            telemetry=tuple(run.told_now[name] for name in TELEMETRY),
            table=self._steps.table,
            kept=tuple(np.empty(row.size) for row in changed),
            kept_codes=(np.empty_like(memory.codes), np.empty_like(felt_codes)),
        )
