"""What physics makes of a walk."""

from phasmid.simulation.contact import CONTACT_POINTS
from phasmid.simulation.ending import Ending
from phasmid.simulation.model import build_model
from phasmid.simulation.run import Run, check_load, check_time_step, longest_time_step, simulate

__all__ = [
    "CONTACT_POINTS",
    "Ending",
    "Run",
    "build_model",
    "check_load",
    "check_time_step",
    "longest_time_step",
    "simulate",
]
