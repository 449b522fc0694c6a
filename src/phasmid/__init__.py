"""Model, simulate and control walking robots with four, six or more legs.

The names of this module load when they are first used, so that importing phasmid loads no engine,
plotting or web code.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from phasmid.advice import advise as advise
    from phasmid.control import LocomotionEngine as LocomotionEngine
    from phasmid.errors import InfeasibleLoad as InfeasibleLoad
    from phasmid.errors import InfeasibleWalk as InfeasibleWalk
    from phasmid.errors import InvalidGait as InvalidGait
    from phasmid.errors import InvalidInput as InvalidInput
    from phasmid.errors import InvalidRobot as InvalidRobot
    from phasmid.errors import OutputError as OutputError
    from phasmid.errors import PhasmidError as PhasmidError
    from phasmid.errors import Unreachable as Unreachable
    from phasmid.forces import analyse as analyse
    from phasmid.formats import ImportOptions as ImportOptions
    from phasmid.formats import import_robot as import_robot
    from phasmid.formats import load_robot as load_robot
    from phasmid.formats import save_robot as save_robot
    from phasmid.gait import Gait as Gait
    from phasmid.identification import compare as compare
    from phasmid.motion import JointTrajectory as JointTrajectory
    from phasmid.motion import Walk as Walk
    from phasmid.motion import load_trajectory as load_trajectory
    from phasmid.motion import plan as plan
    from phasmid.recording import load_recording as load_recording
    from phasmid.recording import save_mcap as save_mcap
    from phasmid.recording import save_recording as save_recording
    from phasmid.reporting import export as export
    from phasmid.reporting import plot as plot
    from phasmid.reporting import report as report
    from phasmid.reporting import save_video as save_video
    from phasmid.reporting import summarise as summarise
    from phasmid.robot import Body as Body
    from phasmid.robot import Leg as Leg
    from phasmid.robot import Link as Link
    from phasmid.robot import Robot as Robot
    from phasmid.scenario import Scenario as Scenario
    from phasmid.scenario import load_scenario as load_scenario
    from phasmid.scenario.rerun import replay as replay
    from phasmid.servo import Servo as Servo
    from phasmid.simulation import sense as sense
    from phasmid.simulation import simulate as simulate
    from phasmid.simulation import simulate_many as simulate_many
    from phasmid.simulation.drive import drive as drive
    from phasmid.studies import load_study as load_study
    from phasmid.studies import study as study

    __version__: str

_NAMES = {
    "advice": "advise",
    "control": "LocomotionEngine",
    "errors": "InfeasibleLoad InfeasibleWalk InvalidGait "
    "InvalidInput InvalidRobot OutputError PhasmidError Unreachable",
    "forces": "analyse",
    "formats": "ImportOptions import_robot load_robot save_robot",
    "gait": "Gait",
    "identification": "compare",
    "motion": "JointTrajectory Walk load_trajectory plan",
    "recording": "load_recording save_mcap save_recording",
    "reporting": "export plot report save_video summarise",
    "robot": "Body Leg Link Robot",
    "scenario": "Scenario load_scenario replay",
    "servo": "Servo",
    "simulation": "drive sense simulate simulate_many",
    "studies": "load_study study",
}
"""Public names by the package that has them."""

_PACKAGES = {*_NAMES, "dynamics", "experiment", "kinematics"}
_PACKAGE_OF = {name: package for package, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version("phasmid")
    if name in _PACKAGE_OF:
        return getattr(import_module(f"phasmid.{_PACKAGE_OF[name]}"), name)
    if name in _PACKAGES:
        return import_module(f"phasmid.{name}")
    raise AttributeError(f"module 'phasmid' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*_PACKAGE_OF, *_PACKAGES, "__version__"])
