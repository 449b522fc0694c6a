"""Types that storeys of phasmid pass to each other: observations, commands, targets, endings."""

from phasmid.experiment.command import Command, LegCommand, Posture
from phasmid.experiment.contact_law import ContactLaw
from phasmid.experiment.controller import Controller
from phasmid.experiment.ending import Ending, Failure
from phasmid.experiment.observation import Observation
from phasmid.experiment.targets import JointTargets

__all__ = [
    "Command",
    "ContactLaw",
    "Controller",
    "Ending",
    "Failure",
    "JointTargets",
    "LegCommand",
    "Observation",
    "Posture",
]
