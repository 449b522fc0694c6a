"""Driver: a controller moves a robot on a servo bus in real time."""

from __future__ import annotations

import gc
import math
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from phasmid.control import CommandScript, SafetyFilter, Sequencer
from phasmid.control.safety import SafetySettings
from phasmid.control.sequences.sequencer import Stage as Sequence
from phasmid.control.sequences.stance import neutral_stance
from phasmid.control.waypoints import WaypointFollower, plane_pose
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, Controller, JointTargets, Observation, Posture
from phasmid.experiment.ending import Ending, Failure
from phasmid.hardware.bus import PortLost
from phasmid.hardware.drive_log import DriveLog, Watch
from phasmid.hardware.paced_targets import PacedTargets
from phasmid.hardware.protection import DriverSettings, Protection, Reaction
from phasmid.hardware.robot_bus import RobotBus
from phasmid.hardware.stages import (
    HOLD_WINDOW,
    LONGEST_RAMP,
    LONGEST_RISE,
    MOST_HOLDS,
    MOVING,
    STEADY_TIME,
    WALK_EXCESS,
    WALK_STRETCH,
    DriveReport,
    Stage,
)
from phasmid.hardware.torque_off import Guard, NoGuard, torque_off_after_exit
from phasmid.interrupts import handled_signals
from phasmid.recording.channels import CHANNELS, COMMANDED, OBSERVED
from phasmid.scenario import Scenario
from phasmid.servo.law import inverse_law
from phasmid.servo.law_kernels import goal_memory, goals_for_torque
from phasmid.simulation.closed_loop import Commanded

if TYPE_CHECKING:
    from phasmid.control.estimation import BodyStateEstimator

LATE = 5e-3
"""Delay of a tick from which on it is counted as late [s]."""

READING_SHARE = 0.7
"""Share of a period after which no further servo is read."""

LIMIT_SHARE = 0.35
"""Share of a period after which no further output limit is written."""

OFF_GOAL = math.radians(15)
"""Distance of a joint from its goal above which it is reported when a posture is reached [rad]. An
AX-12A with the factory's compliance slope is 9° off at its full torque."""

HANG_TIME = 1.0
"""Time without a tick, beyond `DriverSettings.hold_time` and a period, after which this process
counts as hanging [s]."""

GUARD_MARGIN = 0.5
"""Time after which the guard counts this process as hanging, beyond that of the driver [s]: the
driver must not write a goal after it."""

STOPPED = "stopped by the user"
"""Cause of an end that the user requested."""

START_MARGIN = 0.95
"""Largest speed of the targets as a share of that of the settings, whose unit in the servos is
coarse."""

Sensors = Callable[[], Mapping[str, Any]]
"""Returns fields of an observation."""


class Driver:
    """Drives a robot on a bus by a controller.

    Each tick writes the goals of the tick before, reads servos, checks the readings, and computes
    the next goals. At the start the servos hold the measured angles while their output limits are
    raised; then the robot stands up slowly. At the end it sits down and its torque is switched
    off, which the servos confirm.

    Args:
        robot: The robot, whose servos have been inspected, see `phasmid.hardware.inspect_servos`.
        scenario: Scenario of the robot, for the log; with ``body_state`` "estimated" the body's
            state is estimated from the stand on, and waypoints are followed by it.
        controller: Any controller; one that is no `SafetyFilter` is wrapped in posture sequences
            and a safety filter.
        commands: A command, a script, or a function of the time since the robot stands [s] and the
            observation, which returns a command, or None to end.
        rate: Ticks per second [1/s].
        settings: Limits and times.
        log: Path of the log; None: no log.
        force: Whether an older log is replaced.
        sensors: Returns what other sensors measure, at each update: fields of
            `phasmid.experiment.Observation` such as ``orientation`` and ``angular_velocity``.

    Attributes:
        stage: Present stage.
        report: What has happened so far.
        stop_requested: Strongest reaction that `stop` has requested.
        watch: Receives each sample; None: nothing does.
        override: Returns a velocity that replaces that of the next command, or None. After the
            first velocity the robot stands where it returns None.
        on_event: Receives the time [s] and the sentence of each event; None: nothing does.
    """

    def __init__(
        self,
        robot: RobotBus,
        scenario: Scenario,
        controller: Controller,
        commands: Commanded = Command(),  # noqa: B008, a frozen value
        *,
        rate: float = 50.0,
        settings: DriverSettings | None = None,
        log: str | Path | None = None,
        force: bool = False,
        sensors: Sensors | None = None,
    ) -> None:
        if not (math.isfinite(rate) and rate > 0):
            raise InvalidInput(f"rate is {rate:g}; it must be a finite number greater than 0.")
        estimates = scenario.sensors.body_state == "estimated"
        waypoints = isinstance(commands, CommandScript) and bool(commands.waypoint)
        if waypoints and not estimates:
            raise InvalidInput(
                "waypoints need the robot's place, which a robot on a bus does not measure.",
                hint="--velocity or commands over time",
            )
        if estimates and sensors is None:
            raise InvalidInput(
                "the body's state is estimated with an inertial sensor, and there is none.",
                hint="phasmid.hardware.Driver with `sensors`",
            )
        self.robot, self.settings = robot, settings or DriverSettings()
        if not isinstance(controller, SafetyFilter):
            safety = SafetySettings(gravity=scenario.model.gravity)
            controller = SafetyFilter(Sequencer(controller, robot.robot), robot.robot, safety)
        if not isinstance(controller.controller, Sequencer):
            raise InvalidInput(
                "a safety filter without posture sequences lets no robot stand up or sit down.",
                hint="phasmid.control.Sequencer within it, or the controller alone",
            )
        self.controller: SafetyFilter = controller
        self.report, self.stage = DriveReport(), Stage.RAMP
        self.stop_requested = Reaction.NONE
        self.on_event: Callable[[float, str], None] | None = None
        self._scenario, self._commands = scenario, commands
        self._period, self._log_path, self._force = 1 / rate, log, force
        self.watch: Watch | None = None
        self.override: Callable[[], tuple[float, float, float] | None] | None = None
        self._sensors = sensors
        self._measured: Mapping[str, Any] = {}
        self._estimator: BodyStateEstimator | None = None
        if estimates:
            # Lazy import: compiled functions take 0.2 s to load.
            from phasmid.control.estimation import BodyStateEstimator, BodyStateSettings

            noise = BodyStateSettings(gravity=scenario.model.gravity)
            self._estimator = BodyStateEstimator(robot.robot, noise, self._period)
        self._follower: WaypointFollower | None = None
        if isinstance(commands, CommandScript) and waypoints:
            self._follower = WaypointFollower(commands)
        self._protection = Protection(robot, self.settings)
        servo = robot.robot.servo
        # A servo without a known motor is given the targets alone.
        self._law = inverse_law(servo) if servo.stall_current else None
        self._memory = goal_memory(robot.position.size)
        self._written_at = 0.0
        self._shift = np.zeros_like(robot.position)
        self._begin = self._entered = time.monotonic()
        self._first_entered: dict[Stage, float] = {}
        self._holds: list[float] = []
        self._clock = self._walk_clock = 0.0
        self._command = Command(posture=Posture.STANDING)
        self._ended_command = False
        self._paced: PacedTargets | None = None
        self._error: Exception | None = None
        self._goals = self._written = self._written_before = robot.position.copy()
        self._after_hold, self._steady_since = Stage.WALK, math.inf
        self._port_failures = 0
        self._guard: Guard = NoGuard()
        self._alive_at = math.inf
        self._steered = False
        self._telemetry: dict[str, Any] = {}

    def stop(self, reaction: Reaction = Reaction.SIT) -> None:
        """Request to sit down, or to go limp at once; a signal handler may call it."""
        self.stop_requested = max(self.stop_requested, reaction)

    # The drive -----------------------------------------------------------------------------------

    def drive(self, duration: float = math.inf) -> DriveReport:
        """Drive until the commands end, or for a time of walking [s].

        Raises:
            BusError: The servos do not answer at the start. Torque off was sent to those that had
                been switched on, see `DriveReport.unconfirmed`.
            Exception: The controller or a watcher has raised it; the robot has sat down then.
            OutputError: The log cannot be written; the robot has sat down then.
        """
        robot, report = self.robot, self.report
        self._compile()
        robot.read_all()
        self._goals = self._written = self._written_before = robot.position.copy()
        log = DriveLog(
            self._log_path,
            self._scenario.build(),
            self._period,
            duration=duration,
            force=self._force,
            watch=self.watch,
        )
        with closing(log), self._guarded(), self._signals():
            # Objects that stay need not be examined during the drive.
            gc.collect()
            gc.freeze()
            try:
                self._start()
                self._run(duration, log)
            finally:
                gc.unfreeze()
                if self.stage is not Stage.OFF:
                    self._switch_off()
            try:
                log.finish(report.ending, report.events)
            except Exception as error:
                self._error = self._error or error
        if self._error is not None:
            raise self._error
        traffic = robot.bus.traffic
        report.answers, report.lost = traffic.answers, traffic.lost + traffic.damaged
        elapsed = max(time.monotonic() - self._begin, self._period)
        report.reading_rate = float(robot.readings.mean()) / elapsed
        return report

    def _compile(self) -> None:
        """Update the controller in the neutral stance, which compiles it before the robot moves."""
        q = neutral_stance(self.robot.robot).q
        self.controller.reset(Observation(0.0, q))
        for k in range(2):
            self.controller.update(Observation(k * self._period, q), Command((1e-3, 0.0, 0.0)))
        if self._estimator is not None:
            self._estimator.reset(Observation(0.0, q))

    def _start(self) -> None:
        """Let the servos hold the measured angles without output."""
        self._begin = time.monotonic()
        self._guard.is_confirmed = False
        for k in range(len(self.robot.ids)):
            if self.stop_requested:
                break
            self._is_guarded()
            self.robot.hold(k, self.settings.start_speed)
        self._entered = self._first_entered[Stage.RAMP] = time.monotonic()
        self.robot.answered_at = self._entered

    def _run(self, duration: float, log: DriveLog) -> None:
        """Tick until torque off was sent."""
        report, period, due = self.report, self._period, time.monotonic()
        while True:
            delay = time.monotonic() - due
            if delay > period:
                # The ticks go on from now.
                due += delay
            report.ticks += 1
            report.late += delay > LATE
            report.worst_delay = max(report.worst_delay, delay)
            self._check_driver()
            if self.stage is not Stage.OFF:
                self._exchange(due)
                self._check()
            if self.stage is Stage.OFF:
                return
            self._sample(log)
            clock = self._clock
            try:
                self._plan(duration)
            except Exception as error:
                # The robot must not stay as it is; the error is raised when the torque is off.
                self._error = error
                cause = f"the controller failed: {error}"
                self._end(cause)
                self._enter(Stage.RELEASE, f"{cause}: {Stage.RELEASE.value}.")
            if self._clock == clock:
                self.controller.monitor.add_load(self.robot.load, period)
            due += period
            time.sleep(max(due - time.monotonic(), 0.0))

    def _check_driver(self) -> None:
        """React to requests, to a hang of this process, and to the end of the guard."""
        if self.stop_requested:
            self._react(self.stop_requested, STOPPED)
        pause = time.monotonic() - self._alive_at
        is_guarded = self._is_guarded()
        if self._guard.has_acted() or pause > self._longest_pause:
            # The guard has switched the torque off, or will; a goal would switch it on again.
            self._react(Reaction.LIMP, f"the driver hung for {pause:.1f} s")
        elif not is_guarded:
            self._react(Reaction.SIT, "the process that switches the torque off has ended or hangs")

    @property
    def _longest_pause(self) -> float:
        """Longest pause of this process [s], before the guard switches the torque off."""
        if self.settings.after_exit == "hold":
            return math.inf
        return self.settings.hold_time + HANG_TIME + self._period

    def _is_guarded(self) -> bool:
        """Report that this process does not hang; return whether the guard answers."""
        self._alive_at = time.monotonic()
        return self._guard.alive()

    def _exchange(self, due: float) -> None:
        """Write what the stage needs, and read servos, in the period from a time [s]."""
        try:
            self._write(due)
            self._written_at = time.monotonic()
            self.robot.read(due + READING_SHARE * self._period)
            self._port_failures = 0
        except PortLost as error:
            # To the servos this is silence. The same port may work again, or the port opened anew.
            self._written_at = time.monotonic()
            self._port_failures += 1
            if self._port_failures == 1:
                self._note(error.what)
            else:
                with suppress(PortLost):
                    self.robot.bus.port.reopen()

    def _enter(self, stage: Stage, sentence: str = "") -> None:
        self.stage, self._entered = stage, time.monotonic()
        self._first_entered.setdefault(stage, self._entered)
        self._note(sentence or f"{stage.value}.")

    def _time_of(self, stage: Stage) -> float:
        """Return the time since a stage was first entered [s]; holds do not restart it."""
        return time.monotonic() - self._first_entered[stage]

    def _end(self, cause: str) -> bool:
        """Set how the drive ends, unless a fault has set it; return whether it was set.

        A fault after a stop by the user counts, too.
        """
        earlier = self.report.ending
        is_stop = cause == STOPPED
        if earlier is not None and (is_stop or earlier.ending is Ending.ABORTED):
            return False
        at = f"at {time.monotonic() - self._begin:.1f} s"
        if is_stop:
            ending, reason = Ending.STOPPED, at
        else:
            after = f", after a stop by the user {earlier.reason}" if earlier else ""
            ending, reason = Ending.ABORTED, f"{at}: {cause}{after}"
        self.report.ending = Failure(ending, self.report.ticks, reason)
        return True

    def _note(self, sentence: str) -> None:
        event = time.monotonic() - self._begin, sentence
        self.report.events.append(event)
        if self.on_event is not None:
            # A terminal that was closed must not end the drive.
            with suppress(OSError, ValueError):
                self.on_event(*event)

    # Goals ---------------------------------------------------------------------------------------

    def _write(self, due: float) -> None:
        """Write what the stage needs in the period from a time [s]."""
        robot, settings, stage = self.robot, self.settings, self.stage
        share = (time.monotonic() - self._entered) / max(settings.ramp_time, 1e-9)
        until = due + LIMIT_SHARE * self._period
        if stage is Stage.RAMP:
            robot.limit_output(min(share, 1.0), until)
        elif stage is Stage.RELEASE:
            robot.limit_output(max(1.0 - share, 0.0), until)
        if stage in MOVING:
            goals = np.clip(self._goals + self._shift, robot.low, robot.high)
            # The servos' own limit protects where the driver ends during the motion.
            robot.write_goals(goals, 0.0 if stage is Stage.WALK else self._speed())
            self._written_before, self._written = self._written, goals

    def _speed(self) -> float:
        """Return the largest joint speed of the stage [rad/s]."""
        if self.stage is Stage.WALK:
            # The motion is paced as a whole, by its slowest joint.
            return float(self.controller.speed.min())
        return self.settings.sit_speed if self.stage is Stage.SIT else self.settings.start_speed

    def _plan(self, duration: float) -> None:
        """Compute the next goals, and enter the next stage where this one is over."""
        stage, settings = self.stage, self.settings
        if stage is Stage.RAMP:
            if (self.robot.output_limit == 1.0).all():
                self.controller.reset(self._observe())
                self.controller.monitor.temperature = self.robot.temperature.copy()
                self._paced = PacedTargets(self._goals, self._period, self._update)
                self._enter(Stage.RISE)
            return
        if self._paced is None or stage in (Stage.HOLD, Stage.RELEASE):
            return
        self._goals = self._paced.advance(START_MARGIN * self._speed())
        self._take_events()
        posture, elapsed = self._telemetry.get("sequence"), self._time_of(stage)
        if stage is Stage.RISE and posture == Sequence.STANDING.value:
            self._walk_clock = self._clock
            if self._estimator is not None:
                self._estimator.reset(self._read())
            self._note_joints_off_goal()
            self._enter(Stage.WALK)
        elif stage is Stage.RISE and elapsed > LONGEST_RISE:
            self._sit(f"it does not stand after {LONGEST_RISE:g} s")
        elif stage is Stage.WALK:
            self.report.walked = self._clock - self._walk_clock
            if self._ended_command or self.report.walked >= duration:
                self._enter(Stage.SIT)
            elif elapsed > WALK_STRETCH * duration + WALK_EXCESS:
                walked = f"{self.report.walked:.1f} of {duration:g} s"
                self._sit(f"it walked {walked} within {elapsed:.0f} s")
        elif stage is Stage.SIT and posture == Sequence.LYING.value:
            self._note_joints_off_goal()
            self._enter(Stage.RELEASE)
        elif stage is Stage.SIT and elapsed > settings.sit_time:
            cause = f"it does not lie after {settings.sit_time:g} s"
            self._end(cause)
            self._enter(Stage.RELEASE, f"{cause}: {Stage.RELEASE.value}.")

    def _sit(self, cause: str) -> None:
        """Let the robot sit down for a fault."""
        self._end(cause)
        self._enter(Stage.SIT, f"{cause}: {Stage.SIT.value}.")

    def _note_joints_off_goal(self) -> None:
        """Report joints that are far from their goals when a posture is reached."""
        robot = self.robot
        off = np.abs(robot.position - self._goals)
        far = [
            f"{robot.names[k]} {math.degrees(off.flat[k]):.0f}°"
            for k in np.flatnonzero((off > OFF_GOAL) & robot.running)
        ]
        if far:
            self._note(f"joints are away from their goals: {', '.join(far)}.")

    def _update(self) -> Float[np.ndarray, "legs 3"]:
        """Update the controller after another period of its clock, and return its targets."""
        self._clock += self._period
        observation = self._observe()
        self._command = self._commanded(observation)
        targets = self.controller.update(observation, self._command)
        shift, most = self._feed_forward(targets), self.controller.speed * self._period
        self._shift = self._shift + np.clip(shift - self._shift, -most, most)
        telemetry = self.controller.telemetry()
        known = self._telemetry or {name: None for name in telemetry if name in CHANNELS}
        # Channels that an update lacks keep their values.
        self._telemetry = {name: telemetry.get(name, value) for name, value in known.items()}
        return targets.position

    def _observe(self) -> Observation:
        """Return the last readings, with the body's estimated state once the robot walks."""
        observation = self._read()
        if self._estimator is not None and self.stage is Stage.WALK:
            observation = self._estimator.observe(observation)
        return observation

    def _read(self) -> Observation:
        """Return the last readings of servos and sensors."""
        observation = self.robot.observe(self._clock)
        if self._sensors is not None:
            self._measured = self._sensors()
            observation = replace(observation, **self._measured)
        return observation

    def _feed_forward(self, targets: JointTargets) -> Float[np.ndarray, "legs 3"]:
        """Return how far from the targets goals give their torque, by the servos' law [rad]."""
        if targets.torque is None or self._law is None:
            return np.zeros_like(targets.position)
        rows = (targets.position, targets.velocity, targets.torque)
        q, qd, torque = (np.asarray(row, dtype=float).reshape(1, -1) for row in rows)
        goals = goals_for_torque(q, qd, torque, self._law, self._period, self._memory)
        return (goals - q).reshape(targets.position.shape)

    def _commanded(self, observation: Observation) -> Command:
        """Return the command of an update."""
        if self.stage is Stage.RISE:
            return Command(posture=Posture.STANDING)
        if self.stage is Stage.SIT:
            return Command(posture=Posture.PACKED)
        commands, now = self._commands, self._clock - self._walk_clock
        velocity = self.override() if self.override is not None else None
        self._steered |= velocity is not None
        if self._steered:
            # Where commands no longer arrive, the robot stands.
            return Command(velocity=velocity or (0.0, 0.0, 0.0))
        if isinstance(commands, Command):
            return commands
        position, orientation = observation.body_position, observation.body_orientation
        if self._follower is not None and position is not None and orientation is not None:
            found = self._follower.command(now, plane_pose(position, orientation))
        elif isinstance(commands, CommandScript):
            found = commands.at(now)
        else:
            found = commands(now, observation)
        self._ended_command = found is None
        return found or self._command

    def _take_events(self) -> None:
        """Take the controller's events, whose times are those of its clock."""
        for _, sentence in self.controller.take_events():
            self._note(sentence)

    # Protection ----------------------------------------------------------------------------------

    def _check(self) -> None:
        """React to readings."""
        report, now = self.report, time.monotonic()
        predicted = float(self.controller.monitor.temperature.max())
        report.hottest_predicted = max(report.hottest_predicted, predicted)
        reaction, cause = self._protection.check(self.controller.monitor)
        # NaN before all servos were read often enough.
        report.hottest = max(report.hottest, self._protection.hottest)
        report.lowest_voltage = min(report.lowest_voltage, self._protection.lowest_voltage)
        if self.stage is Stage.RAMP:
            self._check_ramp()
        elif self.stage is Stage.RELEASE and self._time_of(Stage.RELEASE) > self.settings.ramp_time:
            self._switch_off()
        if self.stage is Stage.HOLD and reaction is not Reaction.LIMP:
            self._hold(reaction, cause, now)
        else:
            self._react(reaction, cause)

    def _check_ramp(self) -> None:
        """Switch the torque off where a servo shuts down, or does not confirm its output limit."""
        robot, excess = self.robot, self._time_of(Stage.RAMP) - self.settings.ramp_time
        if robot.has_shut_down.any():
            name = robot.names[int(np.argmax(robot.has_shut_down))]
            self._react(Reaction.LIMP, f"the servo of {name} has shut down")
        elif excess > LONGEST_RAMP:
            name = robot.names[int(np.argmax(robot.output_limit != 1.0))]
            cause = f"the servo of {name} does not confirm its output limit"
            self._react(Reaction.LIMP, cause)

    def _react(self, reaction: Reaction, cause: str) -> None:
        """Enter the stage of a reaction, unless a stronger one acts."""
        stage = self.stage
        if reaction is Reaction.NONE or stage is Stage.OFF:
            return
        if reaction is Reaction.LIMP or stage is Stage.RAMP:
            self._end(cause)
            self._switch_off(cause)
        elif reaction is Reaction.HOLD:
            if stage in (Stage.RISE, Stage.WALK, Stage.SIT):
                self._begin_hold(cause)
        elif stage in (Stage.RISE, Stage.WALK):
            self._sit(cause)
        else:
            # It sits down already, or will after the hold.
            if stage is Stage.HOLD:
                self._after_hold = Stage.SIT
                self._first_entered.setdefault(Stage.SIT, time.monotonic())
            if self._end(cause):
                self._note(f"{cause}.")

    def _begin_hold(self, cause: str) -> None:
        """Write no goals until the servos answer again."""
        now = time.monotonic()
        self._after_hold, self._steady_since = self.stage, math.inf
        self._holds = [at for at in self._holds if now - at < HOLD_WINDOW] + [now]
        self._enter(Stage.HOLD, f"{cause}: {Stage.HOLD.value}.")
        if len(self._holds) >= MOST_HOLDS and self._after_hold is not Stage.SIT:
            self._end(f"{cause}, {MOST_HOLDS} times in {HOLD_WINDOW:g} s")
            self._after_hold = Stage.SIT

    def _hold(self, reaction: Reaction, cause: str, now: float) -> None:
        """Go on where the servos answer again with their torque on; end the hold after a while."""
        settings = self.settings
        is_over = now - self._entered > settings.hold_time
        if self._after_hold is Stage.SIT and Stage.SIT in self._first_entered:
            is_over |= self._time_of(Stage.SIT) > settings.sit_time
        is_steady = reaction is Reaction.NONE
        self._steady_since = min(self._steady_since, now) if is_steady else math.inf
        if is_over:
            self._end_hold(cause or "the servos do not answer steadily")
        elif now - self._steady_since >= STEADY_TIME:
            self._end_silence()

    def _end_hold(self, cause: str) -> None:
        """Let the robot sit down after a hold, or switch the torque off where no servo answers."""
        if self.robot.is_silent:
            # Goals to a silent bus would move servos whose supply comes back.
            self._end(cause)
            self._switch_off(cause)
        else:
            self._sit(cause)

    def _end_silence(self) -> None:
        """Go on where the torque of all servos is on, or switch it off where it is not."""
        try:
            is_on = self.robot.torque_is_on(self._is_guarded)
        except PortLost:
            is_on = None
        if is_on is None:
            self._steady_since = math.inf
        elif is_on:
            self._enter(self._after_hold, f"servos answer again: {self._after_hold.value}.")
        else:
            self._react(Reaction.LIMP, "servos have restarted, and are limp")

    def _switch_off(self, cause: str = "") -> None:
        """Send torque off until the servos confirm it, and report those that do not."""
        report, robot = self.report, self.robot
        report.unconfirmed = list(robot.names)
        try:
            with suppress(PortLost):
                # Sent before anything is printed: a terminal may take no output.
                robot.bus.write_all("torque_enable", dict.fromkeys(robot.ids, 0.0))
            if cause:
                self._note(f"{cause}: torque off is sent.")
            report.unconfirmed = robot.switch_torque_off(self.settings.off_time, self._is_guarded)
        finally:
            self._guard.is_confirmed = not report.unconfirmed
            self._note_torque()

    def _note_torque(self) -> None:
        """Report whether the torque is off, by what the servos have confirmed."""
        report = self.report
        if not report.unconfirmed:
            self._enter(Stage.OFF)
            return
        names = ", ".join(report.unconfirmed)
        which = "any servo" if len(report.unconfirmed) == len(self.robot.ids) else names
        sentence = f"torque off is not confirmed by {which}: switch the supply off"
        ending = report.ending
        reason = f"{ending.reason}; {sentence}" if ending else sentence
        report.ending = Failure(Ending.ABORTED, report.ticks, reason)
        self._enter(Stage.OFF, f"{sentence}.")
        if self._guard.pid and self._is_guarded():
            self._note(f"process {self._guard.pid} sends torque off until it is confirmed.")

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        """Run a second process that switches the torque off after this one, unless it holds."""
        if self.settings.after_exit == "hold":
            yield
            return
        bus, ids, hold = self.robot.bus, self.robot.ids, self.settings.hold_time
        silence = self._longest_pause + GUARD_MARGIN
        with torque_off_after_exit(bus, ids, hold, silence) as self._guard:
            # Nothing was switched on yet.
            self._guard.is_confirmed = True
            yield

    @contextmanager
    def _signals(self) -> Iterator[None]:
        """Sit down at Ctrl-C, SIGTERM or a lost terminal; go limp at a second Ctrl-C."""
        interrupts = 0

        def request(number: int, frame: Any) -> None:
            nonlocal interrupts
            del frame
            interrupts += number == signal.SIGINT
            self.stop(Reaction.LIMP if interrupts > 1 else Reaction.SIT)

        with handled_signals(request):
            yield

    def _sample(self, log: DriveLog) -> None:
        """Log the channels of a tick; the first ones come with the controller's first update."""
        robot, telemetry, measured = self.robot, self._telemetry, self._measured
        if not telemetry or self._error is not None:
            return
        channels = {
            **telemetry,
            **{name: measured[key] for name, key in OBSERVED.items() if key in measured},
            **({} if self._estimator is None else self._estimator.channels()),
            COMMANDED: self._command.velocity,
            "joint_position_target": self._written,
            "joint_velocity_target": (self._written - self._written_before) / self._period,
            "joint_position_measured": robot.position,
            "joint_position_time": robot.read_at - self._begin,
            "joint_load_measured": robot.load,
            "servo_temperature": self.controller.monitor.temperature,
            "servo_temperature_measured": robot.temperature,
            "servo_voltage_measured": robot.voltage,
            "servo_shutdown": ~robot.running,
        }
        try:
            log.append(self._written_at - self._begin, channels)
        except Exception as error:
            # Without its log the robot must not walk on; the error is raised when it lies.
            self._error = error
            self._react(Reaction.SIT, "the log cannot be written")
