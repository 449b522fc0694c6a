"""All that a person can set of the live robot, as one value that cannot be wrong."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any, Literal, get_args

from phasmid.errors import InvalidInput, PhasmidError
from phasmid.forces import scenario_verdict
from phasmid.formats import load_robot, with_robot
from phasmid.gait import Gait, gaits_of
from phasmid.kinematics import neutral_feet
from phasmid.robot import Robot, load_servo, preset_names, with_payload
from phasmid.scenario import Scenario
from phasmid.scenario.robot_import import RobotImportTable

Walks = Literal["by itself", "by hand", "the plan"]
"""Who decides where the robot goes."""

OWN_SERVO = "the robot's own"
"""Stands for the servo that the robot's file names."""

MOST_PAYLOAD = 2.0
"""Heaviest load, in masses of the robot without one."""

SHORTEST_STEP = 1e-4
"""Least time step [s]: one second takes about one second to simulate on two shared cores."""

MOST_PLANNED = 50_000
"""Most samples of a planned walk: on uneven ground they take about five seconds to plan."""


@dataclass(frozen=True)
class Setting:
    """What is simulated, and what the robot is asked to do.

    Attributes:
        scenario: The experiment; its robot is a preset's name, or a `Robot` from a file.
        walks: Who decides where the robot goes.
        servo: Name of a servo that all joints have in place of the robot's own.
        payload: Mass on the trunk [kg].
        pose: Of the body beside where it stands or walks: ahead, left, up [m], roll, pitch,
            yaw [rad].
        ground_sensing: Whether the robot senses the ground.
        robots: Robots from files, by the files' names.
        grounds: Height maps from files, by the files' names, as a scenario names them.

    Raises:
        InvalidInput: A robot, a gait or a number is none, or they do not go together.
    """

    scenario: Scenario
    walks: Walks = "by itself"
    servo: str = OWN_SERVO
    payload: float = 0.0
    pose: tuple[float, float, float, float, float, float] = (0.0,) * 6
    ground_sensing: bool = True
    robots: Mapping[str, Robot] = field(default_factory=dict)
    grounds: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.walks not in get_args(Walks):
            must = ", ".join(get_args(Walks))
            raise InvalidInput(f'walks is "{self.walks}"; it must be one of {must}.')
        self._check_size()
        most = MOST_PAYLOAD * self.base.mass
        if self.payload > most:
            raise InvalidInput(
                f"payload is {self.payload:g} kg; it must be at most {most:.3g} kg, "
                f"{MOST_PAYLOAD:g} times the robot.",
                hint=f"{most / 4:.2g} kg",
            )
        # The gait must be one of this robot, and a machine have these numbers.
        self.gait, self.machine  # noqa: B018, they are computed

    def _check_size(self) -> None:
        """Refuse what would take longer to build than somebody waits for a page."""
        scenario, stride = self.scenario, self.scenario.stride
        if scenario.simulation.dt < SHORTEST_STEP:
            raise InvalidInput(
                f"dt is {scenario.simulation.dt:g} s; in the studio it must be at least "
                f"{SHORTEST_STEP:g} s, so that it keeps up with real time.",
                hint="--dt 0.001",
            )
        samples = scenario.duration / stride.period * stride.samples
        if self.walks == "the plan" and samples > MOST_PLANNED:
            raise InvalidInput(
                f"the plan has {samples:.3g} samples; in the studio it must have at most "
                f"{float(MOST_PLANNED):g}.",
                hint="a shorter duration, or fewer samples per cycle",
            )

    @cached_property
    def base(self) -> Robot:
        """The robot as its file gives it."""
        robot = self.scenario.robot
        return _preset(robot) if isinstance(robot, str) else robot

    @cached_property
    def machine(self) -> Scenario:
        """The scenario with its robot as it is simulated: with other servos, and a load."""
        robot = self.base
        if self.servo != OWN_SERVO:
            robot = replace(robot, servo=load_servo(self.servo))
        return self.scenario.replace(robot=with_payload(robot, self.payload))

    @cached_property
    def robot(self) -> Robot:
        """The robot as it is simulated, with the scenario's variants of it."""
        return self.machine.load_robot()

    @cached_property
    def servo_verdict(self) -> dict[str, Any] | None:
        """Whether the servos hold the robot, as all commands say it; None where it cannot stand."""
        try:
            return scenario_verdict(self.machine).as_dict()
        except PhasmidError:
            return None

    @cached_property
    def gait(self) -> Gait:
        """Which legs stand, when."""
        return self.scenario.load_gait(len(self.base.legs), self.base.leg_names)

    @property
    def height(self) -> float:
        """Of the hips over the neutral feet [m]."""
        return -float(neutral_feet(self.robot)[:, 2].mean())

    @property
    def robot_name(self) -> str:
        """Of the preset, or of the file that the robot is from."""
        robot = self.scenario.robot
        if isinstance(robot, str):
            return robot
        return next((name for name, known in self.robots.items() if known is robot), robot.name)

    @property
    def terrain_name(self) -> str:
        """The kind of the ground, or the name of the file that it is from."""
        table = self.scenario.terrain
        if table.kind != "height-map":
            return table.kind
        known = (name for name, text in self.grounds.items() if text == table.height_map)
        return next(known, table.kind)

    def built_of(self) -> tuple[Any, ...]:
        """All that a run is built of: where it is the same, another setting needs no new run."""
        scenario, plans = self.scenario, self.walks == "the plan"
        built: list[Any] = [scenario.robot, self.servo, self.payload, self.ground_sensing, plans]
        built += [scenario.simulation, scenario.contact, scenario.terrain, scenario.servo]
        built += [scenario.stride.stance_radius, scenario.stride.body_height]
        built += [scenario.model.model_copy(update={"force_model": "minimum-norm"})]
        if plans:
            built += [scenario.gait, scenario.stride, scenario.footing]
        return tuple(built)

    def with_robot(self, robot: str | Robot) -> Setting:
        """The setting with another robot, standing as its own file says.

        A gait that the robot has not becomes the first of its own.

        Args:
            robot: A preset's name, or the robot.
        """
        base = _preset(robot) if isinstance(robot, str) else robot
        changes: dict[str, Any] = {"robot": robot, "stance_radius": None, "body_height": None}
        if self.scenario.simulation.drive == "servo" and base.servo.stall_current is None:
            # The servo's own law needs its stall current.
            changes["drive"] = "ideal-servo"
        known = gaits_of(len(base.legs))
        same = len(base.legs) == len(self.base.legs)
        if known and not same and self.scenario.gait.name not in known:
            changes["gait"] = next(iter(known))
        elif known and not same:
            changes["gait"] = self.scenario.gait.name
        return replace(
            self,
            scenario=self.scenario.replace(**changes),
            payload=min(self.payload, MOST_PAYLOAD * base.mass),
            pose=(0.0,) * 6,
        )


@cache
def _preset(name: str) -> Robot:
    return load_robot(name)


def setting_of(scenario: Scenario) -> Setting:
    """The setting with which a scenario begins.

    Sensors are taken for true: noise is drawn for a run of known length, and this one has no end.

    Args:
        scenario: A scenario; a robot's file that it names is read.

    Raises:
        InvalidInput: Its robot or gait is none.
    """
    robots: dict[str, Robot] = {}
    if isinstance(scenario.robot, str) and scenario.robot not in preset_names():
        name = scenario.robot.replace("\\", "/").rpartition("/")[2]
        robots[name] = with_robot(scenario).base_robot()
        # Its import is done, so that a saved scenario names no file that was needed for it.
        changes = {"robot": robots[name], "robot_import": RobotImportTable()}
        scenario = scenario.model_copy(update=changes)
    elif isinstance(scenario.robot, Robot):
        robots[scenario.robot.name] = scenario.robot
    return Setting(scenario.driven().replace(measured="nothing"), robots=robots)
