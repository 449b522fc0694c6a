"""Model, simulate and control walking robots with four, six or more legs.

The names of this module load when they are first used, so that importing phasmid loads no engine,
plotting or web code.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from phasmid.advice import advise
    from phasmid.control import LocomotionEngine
    from phasmid.errors import (
        InfeasibleLoad,
        InfeasibleWalk,
        InvalidGait,
        InvalidInput,
        InvalidRobot,
        OutputError,
        PhasmidError,
        Unreachable,
    )
    from phasmid.forces import analyse
    from phasmid.formats import (
        ImportOptions,
        import_robot,
        load_robot,
        load_scenario,
        save_robot,
    )
    from phasmid.gait import Gait
    from phasmid.motion import JointTrajectory, Walk, load_trajectory, plan
    from phasmid.recording import load_recording, save_mcap, save_recording
    from phasmid.reporting import export, plot, report, summarise
    from phasmid.robot import Body, Leg, Link, Robot, Servo
    from phasmid.scenario import Scenario
    from phasmid.sensors import sense
    from phasmid.simulation import replay, simulate, simulate_many
    from phasmid.simulation.drive import drive
    from phasmid.studies import load_study, study
    from phasmid.verification import verify
    from phasmid.video import save_video

    __version__: str

_PACKAGE_OF = {
    "Body": "robot",
    "Gait": "gait",
    "ImportOptions": "formats",
    "InfeasibleLoad": "errors",
    "InfeasibleWalk": "errors",
    "InvalidGait": "errors",
    "InvalidInput": "errors",
    "InvalidRobot": "errors",
    "JointTrajectory": "motion",
    "Leg": "robot",
    "Link": "robot",
    "LocomotionEngine": "control",
    "OutputError": "errors",
    "PhasmidError": "errors",
    "Robot": "robot",
    "Scenario": "scenario",
    "Servo": "robot",
    "Unreachable": "errors",
    "Walk": "motion",
    "advise": "advice",
    "analyse": "forces",
    "drive": "simulation",
    "export": "reporting",
    "import_robot": "formats",
    "load_recording": "recording",
    "load_robot": "formats",
    "load_scenario": "formats",
    "load_study": "studies",
    "load_trajectory": "motion",
    "plan": "motion",
    "plot": "reporting",
    "replay": "simulation",
    "report": "reporting",
    "save_mcap": "recording",
    "save_recording": "recording",
    "save_robot": "formats",
    "save_video": "video",
    "sense": "sensors",
    "simulate": "simulation",
    "simulate_many": "simulation",
    "study": "studies",
    "summarise": "reporting",
    "verify": "verification",
}
_PACKAGES = (
    "control",
    "dynamics",
    "forces",
    "formats",
    "gait",
    "kinematics",
    "motion",
    "robot",
    "simulation",
)

__all__ = [
    "Body",
    "Gait",
    "ImportOptions",
    "InfeasibleLoad",
    "InfeasibleWalk",
    "InvalidGait",
    "InvalidInput",
    "InvalidRobot",
    "JointTrajectory",
    "Leg",
    "Link",
    "LocomotionEngine",
    "OutputError",
    "PhasmidError",
    "Robot",
    "Scenario",
    "Servo",
    "Unreachable",
    "Walk",
    "advise",
    "analyse",
    "drive",
    "export",
    "import_robot",
    "load_recording",
    "load_robot",
    "load_scenario",
    "load_study",
    "load_trajectory",
    "plan",
    "plot",
    "replay",
    "report",
    "save_mcap",
    "save_recording",
    "save_robot",
    "save_video",
    "sense",
    "simulate",
    "simulate_many",
    "study",
    "summarise",
    "verify",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version("phasmid")
    if name in _PACKAGE_OF:
        return getattr(import_module(f"phasmid.{_PACKAGE_OF[name]}"), name)
    if name in _PACKAGES:
        return import_module(f"phasmid.{name}")
    raise AttributeError(f"module 'phasmid' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, *_PACKAGES, "__version__"])
