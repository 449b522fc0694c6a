"""Updates of a driven run of which nothing is to be said, made at once.

Nearly all updates of a walk are alike: sensors, safety, sequences and engine find nothing new, and
what takes the time is Python between them. Here such updates are made one after the other, with the
engine's steps, in one call of machine code. An update in which anything is out of the usual is
undone and left to Python, which makes it anew: what is found, said and decided stays in one place,
and the bits are those of Python's own updates.

Importing this module needs numba.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, TypeGuard, TypeVar

import numpy as np

from phasmid.compiled import is_kept
from phasmid.control import (
    Command,
    Guard,
    JointTargets,
    LocomotionEngine,
    SafeController,
    Sequencer,
)
from phasmid.control.dynamics.effort import FeedForward
from phasmid.control.dynamics.stage import DynamicsStage, weigh
from phasmid.control.feel.stage import FeelStage, feel_order
from phasmid.control.remarks import goings_on
from phasmid.control.step import tick
from phasmid.simulation.calling import address, address_of
from phasmid.simulation.hold import Hold
from phasmid.simulation.uneventful_loop import (
    ANEW,
    CODE,
    DEMAND,
    FAILED,
    FOUND,
    NEEDED,
    NOT_FOUND,
    NUMBERS,
    USUAL,
    WEIGHED,
    Parts,
    make_updates,
)
from phasmid.simulation.unlocked import UnlockedLoop

if TYPE_CHECKING:
    from phasmid.simulation.driven import DrivenRun

Kind = TypeVar("Kind")

WAIT = 3
"""Where no update could be made, Python makes so many more before the next try."""

STANCE, TELEMETRY = "stance", ("velocity_reference", "slow_down", "support_margin", "gait_phase")
"""Channels that each of these updates tells anew."""

STAYING = {"velocity_command", "sequence", "safety_mode"}
"""Those that stay as Python's last update has told them."""


def is_ours(thing: object, kind: type[Kind]) -> TypeGuard[Kind]:
    """Whether something is of a class itself, and nobody has given it methods of its own."""
    return type(thing) is kind and not any(hasattr(kind, name) for name in vars(thing))


class Uneventful:
    """Makes updates of a driven run for as long as nothing happens.

    Args:
        run: The run.

    Raises:
        OSError: Its controller, its drive or its loop of steps is not one of which these updates
            are known.
    """

    def __init__(self, run: DrivenRun) -> None:
        if not is_kept(make_updates) and run.is_short:
            raise OSError("to compile it takes longer than it saves")
        controller, steps, law = run.controller, run.unlocked, run.drive.law(run.dt)
        self._safe: SafeController | None = None
        self._sequencer: Sequencer | None = None
        engine = controller
        if isinstance(controller, SafeController) and isinstance(controller.controller, Sequencer):
            self._safe, self._sequencer = controller, controller.controller
            engine = self._sequencer.walker
        if not (isinstance(engine, LocomotionEngine) and isinstance(steps, UnlockedLoop)):
            raise OSError("something else walks, or steps")
        if engine.feel is None or engine.dynamics is None:
            raise OSError("a stage is missing")
        if law is None:
            raise OSError("a drive of which no law is known")
        if not {STANCE, *TELEMETRY} <= run.told_now.keys() <= {STANCE, *TELEMETRY, *STAYING}:
            raise OSError("other telemetry")
        self._run, self._engine, self._steps, self._law = run, engine, steps, law
        self._feel, self._dynamics = engine.feel, engine.dynamics
        self._parts: Parts | None = None
        self._wait = 0

    def is_steady(self, command: Command) -> bool:
        """Whether the next update will be like the last, if nothing happens.

        Args:
            command: What the robot was told in the last update, and is told in the next.
        """
        if self._wait > 0:
            self._wait -= 1
            return False
        safe, sequencer = self._safe, self._sequencer
        if safe and sequencer and not (safe.is_steady(command) and sequencer.is_steady(command)):
            return False
        return self._engine.is_steady(command)

    def prepare(self) -> None:
        """Gather what the machine code works on, as it is now; the stages' own is there by now.

        Raises:
            OSError: A stage's own cannot be found, or somebody has put another part in.
            Exception: The compiler works in another way, or cannot do it.
        """
        if not all(is_ours(part, kind) for part, kind in self._who()):
            raise OSError("a part of somebody's own")
        known = self._parts
        parts = self._gathered(self._places() if known is None else known.places)
        if known is None:
            # The compiler does its work here, before anything is changed.
            make_updates(0, 0, 0, ANEW, goings_on_in(self._engine), parts)
        self._parts = parts

    def advance(self, at: int, most: int) -> int:
        """Make updates and their steps, as many as there are of which nothing is to be said.

        Args:
            at: The buffer's row of the first step, not the first row.
            most: How many updates at most.

        Returns:
            How many steps were made.
        """
        run, engine, parts = self._run, self._engine, self._parts
        assert parts is not None
        known, begin, end, made = goings_on_in(engine), ANEW, WEIGHED, 0
        while end == WEIGHED:
            gone = made * run.period_steps
            more, end = make_updates(most - made, run.now + gone, at + gone, begin, known, parts)
            made += more
            if end == WEIGHED:
                begin = FOUND if self._finds_forces() else NOT_FOUND
        if made == 0:
            self._wait = WAIT
            return 0
        time, since, share, had, friction, demand = parts.scalars.tolist()
        engine.catch_up(share, had, friction, demand)
        if self._safe and self._sequencer:
            targets = JointTargets(*parts.last)
            q = self._feel.senses.joint_position.copy()
            self._safe.guard.catch_up(time, since, q)
            self._safe.catch_up(time, targets)
            self._sequencer.catch_up(time, targets)
        first = at // run.period_steps
        for name in run.told_now.keys() & STAYING:
            told = run.told_now[name]
            told[first : first + made] = told[first - 1]
        if end == USUAL:
            return made * run.period_steps
        block = self._steps.made(failed=end == FAILED)
        run.note(block)
        return (made - 1) * run.period_steps + block.steps

    def _finds_forces(self) -> bool:
        """Whether forces within the limits are found for all of the motion of an update."""
        assert self._parts is not None
        numbers = self._parts.scalars
        friction, demand = numbers[NEEDED : DEMAND + 1].tolist()
        effort = self._dynamics.answer(self._engine.memory, 0.0, friction, demand)
        numbers[NEEDED], numbers[DEMAND] = effort.friction, effort.demand
        return effort.part == 1.0 and not effort.remark

    def _who(self) -> Iterable[tuple[object, type]]:
        """All whose work is done by the machine code, and what they have to be."""
        if self._safe and self._sequencer:
            yield self._safe, SafeController
            yield self._safe.guard, Guard
            yield self._sequencer, Sequencer
        yield self._engine, LocomotionEngine
        yield self._feel, FeelStage
        yield self._dynamics, DynamicsStage
        yield self._dynamics.feed, FeedForward
        yield self._steps, UnlockedLoop
        yield self._run.hold, Hold
        yield self._run.drive, type(self._run.drive)

    def _places(self) -> np.ndarray:
        """Where functions and tables are.

        Raises:
            OSError: A stage has not been compiled.
        """
        memory, dynamics, feed = self._engine.memory, self._dynamics, self._dynamics.feed
        rows = memory.numbers, memory.codes, memory.legs
        takes = dynamics.times, dynamics.own, feed.masses, feed.numbers, feed.work
        return np.array(
            [
                address_of(feel_order, CODE, *rows, *self._feel.rows),
                address_of(tick, CODE, *rows, self._engine.settings.update_period),
                address_of(weigh, NUMBERS, *rows, *takes),
                address("mjb_apply"),
                address("mju_rotVecQuat"),
                *self._steps.given,
            ]
        )

    def _gathered(self, places: np.ndarray) -> Parts:
        """What the machine code works on, as it is now.

        Args:
            places: Where functions and tables are.
        """
        run, safe, engine, dynamics = self._run, self._safe, self._engine, self._dynamics
        memory, feed, hold, data = engine.memory, dynamics.feed, run.hold, run.data
        felt, felt_codes, tuning = self._feel.rows
        law, law_numbers, law_memory = self._law
        last, since = np.zeros((3, memory.legs, 3)), (-math.inf, 0.0)
        if safe is None:
            # Without a guard nothing is too much.
            watched, loads, heating = [math.inf] * 6, np.zeros((3, memory.legs, 3)), np.zeros(4)
            limits = np.stack([loads[0] - math.inf, loads[0] + math.inf])
        else:
            guard, set_ = safe.guard, safe.guard.settings
            tilt = set_.tilt_share * guard.tip_angle
            watched = [set_.observation_time, tilt, guard.tip_time, set_.load_time]
            watched += [guard.hot, safe.speed]
            loads, heating, limits = guard.loads, guard.heating, safe.limits
            since = guard.time, guard.since
            assert safe.last is not None
            last[:] = safe.last.position, safe.last.velocity, safe.last.torque
        constants = [
            *watched,
            feed.friction,
            run.scenario.model.gravity,
            run.robot.servo.stall_torque,
            engine.settings.update_period,
            run.dt,
        ]
        scalars = np.array([*since, dynamics.velocity_share, engine.had, 0.0, 0.0])
        state, orders = engine.state, (memory.order.velocity, memory.wanted.velocity)
        changed = memory.numbers, felt, dynamics.own, feed.work, loads, scalars
        kept, kept_codes = self._room(changed, (memory.codes, felt_codes))
        joints, wanted, told = 3 * memory.legs, run.wanted, run.told_now
        return Parts(
            places=places,
            numbers=memory.numbers,
            codes=memory.codes,
            felt=felt,
            felt_codes=felt_codes,
            shares=dynamics.own,
            work=feed.work,
            last=last,
            loads=loads,
            scalars=scalars,
            law_memory=law_memory,
            ends=hold.ends,
            tuning=tuning,
            times=dynamics.times,
            masses=feed.masses,
            servo=feed.numbers,
            views=(state.clock, state.mode, state.leg, state.speed, state.q, *orders, feed.torque),
            told=tuple(self._feel.senses[:7]),
            is_guarded=safe is not None,
            admitted=engine.admitted,
            limits=limits,
            heating=heating,
            constants=np.array(constants),
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
            stance=told[STANCE],
            telemetry=tuple(told[name] for name in TELEMETRY),
            table=self._steps.table,
            kept=kept,
            kept_codes=kept_codes,
        )

    def _room(self, changed: Any, codes: Any) -> tuple[tuple[np.ndarray, ...], ...]:
        """Rows for what an update changes, the same at each call."""
        if self._parts is not None:
            return self._parts.kept, self._parts.kept_codes
        return tuple(np.empty(row.size) for row in changed), tuple(map(np.empty_like, codes))


def goings_on_in(engine: LocomotionEngine) -> tuple[bool, bool, int, bool]:
    """What an engine is about; see `goings_on`."""
    return goings_on(engine.state.clock, engine.state.mode)
