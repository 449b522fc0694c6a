"""Closed-loop runs: a controller drives the simulated robot by commands."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from phasmid.arguments import checked
from phasmid.control import (
    CommandScript,
    EngineSettings,
    LocomotionEngine,
    Player,
    SafetyFilter,
    SafetySettings,
    Sequencer,
)
from phasmid.control.estimation import EstimatorSettings
from phasmid.control.sequences import packing
from phasmid.errors import InvalidInput, plain
from phasmid.experiment import Command, Controller, Experiment, ScenarioLike, built
from phasmid.experiment.sensors import SENSORS
from phasmid.motion import Motion
from phasmid.recording import Recording
from phasmid.recording.recording import Attributes
from phasmid.robot import Robot
from phasmid.simulation.closed_loop import ClosedLoopRun, Commanded, period_steps
from phasmid.simulation.faults import Faults
from phasmid.simulation.run import Progress
from phasmid.simulation.start import check_start, standing, with_time_step

MISSED_PERIODS = 2.5
"""Periods without an observation that the safety monitor tolerates at least."""

OWN, ENGINE, PLAYER = "scenario's own", "locomotion engine", "player"
"""Recorded names of the controllers that a replay can make again."""


@checked
def drive(
    scenario: ScenarioLike | Experiment,
    controller: Controller | None = None,
    commands: Commanded = Command(),  # noqa: B008, a frozen value
    *,
    rate: float = 200.0,
    faults: Sequence[str] = (),
    progress: Progress | None = None,
    log: str | Path | None = None,
    force: bool = False,
) -> Recording:
    """Let a controller drive the simulated robot in closed loop.

    The robot starts at rest on its feet, at the start of the controller's attribute ``motion`` if
    it has one, else at neutral. The controller receives observations and returns targets at a
    fixed rate. Ctrl-C ends the run and raises KeyboardInterrupt; what was recorded until then is
    kept in the log, if there is one.

    Args:
        scenario: The scenario, or its experiment; its duration is the longest.
        controller: The controller; None: the locomotion engine with the scenario's gait, period
            and step height, with posture sequences and safety, see `scenario_controller`.
        commands: A command, a script, or a function of time and observation. Waypoints of a script
            are followed by the robot's true pose, or by the estimated one where the scenario's
            ``body_state`` is "estimated".
        rate: Updates per second [1/s]; a period must be a whole number of time steps.
        faults: What fails, and when: sentences such as ``right_middle.tibia dead at 5 s``; see
            `phasmid.simulation.faults`.
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
        KeyboardInterrupt: The run was stopped by Ctrl-C.
        OutputError: The log cannot be written; what it holds until then can be read.
    """
    run = new_drive(scenario, controller, commands, rate=rate, faults=faults)
    return run.make(progress=progress, log=log, force=force)


def check_drive(
    scenario: ScenarioLike | Experiment, *, rate: float, faults: Sequence[str] = ()
) -> Faults:
    """Refuse what no controller could change, and return the faults of its robot.

    Raises:
        InvalidInput: As in `drive`.
    """
    experiment = built(scenario)
    period_steps(experiment, rate)
    if experiment.world.contact.kind == "simscape":
        raise InvalidInput(
            'contact_law is "simscape"; its simulator follows plans and takes no controller.',
            hint='contact_law = "spring-damper"',
        )
    return Faults(experiment.robot, faults, experiment.sensors.touching_force(experiment.scale))


def new_drive(
    scenario: ScenarioLike | Experiment,
    controller: Controller | None,
    commands: Commanded,
    *,
    rate: float = 200.0,
    faults: Sequence[str] = (),
    endless: bool = False,
) -> ClosedLoopRun:
    """Return a closed-loop run before its first step.

    Arguments and errors as in `drive`; an endless run goes on for as long as it is advanced.
    """
    experiment = built(scenario).driven()
    checked = check_drive(experiment, rate=rate, faults=faults)
    if isinstance(commands, CommandScript):
        commands.check_legs(len(experiment.robot.legs))
    if controller is None:
        controller = scenario_controller(experiment, rate)
    _check_engine(experiment, controller)
    _check_prescribed(experiment, controller)
    begin = _begin(experiment, controller)
    experiment = with_time_step(experiment, begin, 1 / rate)
    check_start(experiment, begin)
    attributes: dict[str, str | int | float] = {
        **_controller_attributes(controller, rate),
        "control_rate": float(rate),
        "faults": json.dumps(list(checked.texts)),
    }
    table = experiment.sensors
    if table.measured == "everything":
        # A reading of a step arrives after it.
        delays = {name: getattr(table, name) for name in (f"{s}_delay" for s in SENSORS)}
        least = experiment.solver.time_step
        experiment = experiment.replace(**{name: max(each, least) for name, each in delays.items()})
    return ClosedLoopRun(
        experiment,
        begin,
        controller,
        commands,
        rate=rate,
        faults=checked,
        attributes=attributes,
        endless=endless,
    )


def _begin(experiment: Experiment, controller: Controller) -> Motion:
    """Return the motion at whose first instant the robot begins."""
    motion: Motion | None = getattr(controller, "motion", None)
    if motion is not None:
        return motion.for_experiment(experiment)
    robot, packed = experiment.robot, experiment.solver.start_posture == "packed"
    return standing(experiment, packing(robot).folded if packed else None)


def scenario_controller(
    scenario: ScenarioLike | Experiment, rate: float, **settings: Any
) -> SafetyFilter:
    """Return the controller of a scenario that is driven without another one.

    It is the locomotion engine with the scenario's robot, gait, period and step height, inside
    posture sequences (standing up, sitting down, legs moved by hand, lost legs), inside safety.
    With a depth sensor it plans its footholds on a height map.
    It is updated at a rate [1/s]; other settings of the engine are those of `EngineSettings`.

    Raises:
        InvalidInput: The robot cannot walk so.
    """
    experiment = built(scenario)
    period_steps(experiment, rate)
    robot, stride = experiment.robot, experiment.course.stride
    own: dict[str, Any] = {
        "gait": experiment.course.gait,
        "period": stride.period,
        "step_height": stride.step_height,
        "update_period": 1 / rate,
        "gravity": experiment.world.gravity,
    }
    sensors = experiment.sensors
    if sensors.depth != "none":
        delay = 0.0 if sensors.depth == "exact" else sensors.depth_delay
        own |= {"terrain_map": "points", "estimator": EstimatorSettings(depth_delay=delay)}
    return _in_safety(LocomotionEngine(robot, **(own | settings)), robot, rate)


def _in_safety(engine: LocomotionEngine, robot: Robot, rate: float) -> SafetyFilter:
    return SafetyFilter(Sequencer(engine, robot), robot, _safety(rate, engine.settings.gravity))


def _safety(rate: float, gravity: float) -> SafetySettings:
    patience = max(SafetySettings().observation_time, MISSED_PERIODS / rate)
    return SafetySettings(observation_time=patience, gravity=gravity)


# Controllers in recordings ------------------------------------------------------------------------


def _controller_attributes(controller: Controller, rate: float) -> dict[str, str]:
    """Return a controller's name and settings, as attributes of a recording."""
    inner: Any = controller
    safety = inner.monitor.settings if type(inner) is SafetyFilter else None
    if safety is not None and safety == _safety(rate, safety.gravity):
        inner = inner.controller
        inner = inner.walker if type(inner) is Sequencer else controller
    if type(inner) is LocomotionEngine:
        settings = TypeAdapter(EngineSettings).dump_python(inner.settings, mode="json")
        name = ENGINE if inner is controller else OWN
        return {"controller": name, "controller_settings": json.dumps(settings)}
    if type(inner) is Player:
        settings = {"rate": inner.rate, "lead": inner.lead}
        return {"controller": PLAYER, "controller_settings": json.dumps(settings)}
    kind = type(controller)
    return {"controller": f"{kind.__module__}.{kind.__qualname__}"}


def recorded_controller(
    attributes: Attributes, experiment: Experiment, motion: Callable[[], Motion]
) -> Controller:
    """Return the controller of a recorded run.

    Args:
        attributes: Of the recording.
        experiment: Of the recording.
        motion: Returns the motion of a player.

    Raises:
        InvalidInput: It is none of phasmid's, or not well formed.
    """
    name, robot = str(attributes["controller"]), experiment.robot
    text = str(attributes.get("controller_settings", ""))
    try:
        if name == PLAYER:
            return Player(motion(), **json.loads(text))
        if name in (OWN, ENGINE):
            engine = LocomotionEngine(robot, TypeAdapter(EngineSettings).validate_json(text))
            rate = float(attributes["control_rate"])
            return engine if name == ENGINE else _in_safety(engine, robot, rate)
    except (ValueError, TypeError):
        pass
    raise InvalidInput(
        f"the run was driven by {plain(name)}, which a recording does not hold; it cannot be "
        "run again.",
        hint="phasmid.drive with that controller",
    )


def _check_engine(experiment: Experiment, controller: Controller) -> None:
    """Refuse a locomotion engine of another gravity or other servos than the scenario has."""
    inner: Any = controller
    while not isinstance(inner, LocomotionEngine):
        inner = getattr(inner, "controller", None) or getattr(inner, "walker", None)
        if inner is None:
            return
    servo, gravity = experiment.robot.servo, experiment.world.gravity
    if inner.settings.gravity != gravity:
        raise InvalidInput(
            f"the engine has a gravity of {inner.settings.gravity:g} m/s²; the scenario has "
            f"{gravity:g}.",
            hint="LocomotionEngine(scenario.load_robot(), gravity=scenario.model.gravity)",
        )
    limits = [(one.stall_torque, one.no_load_speed) for one in (inner.robot.servo, servo)]
    if limits[0] != limits[1]:
        (torque, speed), (own_torque, own_speed) = limits
        raise InvalidInput(
            f"the engine's servos give {torque:.3g} N·m and {speed:.3g} rad/s; those of the "
            f"scenario, at {servo.voltage:g} V, give {own_torque:.3g} N·m and {own_speed:.3g} "
            "rad/s.",
            hint="LocomotionEngine(scenario.load_robot())",
        )


def _check_prescribed(experiment: Experiment, controller: Controller) -> None:
    """Refuse prescribed joints on ground that the controller does not estimate.

    They do not yield: feet that touch down early would hit the ground with any force.
    """
    if experiment.solver.drive != "prescribed" or experiment.world.terrain.is_level:
        return
    if isinstance(controller, Player) and experiment.world.is_planned:
        return
    raise InvalidInput(
        f'drive is "prescribed" on terrain "{experiment.world.kind}"; joints that do not yield '
        "need a plan that follows the ground.",
        hint='drive = "ideal-servo", or drive = "servo"',
    )
