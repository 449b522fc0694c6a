"""One experiment: a robot as supplied, its world, its course, and how it is computed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from phasmid.arguments import NOUNS
from phasmid.experiment.analysis import Analysis
from phasmid.experiment.contact_law import ContactLaw
from phasmid.experiment.course import Course
from phasmid.experiment.sensors import Sensors
from phasmid.experiment.solver import Solver
from phasmid.robot import Robot
from phasmid.robot.similarity import Scale
from phasmid.terrain import Ground


class ScenarioLike(Protocol):
    """What experiments are built from: `phasmid.scenario.Scenario`."""

    @property
    def name(self) -> str:
        """Its short name."""

    def replace(self, **changes: Any) -> ScenarioLike:
        """Return it with other values, by the keys of scenario files."""

    def build(self) -> Experiment:
        """Return the experiment."""

    def text(self) -> str:
        """Return it as a scenario file, whose robot is ``robot.toml``."""


NOUNS[ScenarioLike] = "a Scenario", "Scenario objects"


@dataclass(frozen=True)
class World:
    """What a robot walks on.

    Attributes:
        terrain: The ground.
        planned_terrain: The ground as the plan knows it: `terrain`, or level ground.
        kind: Kind of the terrain, for messages.
        contact: How the ground holds the robot's feet.
        gravity: Acceleration of free fall [m/s²].
    """

    terrain: Ground
    planned_terrain: Ground
    kind: str
    contact: ContactLaw
    gravity: float

    @property
    def is_planned(self) -> bool:
        """True if the plan follows the ground as it is."""
        return self.planned_terrain is self.terrain


@dataclass(frozen=True, eq=False)
class Experiment:
    """All that a plan, an analysis, a simulation or a drive needs, composed and checked.

    `phasmid.Scenario.build` makes it, and nothing else does: a change goes through `replace`, and
    all that depends on a value follows it.

    Attributes:
        name: Short name, also of its result folder.
        duration: Length of the walk [s].
        robot: The robot as supplied: with variants and payload, and its servos with their
            settings, supply and air.
        file_robot: The robot as in its file, with the servo that a scenario names.
        payload: Mass that the robot carries, part of `robot` [kg].
        scale: The robot relative to ``phantomx-ax``, without payload.
        world: Ground, contact law and gravity.
        course: Gait, stride and footing.
        solver: Drive, time step and start.
        sensors: Sensors of the robot and their quality.
        analysis: Options of the analysis.
        source: What it was built from.
    """

    name: str
    duration: float
    robot: Robot
    file_robot: Robot
    payload: float
    scale: Scale
    world: World
    course: Course
    solver: Solver
    sensors: Sensors
    analysis: Analysis
    source: ScenarioLike

    def replace(self, **changes: Any) -> Experiment:
        """Return this experiment with other values, by the keys of scenario files.

        Raises:
            InvalidInput: There is no such key, or the value is refused.
        """
        return self.source.replace(**changes).build() if changes else self

    def driven(self) -> Experiment:
        """Return this experiment with the drive of a driven robot.

        Where no drive is named, the robot's own servos move the joints: ``servo``, or
        ``ideal-servo`` where the servo's stall current is unknown, or joints differ.
        """
        return self if self.solver.drive else self.replace(drive=usual_drive(self.robot))


def usual_drive(robot: Robot) -> str:
    """Return the drive by which a driven robot's own servos move its joints."""
    known = robot.servo.stall_current is not None and robot.has_equal_servos
    return "servo" if known else "ideal-servo"


def built(scenario: ScenarioLike | Experiment) -> Experiment:
    """Return an experiment as it is, or that of a scenario."""
    return scenario if isinstance(scenario, Experiment) else scenario.build()
