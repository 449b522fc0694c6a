"""Live robot: a setting in physics, advanced for as long as someone watches."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from phasmid.control import LocomotionEngine, Player, SafetyFilter, Sequencer
from phasmid.control.sequences import Stage as Sequence
from phasmid.control.types import LegUse
from phasmid.errors import InvalidGait
from phasmid.experiment import Command
from phasmid.experiment.ending import Failure
from phasmid.kinematics import quaternion_rotation
from phasmid.motion import plan
from phasmid.reporting.numbers import SHORTEST_DISTANCE
from phasmid.reporting.run import Source
from phasmid.simulation import new_drive
from phasmid.simulation.closed_loop import ClosedLoopRun
from phasmid.simulation.drive import scenario_controller
from phasmid.simulation.loop import Samples
from phasmid.studio.setting import LOCOMOTION, Setting

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
    Sequence.STARTING: "starts",
    Sequence.GATHERING: "puts its feet in their places",
}
"""Activity of a robot that does not walk."""

Recorder: TypeAlias = Callable[[np.ndarray, dict[str, np.ndarray]], None]
"""Takes times [s] and channels of consecutive samples."""

Velocity: TypeAlias = tuple[float, float, float]
"""Forward, lateral [m/s], yaw [rad/s]; or shares of the largest."""


class Metrics(NamedTuple):
    """Averages over the last cycle; NaN until they are known.

    Attributes:
        velocity: In the mean heading of the body: forward, lateral [m/s], yaw [rad/s].
        power: Electrical power of servos with their own law, else mechanical power of the joints,
            without recovery [W].
        cost_of_transport: Integral of that power over weight and distance.
    """

    velocity: Velocity = (math.nan,) * 3
    power: float = math.nan
    cost_of_transport: float = math.nan


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
        ends_at: End of its plan [s]; only a plan for uneven ground has one.

    Raises:
        InvalidInput: The robot cannot be driven, or the walk cannot be planned.
    """

    def __init__(self, setting: Setting) -> None:
        scenario = setting.scenario
        dt = scenario.simulation.time_step
        rate = 1 / (max(1, round(UPDATE / dt)) * dt)
        self._controller = self._controller_of(setting, rate)
        self.setting = setting
        self.command = Command()
        self.run: ClosedLoopRun = new_drive(
            scenario, self._controller, lambda *_: self.command, rate=rate, endless=True
        )
        self.source = Source(self.run.experiment, self.run.robot)
        self.failure: Failure | None = self.run.failure
        self.sample: Samples = self.run.first
        self.time = self._work = 0.0
        self.peak = np.abs(self.sample["torque"][0])
        self.recorder: Recorder | None = None
        self._marks: deque[np.ndarray] = deque()
        self._add_mark()

    def _controller_of(
        self, setting: Setting, rate: float
    ) -> Player | SafetyFilter | PolicyController:
        """Return the controller of a setting."""
        scenario = setting.scenario
        self.ends_at = math.inf
        self._engine: LocomotionEngine | None = None
        self._policy: PolicyController | None = None
        if setting.walks == "the plan":
            walk = plan(scenario)
            if not walk.experiment.world.planned_terrain.is_level:
                self.ends_at = float(walk.time[-1])
            return Player(walk, rate=rate)
        if setting.controller != LOCOMOTION:
            # Lazy import: policies need the extra learn.
            from phasmid.learning import PolicyController

            self._policy = PolicyController(
                setting.controller,
                setting.robot,
                update_period=1 / rate,
                gravity=scenario.model.gravity,
            )
            return self._policy
        controller = scenario_controller(scenario, rate, ground_sensing=setting.ground_sensing)
        assert isinstance(controller.controller, Sequencer)
        self._sequencer = controller.controller
        assert isinstance(self._sequencer.walker, LocomotionEngine)
        self._engine = self._sequencer.walker
        self._largest_velocity = lru_cache(64)(self._compute_largest_velocity)
        return controller

    # Commands ------------------------------------------------------------------------------------

    @property
    def plays(self) -> bool:
        """True if it plays a plan, and takes no commands."""
        return isinstance(self._controller, Player)

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
                period=setting.experiment.course.stride.period,
                step_height=setting.scenario.stride.step_height,
                lost_legs=lost,
            )
            self.command = replace(command, velocity=self._velocity(command, share))
        elif self._policy is not None:
            forward, lateral, yaw = np.multiply(share, self._policy.largest_velocity).tolist()
            self.command = Command(velocity=(forward, lateral, yaw))
        self.setting = setting

    def _velocity(self, command: Command, share: Velocity) -> Velocity:
        """Scale the largest velocity along each axis, within the largest along their sum."""
        velocity = np.zeros(3)
        for axis, part in enumerate(share):
            # The first axis is computed in any case: it refuses gaits that cannot be walked.
            if part or axis == 0:
                unit = np.where(np.arange(3) == axis, math.copysign(1.0, part), 0.0)
                velocity[axis] = abs(part) * self._largest(command, unit)[axis]
        if np.count_nonzero(velocity) > 1:
            largest = self._largest(command, velocity)
            scale = MARGIN * math.hypot(*largest) / math.hypot(*velocity)
            velocity = velocity * min(scale, 1.0)
        forward, lateral, yaw = velocity.tolist()
        return forward, lateral, yaw

    def _largest(self, command: Command, direction: np.ndarray) -> Velocity:
        parts = command.gait, command.period, command.step_height, command.pose, command.lost_legs
        return self._largest_velocity(tuple(direction.tolist()), *parts)

    def _compute_largest_velocity(
        self, direction: Velocity, gait: Any, period: Any, height: Any, pose: Any, lost: Any
    ) -> Velocity:
        assert self._engine is not None
        try:
            return self._engine.largest_velocity(
                direction, gait=gait, period=period, step_height=height, pose=pose, lost_legs=lost
            ).velocity
        except InvalidGait:
            if not lost:
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
        self.peak = np.zeros_like(self.peak)
        self.failure = run.advance(until=run.step + periods * run.period_steps, keep=self._take)
        self._add_mark()
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
        supply = self.source.robot.servo.voltage
        return np.maximum(supply * channels["servo_duty"] * channels["servo_current"], 0.0)

    def _add_mark(self) -> None:
        """Remember time, place, heading and work for the metrics of a cycle."""
        qpos = self.sample["qpos"][0, :7]
        if not np.isfinite(qpos).all():
            return
        forward = quaternion_rotation(qpos[3:])[:, 0]
        yaw = math.atan2(forward[1], forward[0])
        if self._marks:
            yaw += 2 * math.pi * round((self._marks[-1][3] - yaw) / (2 * math.pi))
        self._marks.append(np.array([self.now, *qpos[:2], yaw, self._work]))

    # Readings ------------------------------------------------------------------------------------

    @property
    def metrics(self) -> Metrics:
        """Speed, power and cost of transport of the last cycle."""
        marks, cycle = self._marks, self.setting.experiment.course.stride.period
        while len(marks) > 2 and marks[1][0] <= marks[-1][0] - cycle:
            marks.popleft()
        if len(marks) < 2 or marks[-1][0] <= marks[0][0]:
            return Metrics()
        span, dx, dy, turn, work = (marks[-1] - marks[0]).tolist()
        # The chord of a steady curve points along the mean heading.
        heading = (marks[0][3] + marks[-1][3]) / 2
        c, s = math.cos(heading), math.sin(heading)
        distance = math.hypot(dx, dy)
        cost = math.nan
        if distance >= SHORTEST_DISTANCE:
            cost = work / (self.source.weight * distance)
        velocity = ((c * dx + s * dy) / span, (c * dy - s * dx) / span, turn / span)
        return Metrics(velocity, work / span, cost)

    @property
    def telemetry(self) -> dict[str, Any]:
        """Telemetry of the controller's last update."""
        return dict(self._controller.telemetry())

    @property
    def needed(self) -> frozenset[int]:
        """Numbers of the lost legs that stay on the ground: without them the robot would fall."""
        use = np.atleast_1d(self.telemetry.get("leg_use", ()))
        return frozenset((np.flatnonzero(use == LegUse.NEEDED) + 1).tolist())

    @property
    def status(self) -> str:
        """Present activity, in words that follow "the robot"."""
        if self.failure is not None:
            return self.failure.ending.name.lower()
        if self._policy is not None:
            return "walks" if any(self.command.velocity) else "stands"
        if self._engine is None:
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
