"""Types that storeys of phasmid pass to each other: observations, commands, targets, endings."""

from phasmid.experiment.command import Command, LegCommand, Posture
from phasmid.experiment.contact_law import ContactLaw
from phasmid.experiment.controller import Controller
from phasmid.experiment.course import Course, Footing, Stride
from phasmid.experiment.ending import Ending, Failure
from phasmid.experiment.experiment import Experiment, ScenarioLike, World, built, usual_drive
from phasmid.experiment.observation import Observation
from phasmid.experiment.sensors import Sensors
from phasmid.experiment.solver import Solver
from phasmid.experiment.targets import JointTargets

__all__ = [
    "Command",
    "ContactLaw",
    "Controller",
    "Course",
    "Ending",
    "Experiment",
    "Failure",
    "Footing",
    "JointTargets",
    "LegCommand",
    "Observation",
    "Posture",
    "Sensors",
    "Solver",
    "ScenarioLike",
    "Stride",
    "World",
    "built",
    "usual_drive",
]
