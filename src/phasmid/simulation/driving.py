"""Robots driven by a controller in the simulator, recorded."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_callable, check_type, described
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
    script_from_text,
)
from phasmid.control.sequences import SequenceSettings, packing
from phasmid.control.waypoints import Follower
from phasmid.errors import InvalidInput
from phasmid.forces.servo_verdict import verdict_text
from phasmid.motion import Motion
from phasmid.recording import Recording, load_recording
from phasmid.recording.recording import Attributes
from phasmid.scenario import Scenario, check_scenario
from phasmid.scenario.sensors import SENSORS
from phasmid.simulation.driven import Commands, DrivenRun, period_steps
from phasmid.simulation.ending import Ending, Trouble
from phasmid.simulation.experiment import with_sensors
from phasmid.simulation.fault import Fault, Faults
from phasmid.simulation.hold import between_updates
from phasmid.simulation.keeping import kept_in_log, kept_in_memory
from phasmid.simulation.recorded_controller import controller_attributes, recorded_controller
from phasmid.simulation.run import Progress
from phasmid.simulation.start import check_start, standing
from phasmid.simulation.telling import run_attributes
from phasmid.simulation.time_step import check_time_step

MOST_EVENTS = 10_000
"""Most sentences of a controller that a recording keeps."""

MISSED = 2.5
"""Periods without an update that are a gap in what sensors tell, at the least."""

Commanded: TypeAlias = Command | CommandScript | Callable[[float, Observation], Command | None]
"""A command that stands for the whole run, a script, or a function of time [s] and observation,
whose answer None ends the run."""


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
    """Let a controller drive the robot in the physics engine, in closed loop.

    The robot starts at rest on its feet, where the controller's own motion begins if it has one in
    an attribute ``motion``, and else at neutral. The controller is told what the sensors tell, and
    asked for targets at a fixed rate. Interrupting the run (Ctrl-C) ends it and keeps what was
    recorded.

    Args:
        scenario: Robot, ground, drive and engine; its duration is the longest.
        controller: What decides; None: the locomotion engine with the scenario's gait, period and
            step height, which stands up and sits down, moves legs by hand, walks on without lost
            ones and has safety around it: see `scenario_controller`.
        commands: What it is told to do: a command, a script, or a function of time and
            observation. Places of a script are gone to by where the robot truly is.
        rate: Updates of the controller a second [1/s]; a period must be a whole number of time
            steps.
        between: What joints do between updates. ``hold``: their goals stay, as on a servo's bus;
            ``linear``: they go on with the targets' speeds; ``cubic``: they go from the last
            targets to the new ones, which they reach as the next update comes. None: ``cubic``
            where the drive is ``prescribed``, which knows no other, and else ``hold``.
        start: Joint angles to begin with [rad], shape (L, 3).
        faults: What fails, when: each a `phasmid.simulation.Fault`, or a sentence such as
            ``right_middle.tibia dead at 5 s``.
        progress: Is told how far the run is.
        log: As in `phasmid.simulate`.
        force: Whether an older log of that name is replaced.

    Returns:
        What physics made of it: the engine's channels, the targets, the commanded velocity and the
        controller's telemetry. The controller's own sentences are in the attribute ``events``, a
        list of [time, sentence] as JSON, and all commands in ``commands``, a script as text.

    Raises:
        InvalidInput: What cannot be, such as a time step that cannot resolve the contact, a rate
            that does not fit it, or a controller that answers with no targets.
        OutputError: The log cannot be written; what it holds until then can be read.
    """
    driving = Driving.of(
        scenario,
        controller,
        commands,
        rate=rate,
        between=between,
        start=start,
        faults=faults,
    )
    check_callable("progress", progress)
    if log is not None:
        driving.record(log, progress=progress, force=force)
        return with_sensors(driving.scenario, load_recording(log))
    return driving.simulate(progress=progress)


def check_drive(
    scenario: Scenario, *, rate: float, between: str | None, faults: Sequence[Fault | str] = ()
) -> Faults:
    """Refuse what no controller could change, before one is made and compiled.

    Args:
        scenario: As driven.
        rate: Updates of the controller a second [1/s].
        between: What joints do between updates; None: as the drive needs it.
        faults: What fails, and when.

    Returns:
        The faults, of the scenario's robot.

    Raises:
        InvalidInput: As in `drive`.
    """
    between_updates(scenario.simulation.planned_drive, between)
    period_steps(scenario, rate)
    if scenario.contact.contact_law == "simscape":
        raise InvalidInput(
            'contact_law is "simscape"; its simulator follows plans and knows no controller.',
            hint='contact_law = "spring-damper"',
        )
    return Faults(scenario.load_robot(), faults, scenario.sensors.contact_threshold)


@dataclass(frozen=True, eq=False)
class Driving:
    """All that a driven run is made of, checked; see `drive`."""

    scenario: Scenario
    begin: Motion
    controller: Controller
    own: bool
    commands: Commanded
    rate: float
    between: str | None
    start: Float[np.ndarray, "legs 3"] | None
    faults: Faults

    @classmethod
    def of(
        cls,
        scenario: Scenario,
        controller: Controller | None,
        commands: Commanded,
        *,
        rate: float,
        between: str | None,
        start: Float[np.ndarray, "legs 3"] | None = None,
        faults: Sequence[Fault | str] = (),
    ) -> Driving:
        """What a caller gives, refused where it cannot be driven.

        Raises:
            InvalidInput: As in `drive`.
        """
        check_scenario(scenario)
        scenario = scenario.driven()
        failing = check_drive(scenario, rate=rate, between=between, faults=faults)
        is_own = controller is None
        if controller is None:
            controller = scenario_controller(scenario, rate)
        hint = "a class with the methods reset and update"
        check_type("controller", controller, (Controller,), "a Controller", hint)
        _check_prescribed(scenario, controller)
        own = getattr(controller, "motion", None)
        begin: Motion
        if own is not None and start is None:
            begin = own
            begin.check_planned_for(scenario)
        else:
            robot = scenario.load_robot()
            if start is None and scenario.simulation.start_posture == "packed":
                start = packing(robot, SequenceSettings()).folded
            begin = standing(scenario, robot, start)
        check_time_step(scenario, begin)
        check_start(scenario, begin)
        scenario = _with_delays(scenario)
        _asking(commands)
        return cls(scenario, begin, controller, is_own, commands, rate, between, start, failing)

    @classmethod
    def again(cls, recording: Recording, scenario: Scenario) -> Driving:
        """What a recorded run was made of.

        Args:
            recording: Of a driven run.
            scenario: Its own, with its robot.

        Raises:
            InvalidInput: It was driven by a controller of somebody's own, or by commands that no
                script can tell.
        """
        said = recording.attrs
        text, controller = said.get("commands"), recorded_controller(recording, scenario)
        if text is None:
            raise InvalidInput(
                "the recording does not hold its run's commands; it cannot be run again.",
                hint="phasmid.drive with commands in a CommandScript",
            )
        rate = float(said["control_rate"])
        start = said.get("start_angles")
        return cls.of(
            scenario,
            controller,
            script_from_text(str(text)),
            rate=rate,
            between=str(said["between_updates"]),
            start=None if start is None else np.array(json.loads(str(start))),
            faults=json.loads(str(said.get("faults", "[]"))),
        )

    def repeat(self, samples: int, progress: Progress | None = None) -> Recording:
        """Make the run's first samples.

        Args:
            samples: How many.
            progress: Is told how far the run is.
        """
        run = self.begin_run()
        recording = kept_in_memory(
            run,
            run.told,
            self.attributes(run),
            samples=samples,
            progress=progress,
            interrupted=None,
        )
        return with_sensors(self.scenario, recording)

    def simulate(self, *, progress: Progress | None = None) -> Recording:
        """Make the run in memory."""
        run = self.begin_run()
        recording = kept_in_memory(
            run,
            run.told,
            self.attributes(run),
            progress=progress,
            interrupted=None,
            shortfall=lambda: _shortfall(run),
            later=lambda: self._later(run),
        )
        return with_sensors(self.scenario, recording)

    def record(
        self, path: str | Path, *, progress: Progress | None = None, force: bool = False
    ) -> Trouble | None:
        """Make the run into a log alone.

        Returns:
            What ended the run early; None where it was completed.
        """
        run = self.begin_run()
        return kept_in_log(
            run,
            run.told,
            self.attributes(run),
            path,
            progress=progress,
            force=force,
            shortfall=lambda: _shortfall(run),
            later=lambda: self._later(run),
        )

    def begin_run(self, *, endless: bool = False) -> DrivenRun:
        """The run, before its first step.

        Args:
            endless: Whether it goes on for as long as it is advanced.
        """
        return DrivenRun(
            self.scenario,
            self.begin,
            self.controller,
            _asking(self.commands),
            rate=self.rate,
            between=between_updates(self.scenario.simulation.planned_drive, self.between),
            faults=self.faults,
            endless=endless,
        )

    def attributes(self, run: DrivenRun) -> Attributes:
        """What a recording says of the run, but for how it ended."""
        said = run_attributes(self.scenario, self.begin, run)
        if not isinstance(self.controller, Player):
            said.pop("trajectory", None)
            said = {**said, "servo_verdict": verdict_text(self.scenario)}
        told = controller_attributes(self.controller, own=self.own)
        start = self.start
        if isinstance(self.commands, CommandScript):
            said = {**said, "commands": self.commands.to_text()}
        if start is not None:
            said = {**said, "start_angles": json.dumps(np.asarray(start).tolist())}
        return {
            **said,
            **told,
            "control_rate": float(self.rate),
            "faults": json.dumps([str(fault) for fault in self.faults.faults]),
            "between_updates": between_updates(
                self.scenario.simulation.planned_drive, self.between
            ),
        }

    def _later(self, run: DrivenRun) -> Attributes:
        """What is known at the run's end alone."""
        told = list(getattr(self.controller, "events", ()))
        events = [[float(time), str(sentence)] for time, sentence in told[:MOST_EVENTS]]
        if len(told) > MOST_EVENTS:
            events.append([events[-1][0], f"{len(told) - MOST_EVENTS} more were not kept"])
        later: Attributes = {"events": json.dumps(events, ensure_ascii=False)}
        if isinstance(run.commands, _Waypoints):
            later = {**later, **run.commands.attributes()}
        if not isinstance(self.commands, CommandScript):
            end = None
            if run.ended:
                # After the last update that was answered, and before the one that was not.
                end = (run.step - 0.5 * run.period_steps) * run.dt
            # A command that no script can tell is in the channel alone.
            with contextlib.suppress(InvalidInput):
                later = {**later, "commands": CommandScript.of(run.asked, end).to_text()}
        return later


def scenario_controller(
    scenario: Scenario, rate: float, *, ground_sensing: bool = True
) -> SafetyFilter:
    """The controller that a scenario has where nobody gives one.

    It is the locomotion engine with the scenario's robot, gait, period and step height, in
    sequences that let the robot stand up and sit down, moved legs by hand and lost ones, with
    safety around it.

    Args:
        scenario: The experiment.
        rate: Updates a second [1/s].
        ground_sensing: Whether it estimates contact and ground.

    Raises:
        InvalidInput: It cannot walk so.
    """
    period_steps(scenario, rate)
    robot, stride = scenario.load_robot(), scenario.stride
    engine = LocomotionEngine(
        robot,
        gait=scenario.load_gait(len(robot.legs)),
        period=stride.period,
        step_height=stride.step_height,
        update_period=1 / rate,
        ground_sensing=ground_sensing,
    )
    sequencer = Sequencer(engine, robot)
    usual = SafetySettings().observation_time
    # Updates that are rarer than that are no gap.
    safety = SafetySettings(observation_time=max(usual, MISSED / rate))
    return SafetyFilter(sequencer, robot, safety)


def _shortfall(run: DrivenRun) -> Trouble | None:
    return run.commands.shortfall(run) if isinstance(run.commands, _Waypoints) else None


def _check_prescribed(scenario: Scenario, controller: Controller) -> None:
    """Refuse prescribed joints on ground that the controller does not know.

    They do not yield, so that feet which meet the ground early strike it with any force.
    """
    if scenario.simulation.drive != "prescribed" or scenario.load_terrain().is_level:
        return
    if isinstance(controller, Player) and scenario.terrain.planned_on == "terrain":
        return
    raise InvalidInput(
        f'drive is "prescribed" on terrain "{scenario.terrain.kind}"; joints that do not yield '
        "need a plan that knows the ground.",
        hint='drive = "servo" or "ideal-servo"',
    )


def _with_delays(scenario: Scenario) -> Scenario:
    """The scenario, with sensors whose readings arrive a time step late at the earliest."""
    table, dt = scenario.sensors, scenario.simulation.dt
    delays = {f"{sensor}_delay": getattr(table, f"{sensor}_delay") for sensor in SENSORS}
    short = {name: dt for name, delay in delays.items() if delay < dt}
    return scenario.replace(**short) if short and table.measured == "everything" else scenario


class _Waypoints:
    """Commands that lead to a script's waypoints, by the true pose."""

    def __init__(self, script: CommandScript) -> None:
        self.script, self.follower = script, Follower(script)

    def __call__(
        self, time: float, observation: Observation, pose: tuple[float, float, float]
    ) -> Command | None:
        del observation
        return self.follower.command(time, pose)

    def shortfall(self, run: DrivenRun) -> Trouble | None:
        """Return why a run that came to its end is incomplete; None where it is complete."""
        count, reached = len(self.script.waypoint), len(self.follower.reached)
        if reached == count:
            return None
        reason = (
            f"by {min(run.step, run.steps) * run.dt:.4g} s: {reached} of {count} reached, waypoint "
            f"{reached + 1} is {self.follower.remaining}. Try a longer --duration"
        )
        return Trouble(Ending.INCOMPLETE, run.step, reason)

    def attributes(self) -> Attributes:
        """Return the waypoints for a recording, each with the time at which it was reached."""
        count = len(self.script.waypoint)
        times = [*self.follower.reached, *[None] * count][:count]
        rows = [
            {"x": place.x, "y": place.y, "heading": place.heading, "reached": time}
            for place, time in zip(self.script.waypoint, times, strict=True)
        ]
        return {"waypoints": json.dumps(rows)}


def _asking(commands: Commanded) -> Commands:
    """What a caller commands, as a function that begins anew.

    Raises:
        InvalidInput: It commands nothing.
    """
    if isinstance(commands, Command):
        return lambda *_: commands
    if isinstance(commands, CommandScript):
        if commands.waypoint:
            return _Waypoints(commands)
        return lambda time, *_: commands.at(time)
    if not callable(commands):
        raise InvalidInput(
            f"commands is {described(commands)}; it must be a Command, a CommandScript, or a "
            "function of time and observation that returns a Command.",
            hint="phasmid.control.Command(velocity=(0.1, 0, 0))",
        )
    return lambda time, observation, _: commands(time, observation)
