"""What to do next, in closed loop: observations and commands in, joint targets out."""

from phasmid.control.command import Command, Posture
from phasmid.control.controller import Controller
from phasmid.control.observation import Observation
from phasmid.control.targets import JointTargets

__all__ = ["Command", "Controller", "JointTargets", "Observation", "Posture"]
