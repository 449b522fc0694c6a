"""Simulation of planned walks and of robots in closed loop."""

from phasmid.simulation.channels import with_sensors
from phasmid.simulation.contact import CONTACT_POINTS
from phasmid.simulation.drive import check_drive, drive, new_drive
from phasmid.simulation.model import build_model
from phasmid.simulation.model_reference import check_load
from phasmid.simulation.run import Run
from phasmid.simulation.sensors import sense
from phasmid.simulation.start import longest_time_step, with_time_step
from phasmid.simulation.walks import (
    new_run,
    simulate,
    simulate_many,
)

__all__ = [
    "CONTACT_POINTS",
    "Run",
    "build_model",
    "check_drive",
    "check_load",
    "drive",
    "longest_time_step",
    "new_drive",
    "new_run",
    "sense",
    "simulate",
    "simulate_many",
    "with_sensors",
    "with_time_step",
]
