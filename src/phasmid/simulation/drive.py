"""Closed-loop experiments: a controller drives the simulated robot by commands."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.control import (
    Command,
    CommandScript,
    Controller,
    LocomotionEngine,
    Observation,
    Player,
    SafetyFilter,
    SafetySettings,
    Sequencer,
    commands_to_text,
)
from phasmid.control.sequences import packing
from phasmid.control.waypoints import WaypointFollower
from phasmid.errors import InvalidInput
from phasmid.forces.servo_verdict import verdict_text
from phasmid.motion import Motion
from phasmid.recording import Recording
from phasmid.recording.recording import Attributes
from phasmid.scenario import Scenario
from phasmid.scenario.sensors import SENSORS
from phasmid.simulation.closed_loop import (
    ClosedLoopRun,
    Commands,
    interpolation,
    period_steps,
)
from phasmid.simulation.experiment import Experiment
from phasmid.simulation.faults import Fault, Faults
from phasmid.simulation.rerun import SCENARIO_CONTROLLER, controller_attributes
from phasmid.simulation.run import Progress, Run
from phasmid.simulation.start import check_start, check_time_step, standing
from phasmid.simulation.termination import Ending, Failure

MOST_EVENTS = 10_000
"""Most events of a controller that a recording keeps."""

MISSED_PERIODS = 2.5
"""Periods without an observation that the safety monitor tolerates at least."""

Commanded: TypeAlias = Command | CommandScript | Callable[[float, Observation], Command | None]
"""A constant command, a script, or a function of time [s] and observation; None ends the run."""


def drive(
    scenario: Scenario,
    controller: Controller | None = None,
    commands: Commanded = Command(),  # noqa: B008, a frozen value
    *,
    rate: float = 200.0,
    between: str | None = None,
    start: Float[np.ndarray, "legs 3"] | None = None,
    faults: Sequence[Fault | str] = (),
    progress: Progress | None = None,
    log: str | Path | None = None,
    force: bool = False,
) -> Recording:
    """Let a controller drive the simulated robot in closed loop.

    The robot starts at rest on its feet, at the start of the controller's attribute ``motion`` if
    it has one, else at neutral. The controller receives observations and returns targets at a
    fixed rate. Interrupting the run (Ctrl-C) ends it and keeps what was recorded.

    Args:
        scenario: Robot, ground, drive and simulation; its duration is the longest.
        controller: The controller; None: the locomotion engine with the scenario's gait, period
            and step height, with posture sequences and safety, see `scenario_controller`.
        commands: A command, a script, or a function of time and observation. Waypoints of a script
            are followed by the robot's true pose.
        rate: Updates per second [1/s]; a period must be a whole number of time steps.
        between: Interpolation of targets between updates. ``hold``: the goals stay, as on a
            servo's bus; ``linear``: they go on with the targets' velocities; ``cubic``: joints go
            from the last targets to the new ones, which they reach at the next update. None:
            ``cubic`` for the drive ``prescribed``, ``linear`` for ``torque``, else ``hold``.
        start: Joint angles at the start [rad], shape (L, 3).
        faults: What fails, and when: each a `phasmid.simulation.Fault`, or a sentence such as
            ``right_middle.tibia dead at 5 s``.
        progress: Receives the simulated time [s].
        log: As in `phasmid.simulate`.
        force: Whether an older log of that name is replaced.

    Returns:
        The simulated channels, the targets, the commanded velocity and the controller's telemetry.
        The attribute ``events`` holds the controller's events, a list of [time, sentence] as JSON,
        the attribute ``commands`` all commands, a script as text.

    Raises:
        InvalidInput: The time step cannot resolve the contact, the rate does not fit it, or the
            controller returns no targets, and the like.
        OutputError: The log cannot be written; what it holds until then can be read.
    """
    experiment = DriveExperiment(
        scenario, controller, commands, rate=rate, between=between, start=start, faults=faults
    )
    return experiment.make(progress=progress, log=log, force=force)


def check_drive(
    scenario: Scenario, *, rate: float, between: str | None, faults: Sequence[Fault | str] = ()
) -> Faults:
    """Refuse what no controller could change, and return the faults of the scenario's robot.

    Raises:
        InvalidInput: As in `drive`.
    """
    interpolation(scenario.simulation.planned_drive, between)
    period_steps(scenario, rate)
    if scenario.contact.contact_law == "simscape":
        raise InvalidInput(
            'contact_law is "simscape"; its simulator follows plans and takes no controller.',
            hint='contact_law = "spring-damper"',
        )
    return Faults(scenario.load_robot(), faults, scenario.sensors.contact_threshold)


class DriveExperiment(Experiment):
    """A closed-loop run that can be made; arguments and errors as in `drive`.

    Attributes:
        scenario: With the drive of a driven robot, and sensor delays of a time step at least.
        begin: A motion at whose first instant the robot begins.
        controller: The controller.
    """

    def __init__(
        self,
        scenario: Scenario,
        controller: Controller | None,
        commands: Commanded,
        *,
        rate: float = 200.0,
        between: str | None = None,
        start: Float[np.ndarray, "legs 3"] | None = None,
        faults: Sequence[Fault | str] = (),
    ) -> None:
        scenario = scenario.driven()
        self._faults = check_drive(scenario, rate=rate, between=between, faults=faults)
        self._between = interpolation(scenario.simulation.planned_drive, between)
        self._is_scenarios = controller is None
        if controller is None:
            controller = scenario_controller(scenario, rate)
        _check_prescribed(scenario, controller)
        motion = getattr(controller, "motion", None)
        self.begin: Motion
        if motion is not None and start is None:
            self.begin = motion
            self.begin.check_planned_for(scenario)
        else:
            robot = scenario.load_robot()
            if start is None and scenario.simulation.start_posture == "packed":
                start = packing(robot).folded
            self.begin = standing(scenario, robot, start)
        check_time_step(scenario, self.begin)
        check_start(scenario, self.begin)
        table, dt = scenario.sensors, scenario.simulation.dt
        delays = [f"{sensor}_delay" for sensor in SENSORS]
        if table.measured == "everything":
            scenario = scenario.replace(**{name: max(getattr(table, name), dt) for name in delays})
        self.scenario, self.controller = scenario, controller
        self._commands, self._rate, self._start = commands, rate, start
        self._waypoints = commands.waypoint if isinstance(commands, CommandScript) else ()
        self._follower: WaypointFollower | None = None

    def begin_run(
        self,
        *,
        samples: int | None = None,
        interrupted: Sequence[int] = (),
        endless: bool = False,
    ) -> ClosedLoopRun:
        """Return the run before its first step; `endless` goes on for as long as it is advanced."""
        del samples
        return ClosedLoopRun(
            self.scenario,
            self.begin,
            self.controller,
            self._command_function(),
            rate=self._rate,
            between=self._between,
            faults=self._faults,
            interrupted=interrupted,
            endless=endless,
        )

    def attributes(self, run: Run) -> Attributes:
        """Return run, controller, commands and faults."""
        attributes = dict(super().attributes(run))
        if not isinstance(self.controller, Player):
            attributes.pop("trajectory", None)
            attributes["servo_verdict"] = verdict_text(self.scenario)
        if isinstance(self._commands, CommandScript):
            attributes["commands"] = self._commands.to_text()
        if self._start is not None:
            attributes["start_angles"] = json.dumps(np.asarray(self._start).tolist())
        own = {"controller": SCENARIO_CONTROLLER}
        return {
            **attributes,
            **(own if self._is_scenarios else controller_attributes(self.controller)),
            "control_rate": float(self._rate),
            "faults": json.dumps([str(fault) for fault in self._faults.faults]),
            "between_updates": self._between,
        }

    def final_attributes(self, run: Run) -> Attributes:
        """Return the controller's events, the waypoints reached, and the commands."""
        assert isinstance(run, ClosedLoopRun)
        all_events = list(getattr(self.controller, "events", ()))
        events = [[float(time), str(sentence)] for time, sentence in all_events[:MOST_EVENTS]]
        if len(all_events) > MOST_EVENTS:
            events.append([events[-1][0], f"{len(all_events) - MOST_EVENTS} more were not kept"])
        final = {"events": json.dumps(events, ensure_ascii=False)}
        if self._follower:
            times = [*self._follower.reached, *[None] * len(self._waypoints)]
            rows = [
                {"x": place.x, "y": place.y, "heading": place.heading, "reached": time}
                for place, time in zip(self._waypoints, times, strict=False)
            ]
            final["waypoints"] = json.dumps(rows)
        if not isinstance(self._commands, CommandScript):
            # The run ended after the last update with a command, before the one without.
            end = (run.step - 0.5 * run.period_steps) * run.dt if run.ended else None
            final["commands"] = commands_to_text(run.command_changes, end)
        return final

    def shortfall(self, run: Run) -> Failure | None:
        """Return which waypoint was not reached, or None."""
        count, follower = len(self._waypoints), self._follower
        if follower is None or len(follower.reached) == count:
            return None
        reached = len(follower.reached)
        reason = (
            f"by {min(run.step, run.steps) * run.dt:.4g} s: {reached} of {count} reached, waypoint "
            f"{reached + 1} is {follower.remaining}. Try a longer --duration"
        )
        return Failure(Ending.INCOMPLETE, run.step, reason)

    def _command_function(self) -> Commands:
        """Return the commands as a function of time, observation and pose, from their start."""
        commands = self._commands
        if isinstance(commands, Command):
            return lambda *_: commands
        if not isinstance(commands, CommandScript):
            return lambda time, observation, _: commands(time, observation)
        if not commands.waypoint:
            return lambda time, *_: commands.at(time)
        follower = self._follower = WaypointFollower(commands)
        return lambda time, _, pose: follower.command(time, pose())


def scenario_controller(scenario: Scenario, rate: float, **settings: Any) -> SafetyFilter:
    """Return the controller of a scenario that is driven without another one.

    It is the locomotion engine with the scenario's robot, gait, period and step height, inside
    posture sequences (standing up, sitting down, legs moved by hand, lost legs), inside safety.
    It is updated at a rate [1/s]; other settings of the engine are those of `EngineSettings`.

    Raises:
        InvalidInput: The robot cannot walk so.
    """
    period_steps(scenario, rate)
    robot, stride = scenario.load_robot(), scenario.stride
    own: dict[str, Any] = {
        "gait": scenario.load_gait(len(robot.legs)),
        "period": stride.period,
        "step_height": stride.step_height,
        "update_period": 1 / rate,
    }
    engine = LocomotionEngine(robot, **(own | settings))
    patience = max(SafetySettings().observation_time, MISSED_PERIODS / rate)
    safety = SafetySettings(observation_time=patience)
    return SafetyFilter(Sequencer(engine, robot), robot, safety)


def _check_prescribed(scenario: Scenario, controller: Controller) -> None:
    """Refuse prescribed joints on ground that the controller does not estimate.

    They do not yield: feet that touch down early would hit the ground with any force.
    """
    if scenario.simulation.drive != "prescribed" or scenario.load_terrain().is_level:
        return
    if isinstance(controller, Player) and scenario.terrain.planned_on == "terrain":
        return
    raise InvalidInput(
        f'drive is "prescribed" on terrain "{scenario.terrain.kind}"; joints that do not yield '
        "need a plan that follows the ground.",
        hint='drive = "servo" or "ideal-servo"',
    )
