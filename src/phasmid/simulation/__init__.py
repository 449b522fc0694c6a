"""Simulation of planned walks and of robots in closed loop."""

from phasmid.simulation.contact import CONTACT_POINTS
from phasmid.simulation.drive import DriveExperiment, check_drive, drive
from phasmid.simulation.experiment import (
    Experiment,
    Refinement,
    WalkExperiment,
    check_load,
    new_run,
    simulate,
    simulate_many,
    time_step_refinement,
    with_sensors,
)
from phasmid.simulation.faults import Fault
from phasmid.simulation.model import build_model
from phasmid.simulation.rerun import Difference, Replay, replay
from phasmid.simulation.run import Run
from phasmid.simulation.start import check_time_step, longest_time_step
from phasmid.simulation.termination import Ending

__all__ = [
    "CONTACT_POINTS",
    "Difference",
    "DriveExperiment",
    "Ending",
    "Experiment",
    "Fault",
    "Refinement",
    "Replay",
    "Run",
    "WalkExperiment",
    "build_model",
    "check_drive",
    "check_load",
    "check_time_step",
    "drive",
    "longest_time_step",
    "new_run",
    "replay",
    "simulate",
    "simulate_many",
    "time_step_refinement",
    "with_sensors",
]
