"""The robot in physics, from a setting: advanced for as long as somebody looks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from phasmid.control import Command, LocomotionEngine, Player, SafetyFilter, Sequencer
from phasmid.control.sequences import Stage as Sequence
from phasmid.errors import InvalidGait
from phasmid.motion import Walk, plan
from phasmid.reporting.source import Source
from phasmid.simulation import DriveExperiment
from phasmid.simulation.closed_loop import ClosedLoopRun
from phasmid.simulation.drive import scenario_controller
from phasmid.simulation.loop import Samples
from phasmid.simulation.termination import Failure
from phasmid.studio.meter import Meter, Reading
from phasmid.studio.setting import Setting

UPDATE = 0.005
"""Time from one update of the controller to the next, or the whole number of time steps nearest
to it [s]."""

SPARE = 0.999
"""Of the largest velocity, so that round-off does not make it more than is possible."""

WORDS = {
    Sequence.LYING: "lies",
    Sequence.GETTING_UP: "gets up",
    Sequence.STANDING: "stands",
    Sequence.STOPPING: "stops",
    Sequence.LIFTING: "lifts a leg",
    Sequence.MANUAL_LEG: "moves a leg by hand",
    Sequence.GATHERING: "puts its feet in their places",
}
"""What a robot that does not walk is about."""

Recorder: TypeAlias = Callable[[np.ndarray, dict[str, np.ndarray]], None]
"""Takes times [s] and channels of consecutive samples."""


class LiveRobot:
    """A robot that is driven in the engine, without an end.

    Args:
        setting: What it is built of, and how it walks.

    Attributes:
        source: The machine and the experiment, as reports know them.
        run: The engine's run.
        driving: What it was made of.
        trouble: What ended it; None while it goes on.
        sample: What the engine told last.
        meter: What its walk costs.
        recorder: Takes all channels, while something records.

    Raises:
        InvalidInput: The robot cannot be driven, or the walk not be planned.
    """

    def __init__(self, setting: Setting) -> None:
        scenario, robot = setting.machine, setting.robot
        dt = scenario.simulation.dt
        rate = 1 / (max(1, round(UPDATE / dt)) * dt)
        self._engine: LocomotionEngine | None = None
        self._sequencer: Sequencer | None = None
        self.walk: Walk | None = None
        controller: Player | SafetyFilter
        if setting.walks == "the plan":
            self.walk = plan(scenario)
            controller = Player(self.walk, rate=rate)
        else:
            controller = scenario_controller(scenario, rate, ground_sensing=setting.ground_sensing)
            assert isinstance(controller.controller, Sequencer)
            self._sequencer = controller.controller
            assert isinstance(self._sequencer.walker, LocomotionEngine)
            self._engine = self._sequencer.walker
        self._controller = controller
        self._setting, self._lost = setting, frozenset[int]()
        self.command = Command()
        self.driving = DriveExperiment(
            scenario, controller, lambda *_: self.command, rate=rate, between=None
        )
        self.run: ClosedLoopRun = self.driving.begin_run(endless=True)
        weight = robot.mass * scenario.model.gravity
        self.source = Source(self.run.robot, scenario, setting.gait, weight)
        self.meter = Meter(weight)
        self.trouble: Failure | None = self.run.failure
        self.sample: Samples = self.run.first
        self.time = 0.0
        self.peak = np.abs(self.sample["torque"][0])
        self.recorder: Recorder | None = None
        self._largest: dict[Any, tuple[float, float, float]] = {}
        self._note(0.0)

    # What it is asked to do ----------------------------------------------------------------------

    @property
    def plays(self) -> bool:
        """Whether it plays a plan, and does nothing that it is asked."""
        return self._engine is None

    @property
    def ends_at(self) -> float:
        """Time at which its plan ends: one that fits uneven ground is as long as the scenario's."""
        walk = self.walk
        if walk is None or walk.scenario.planned_terrain().is_level:
            return math.inf
        return float(walk.time[-1])

    def follow(
        self,
        setting: Setting,
        share: tuple[float, float, float],
        lost: frozenset[int],
    ) -> None:
        """Walk as a setting says from now on.

        Args:
            setting: One that needs no other run.
            share: Ahead, to the left and turn to the left, each of the largest velocity so.
            lost: Numbers of the legs that are not used.

        Raises:
            InvalidInput: The robot cannot walk so at all; it goes on as it did.
        """
        if self._engine is None:
            self._setting = setting
            return
        command = Command(
            pose=setting.pose,
            gait=setting.gait,
            period=setting.scenario.stride.period,
            step_height=setting.scenario.stride.step_height,
            lost_legs=lost,
        )
        velocity = self._velocity(command, share)
        self._setting, self._lost = setting, lost
        self.command = replace(command, velocity=velocity)

    def _velocity(
        self, command: Command, share: tuple[float, float, float]
    ) -> tuple[float, float, float]:
        """A share of what is possible along each axis, within what is possible along them all."""
        wanted = [0.0, 0.0, 0.0]
        for axis, part in enumerate(share):
            # The first of the three is asked for in any case: it tells what cannot be walked.
            if part or axis == 0:
                unit = [0.0, 0.0, 0.0]
                unit[axis] = math.copysign(1.0, part)
                most = self._most(command, (unit[0], unit[1], unit[2]))
                wanted[axis] = abs(part) * most[axis]
        asked = (wanted[0], wanted[1], wanted[2])
        if sum(part != 0 for part in asked) < 2:
            return asked
        most = self._most(command, asked, kept=False)
        size, bound = math.hypot(*asked), SPARE * math.hypot(*most)
        return asked if size <= bound else tuple(part * bound / size for part in asked)  # type: ignore[return-value]

    def _most(
        self, command: Command, direction: tuple[float, float, float], *, kept: bool = True
    ) -> tuple[float, float, float]:
        """The largest velocity in a direction; remembered of the axes."""
        how = command.gait, command.period, command.step_height, command.pose
        key = (direction, *how, command.lost_legs)
        if key in self._largest:
            return self._largest[key]
        assert self._engine is not None
        try:
            limit = self._engine.largest_velocity(
                direction,
                gait=command.gait,
                period=command.period,
                step_height=command.step_height,
                pose=command.pose,
                lost_legs=command.lost_legs,
            )
            found = limit.velocity
        except InvalidGait:
            if not command.lost_legs:
                raise
            # The legs that are left do not carry it; the engine says so, and stands.
            found = (0.0, 0.0, 0.0)
        if kept:
            if len(self._largest) > 64:
                self._largest.clear()
            self._largest[key] = found
        return found

    # Time ----------------------------------------------------------------------------------------

    @property
    def period(self) -> float:
        """From one update of the controller to the next [s]."""
        return self.run.period_steps * self.run.dt

    @property
    def now(self) -> float:
        """Time of the robot since its start [s]."""
        return self.run.step * self.run.dt

    def advance(self, periods: int) -> None:
        """Let some updates pass; nothing moves any more once there is trouble.

        Args:
            periods: How many.
        """
        if self.trouble is not None:
            return
        run = self.run
        self._work = 0.0
        self.peak = np.zeros_like(self.peak)
        self.trouble = run.advance(until=run.step + periods * run.period_steps, keep=self._take)
        self._note(self._work)
        # What was asked and said before is told by now; memory is not to grow with the hours.
        run.command_changes.clear()

    def _take(self, rows: Samples) -> None:
        """Look at the samples of a block; they are recorded where something records."""
        run, interval = self.run, self.run.every * self.run.dt
        first = -(-run.step // run.every)
        if self.recorder is not None:
            time = np.arange(first, first + len(rows)) * interval
            self.recorder(time, run.channels(rows))
        power = self._power(rows).sum(axis=1)
        self._work += float(power.sum()) * interval
        self.peak = np.maximum(self.peak, np.abs(rows["torque"]).max(axis=0))
        self.sample = rows[-1:].copy()
        self.time = (first + len(rows) - 1) * interval

    def _power(self, rows: Samples) -> np.ndarray:
        """What servos of their own law draw from their supply, or what the joints give [W]."""
        told = self.run.drive.channels(rows["drive"])
        if "servo_duty" not in told:
            given: np.ndarray = np.maximum(rows["torque"] * rows["qvel"][:, 6:], 0.0)
            return given
        supply = self.source.scenario.servo.supply(self.source.robot.servo)
        drawn = np.maximum(supply * told["servo_duty"] * told["servo_current"], 0.0)
        return drawn.reshape(len(drawn), -1)

    def _note(self, work: float) -> None:
        x, y, _, w, i, j, k = self.sample["qpos"][0, :7].tolist()
        yaw = math.atan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))
        if math.isfinite(x + y + yaw):
            self.meter.note(self.now, (x, y, yaw), work)

    # What it tells -------------------------------------------------------------------------------

    @property
    def reading(self) -> Reading:
        """Speed, power and cost of the last cycle."""
        return self.meter.read(self._setting.scenario.stride.period)

    @property
    def setting(self) -> Setting:
        """What it walks by."""
        return self._setting

    @property
    def telemetry(self) -> dict[str, Any]:
        """What the controller tells of its last update."""
        return dict(self._controller.telemetry())

    @property
    def status(self) -> str:
        """What it is about, in words that follow "the robot"."""
        if self.trouble is not None:
            return self.trouble.ending.name.lower()
        if self._engine is None or self._sequencer is None:
            return "walks"
        stage = self._sequencer.stage
        if stage is not Sequence.STANDING:
            return WORDS[stage]
        if self._engine.is_lame:
            return "cannot walk"
        return "stands" if self._engine.is_standing else "walks"

    def take_events(self) -> list[tuple[float, str]]:
        """What the controller has said since it was asked last: times [s] and sentences."""
        if isinstance(self._controller, SafetyFilter):
            return self._controller.take_events()
        return []
