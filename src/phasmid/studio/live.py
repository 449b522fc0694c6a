"""Live robot: a setting in physics, advanced for as long as someone watches."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from phasmid.control import Command, LocomotionEngine, Player, SafetyFilter, Sequencer
from phasmid.control.sequences import Stage as Sequence
from phasmid.errors import InvalidGait
from phasmid.motion import Walk, plan
from phasmid.reporting.run import Source
from phasmid.simulation import new_drive
from phasmid.simulation.closed_loop import ClosedLoopRun
from phasmid.simulation.drive import scenario_controller
from phasmid.simulation.loop import Samples
from phasmid.simulation.termination import Failure
from phasmid.studio.setting import LOCOMOTION, Setting
from phasmid.studio.walk_metrics import Metrics, WalkMetrics

if TYPE_CHECKING:
    from phasmid.learning import PolicyController

UPDATE = 0.005
"""Control period, rounded to whole time steps [s]."""

MARGIN = 0.999
"""Share of the largest velocity that is used: round-off must not pass it."""

WORDS = {
    Sequence.LYING: "lies",
    Sequence.GETTING_UP: "gets up",
    Sequence.STANDING: "stands",
    Sequence.STOPPING: "stops",
    Sequence.LIFTING: "lifts a leg",
    Sequence.MANUAL_LEG: "moves a leg by hand",
    Sequence.GATHERING: "puts its feet in their places",
}
"""Activity of a robot that does not walk."""

Recorder: TypeAlias = Callable[[np.ndarray, dict[str, np.ndarray]], None]
"""Takes times [s] and channels of consecutive samples."""

Velocity: TypeAlias = tuple[float, float, float]
"""Forward, lateral [m/s], yaw [rad/s]; or shares of the largest."""


class LiveRobot:
    """Robot in simulation, without an end.

    Args:
        setting: Robot, ground and walk.

    Attributes:
        source: Robot and scenario, as reports use them.
        run: Run of the simulation.
        failure: Cause of its end; None while it goes on.
        sample: Last sample.
        peak: Largest joint torques since the last frame [N·m].
        recorder: Takes all channels, while something records.

    Raises:
        InvalidInput: The robot cannot be driven, or the walk cannot be planned.
    """

    def __init__(self, setting: Setting) -> None:
        scenario = setting.machine
        dt = scenario.simulation.dt
        rate = 1 / (max(1, round(UPDATE / dt)) * dt)
        self._engine: LocomotionEngine | None = None
        self._sequencer: Sequencer | None = None
        self.walk: Walk | None = None
        self._policy: PolicyController | None = None
        controller: Player | SafetyFilter | PolicyController
        if setting.walks == "the plan":
            self.walk = plan(scenario)
            controller = Player(self.walk, rate=rate)
        elif setting.controller != LOCOMOTION:
            # Lazy import: policies need the extra learn.
            from phasmid.learning import PolicyController

            self._policy = controller = PolicyController(setting.controller, scenario.load_robot())
        else:
            controller = scenario_controller(scenario, rate, ground_sensing=setting.ground_sensing)
            assert isinstance(controller.controller, Sequencer)
            self._sequencer = controller.controller
            assert isinstance(self._sequencer.walker, LocomotionEngine)
            self._engine = self._sequencer.walker
        self._controller = controller
        self.setting = setting
        self.command = Command()
        self.run: ClosedLoopRun = new_drive(
            scenario, controller, lambda *_: self.command, rate=rate, endless=True
        )
        self.source = Source(self.run.robot, scenario, setting.gait)
        self._metrics = WalkMetrics(self.source.weight)
        self.failure: Failure | None = self.run.failure
        self.sample: Samples = self.run.first
        self.time = 0.0
        self.peak = np.abs(self.sample["torque"][0])
        self.recorder: Recorder | None = None
        self._largest: dict[Any, Velocity] = {}
        self._add_metrics(0.0)

    # Commands ------------------------------------------------------------------------------------

    @property
    def plays(self) -> bool:
        """True if it plays a plan, and takes no commands."""
        return self.walk is not None

    @property
    def lifts_legs(self) -> bool:
        """True if it can walk without lost legs."""
        return self._engine is not None

    @property
    def ends_at(self) -> float:
        """End of its plan [s]; only a plan for uneven ground has one."""
        walk = self.walk
        if walk is None or walk.scenario.planned_terrain().is_level:
            return math.inf
        return float(walk.time[-1])

    def follow(self, setting: Setting, share: Velocity, lost: frozenset[int]) -> None:
        """Walk by a setting from now on.

        Args:
            setting: Setting that needs no new run.
            share: Shares of the largest velocity forward, lateral and in yaw.
            lost: Numbers of the legs out of use.

        Raises:
            InvalidInput: The robot cannot walk so; it goes on as before.
        """
        if self._engine is not None:
            command = Command(
                pose=setting.pose,
                gait=setting.gait,
                period=setting.scenario.stride.period,
                step_height=setting.scenario.stride.step_height,
                lost_legs=lost,
            )
            self.command = replace(command, velocity=self._velocity(command, share))
        elif self._policy is not None:
            largest = self._policy.largest_velocity
            self.command = Command(
                velocity=_triple([a * b for a, b in zip(share, largest, strict=True)])
            )
        self.setting = setting

    def _velocity(self, command: Command, share: Velocity) -> Velocity:
        """Scale the largest velocity along each axis, within the largest along their sum."""
        velocity = [0.0, 0.0, 0.0]
        for axis, part in enumerate(share):
            # The first axis is computed in any case: it refuses gaits that cannot be walked.
            if part or axis == 0:
                unit = [0.0, 0.0, 0.0]
                unit[axis] = math.copysign(1.0, part)
                velocity[axis] = abs(part) * self._largest_along(command, _triple(unit))[axis]
        if sum(part != 0 for part in velocity) > 1:
            largest = self._largest_velocity(command, _triple(velocity))
            scale = MARGIN * math.hypot(*largest) / math.hypot(*velocity)
            velocity = [part * min(scale, 1.0) for part in velocity]
        return _triple(velocity)

    def _largest_along(self, command: Command, axis: Velocity) -> Velocity:
        """Return the largest velocity along an axis, from a cache."""
        gait = command.gait, command.period, command.step_height, command.pose
        key = (axis, *gait, command.lost_legs)
        if key not in self._largest:
            if len(self._largest) > 64:
                self._largest.clear()
            self._largest[key] = self._largest_velocity(command, axis)
        return self._largest[key]

    def _largest_velocity(self, command: Command, direction: Velocity) -> Velocity:
        assert self._engine is not None
        try:
            return self._engine.largest_velocity(
                direction,
                gait=command.gait,
                period=command.period,
                step_height=command.step_height,
                pose=command.pose,
                lost_legs=command.lost_legs,
            ).velocity
        except InvalidGait:
            if not command.lost_legs:
                raise
            # The remaining legs do not carry it; the engine reports that, and stands.
            return (0.0, 0.0, 0.0)

    # Time ----------------------------------------------------------------------------------------

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.run.period_steps * self.run.dt

    @property
    def now(self) -> float:
        """Simulated time [s]."""
        return self.run.step * self.run.dt

    def advance(self, periods: int) -> None:
        """Advance by some control periods; a robot that failed does not move."""
        if self.failure is not None:
            return
        run = self.run
        self._work = 0.0
        self.peak = np.zeros_like(self.peak)
        self.failure = run.advance(until=run.step + periods * run.period_steps, keep=self._take)
        self._add_metrics(self._work)
        # Memory must not grow with the hours.
        run.command_changes.clear()

    def _take(self, rows: Samples) -> None:
        """Record a block of samples, and keep the last."""
        run, interval = self.run, self.run.every * self.run.dt
        first = -(-run.step // run.every)
        if self.recorder is not None:
            time = np.arange(first, first + len(rows)) * interval
            self.recorder(time, run.channels(rows))
        self._work += float(self._power(rows).sum()) * interval
        self.peak = np.maximum(self.peak, np.abs(rows["torque"]).max(axis=0))
        self.sample = rows[-1:].copy()
        self.time = (first + len(rows) - 1) * interval

    def _power(self, rows: Samples) -> np.ndarray:
        """Return electrical power of servos with their own law, else mechanical power [W]."""
        channels = self.run.drive.channels(rows["drive"])
        if "servo_duty" not in channels:
            mechanical: np.ndarray = np.maximum(rows["torque"] * rows["qvel"][:, 6:], 0.0)
            return mechanical
        supply = self.source.scenario.servo.supply(self.source.robot.servo)
        return np.maximum(supply * channels["servo_duty"] * channels["servo_current"], 0.0)

    def _add_metrics(self, work: float) -> None:
        x, y, _, w, i, j, k = self.sample["qpos"][0, :7].tolist()
        yaw = math.atan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))
        if math.isfinite(x + y + yaw):
            self._metrics.add(self.now, (x, y, yaw), work)

    # Readings ------------------------------------------------------------------------------------

    @property
    def metrics(self) -> Metrics:
        """Speed, power and cost of transport of the last cycle."""
        return self._metrics.mean(self.setting.scenario.stride.period)

    @property
    def telemetry(self) -> dict[str, Any]:
        """Telemetry of the controller's last update."""
        return dict(self._controller.telemetry())

    @property
    def status(self) -> str:
        """Present activity, in words that follow "the robot"."""
        if self.failure is not None:
            return self.failure.ending.name.lower()
        if self._policy is not None:
            return "walks" if any(self.command.velocity) else "stands"
        if self._engine is None or self._sequencer is None:
            return "walks"
        stage = self._sequencer.stage
        if stage is not Sequence.STANDING:
            return WORDS[stage]
        if self._engine.is_lame:
            return "cannot walk"
        return "stands" if self._engine.is_standing else "walks"

    def take_events(self) -> list[tuple[float, str]]:
        """Return the controller's new events: times [s] and sentences."""
        if isinstance(self._controller, Player):
            return []
        return self._controller.take_events()


def _triple(values: list[float]) -> Velocity:
    forward, lateral, yaw = values
    return forward, lateral, yaw
