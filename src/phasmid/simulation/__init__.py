"""What physics makes of a walk."""

from phasmid.simulation.contact import CONTACT_POINTS
from phasmid.simulation.drive import DriveExperiment, check_drive, drive
from phasmid.simulation.experiment import (
    check_load,
    new_run,
    record,
    simulate,
    with_sensors,
)
from phasmid.simulation.faults import Fault
from phasmid.simulation.many import simulate_many
from phasmid.simulation.model import build_model
from phasmid.simulation.refinement import Refinement, time_step_refinement
from phasmid.simulation.rerun import Difference, Replay, replay
from phasmid.simulation.run import Run
from phasmid.simulation.termination import Ending
from phasmid.simulation.time_step import check_time_step, longest_time_step

__all__ = [
    "CONTACT_POINTS",
    "Difference",
    "DriveExperiment",
    "check_drive",
    "Ending",
    "Fault",
    "Refinement",
    "Replay",
    "Run",
    "build_model",
    "check_load",
    "check_time_step",
    "drive",
    "longest_time_step",
    "new_run",
    "record",
    "replay",
    "simulate",
    "simulate_many",
    "time_step_refinement",
    "with_sensors",
]
