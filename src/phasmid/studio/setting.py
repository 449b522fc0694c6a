"""Setting of the live robot: one value, valid from construction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any, Literal

from phasmid.advice import servo_verdict
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.experiment import Experiment, usual_drive
from phasmid.formats import ImportOptions, load_robot
from phasmid.gait import Gait, gaits_of
from phasmid.kinematics import body_height
from phasmid.robot import Robot, preset_names
from phasmid.scenario import Scenario, with_robot
from phasmid.units import rounded_down

Walks = Literal["by itself", "by hand", "the plan"]
"""Source of the commands."""

LOCOMOTION = "locomotion controller"
"""Choice of the controller that is no learned policy."""

MOST_PAYLOAD = 2.0
"""Largest payload, in masses of the robot."""

SHORTEST_STEP = 1e-4
"""Least time step [s]: one second takes about one second to simulate on two shared cores."""

MOST_PLANNED = 50_000
"""Most samples of a planned walk: on uneven ground they take about five seconds to plan."""


@dataclass(frozen=True)
class Setting:
    """Robot, ground and walk.

    Attributes:
        scenario: Experiment; its robot is the name of a preset, or a `Robot` from a file.
        walks: Source of the commands.
        controller: The locomotion controller, or the name of a learned policy.
        pose: Displacement of the body: forward, left, up [m], roll, pitch, yaw [rad].
        ground_sensing: True if the robot senses the ground.
        robots: Robots from files, by the files' names.
        grounds: Height maps from files, by the files' names, as a scenario names them.

    Raises:
        InvalidInput: Robot, gait or a number is invalid, or they do not fit together.
    """

    scenario: Scenario
    walks: Walks = "by itself"
    controller: str = LOCOMOTION
    pose: tuple[float, float, float, float, float, float] = (0.0,) * 6
    ground_sensing: bool = True
    robots: Mapping[str, Robot] = field(default_factory=dict)
    grounds: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # Limits of what builds while someone waits for a page.
        scenario, stride = self.scenario, self.experiment.course.stride
        if scenario.simulation.time_step < SHORTEST_STEP:
            raise InvalidInput(
                f"dt is {scenario.simulation.time_step:g} s; in the studio it must be at least "
                f"{SHORTEST_STEP:g} s, so that it keeps up with real time.",
                hint="dt = 0.001",
            )
        samples = scenario.duration / stride.period * stride.samples
        if self.walks == "the plan" and samples > MOST_PLANNED:
            raise InvalidInput(
                f"the plan has {samples:.3g} samples; in the studio it must have at most "
                f"{float(MOST_PLANNED):g}.",
                hint=f"duration = {rounded_down(MOST_PLANNED * stride.period / stride.samples)}",
            )
        most = MOST_PAYLOAD * self.base.mass
        if scenario.model.payload > most:
            raise InvalidInput(
                f"payload is {scenario.model.payload:g} kg; it must be at most {most:.3g} kg, "
                f"{MOST_PAYLOAD:g} times the robot.",
                hint=f"{most / 4:.2g} kg",
            )

    @cached_property
    def base(self) -> Robot:
        """Robot of the file or preset."""
        robot = self.scenario.robot
        return _preset(robot) if isinstance(robot, str) else robot

    @cached_property
    def experiment(self) -> Experiment:
        """The experiment with the simulated robot."""
        return self.scenario.build()

    @property
    def robot(self) -> Robot:
        """Simulated robot, as supplied."""
        return self.experiment.robot

    @cached_property
    def servo_verdict(self) -> dict[str, Any] | None:
        """Verdict on the servos, as all commands give it; None for a robot that cannot stand."""
        try:
            return servo_verdict(self.experiment).as_dict()
        except PhasmidError:
            return None

    @property
    def gait(self) -> Gait:
        """Gait schedule."""
        return self.experiment.course.gait

    @property
    def height(self) -> float:
        """Height of the hips over the ground at the neutral stance [m]."""
        return body_height(self.robot)

    @property
    def robot_name(self) -> str:
        """Name of the preset or the file."""
        robot = self.scenario.robot
        if isinstance(robot, str):
            return robot
        return next((name for name, known in self.robots.items() if known is robot), robot.name)

    @property
    def terrain_name(self) -> str:
        """Kind of the ground, or name of its file."""
        table = self.scenario.terrain
        if table.kind != "height-map":
            return table.kind
        known = (name for name, text in self.grounds.items() if text == table.height_map)
        return next(known, table.kind)

    def built_of(self) -> tuple[Any, ...]:
        """Return all that a run is built of; settings that share it share the run."""
        scenario, plans = self.scenario, self.walks == "the plan"
        built: list[Any] = [scenario.robot, self.ground_sensing, plans]
        built += [self.controller]
        built += [scenario.simulation, scenario.contact, scenario.terrain, scenario.servo]
        built += [scenario.stride.stance_radius, scenario.stride.body_height]
        built += [scenario.model.model_copy(update={"force_model": "minimum-norm"})]
        if plans:
            built += [scenario.gait, scenario.stride, scenario.footing]
        return tuple(built)

    def with_robot(self, robot: str | Robot) -> Setting:
        """Return the setting with another robot, in its own stance, period and contact.

        A gait for another number of legs becomes the robot's default.

        Args:
            robot: Name of a preset, or the robot.
        """
        base = _preset(robot) if isinstance(robot, str) else robot
        scenario = self.scenario.for_robot(robot)
        changes: dict[str, Any] = {"stance_radius": None, "body_height": None}
        changes["payload"] = min(self.scenario.model.payload, MOST_PAYLOAD * base.mass)
        if self.scenario.simulation.drive == "servo":
            # Not every robot has servos of one known law.
            changes["drive"] = usual_drive(scenario.base_robot())
        others = len(base.legs) != len(self.base.legs)
        if others and self.gait.name not in gaits_of(len(base.legs)):
            changes["gait"] = None
        return replace(self, scenario=scenario.replace(**changes), pose=(0.0,) * 6)


@cache
def policies() -> tuple[str, ...]:
    """Return the names of the learned policies; none without the extra ``learn``."""
    try:
        from phasmid.learning import policy_names
    except InvalidInput:
        return ()
    return policy_names()


@cache
def _preset(name: str) -> Robot:
    return load_robot(name)


def setting_of(scenario: Scenario) -> Setting:
    """Return the initial setting of a scenario.

    Observations are true: sensor noise is drawn for a run of known length.

    Args:
        scenario: Scenario; a robot file that it names is read.

    Raises:
        InvalidInput: Its robot or gait is invalid.
    """
    robots: dict[str, Robot] = {}
    if isinstance(scenario.robot, str) and scenario.robot not in preset_names():
        name = scenario.robot.replace("\\", "/").rpartition("/")[2]
        robots[name] = with_robot(scenario).replace(servo=None).base_robot()
        # Its import is done: a saved scenario must not name files that were needed for it.
        changes = {"robot": robots[name], "robot_import": ImportOptions()}
        scenario = scenario.model_copy(update=changes)
    elif isinstance(scenario.robot, Robot):
        robots[scenario.robot.name] = scenario.robot
    return Setting(scenario.driven().replace(measured="nothing"), robots=robots)
