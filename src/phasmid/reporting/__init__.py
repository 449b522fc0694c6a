"""From a recording to numbers, figures and a run's folder."""

from phasmid.reporting.drawing import draw_robot, walk_picture
from phasmid.reporting.figures import (
    figures,
    normal_force_figure,
    save_figures,
    torque_figure,
    trajectory_figure,
)
from phasmid.reporting.run_folder import check_folder, report
from phasmid.reporting.source import Source, read_source
from phasmid.reporting.summary import Summary, summarise
from phasmid.reporting.text import print_summary

__all__ = [
    "Source",
    "Summary",
    "check_folder",
    "draw_robot",
    "figures",
    "normal_force_figure",
    "print_summary",
    "read_source",
    "report",
    "save_figures",
    "summarise",
    "torque_figure",
    "trajectory_figure",
    "walk_picture",
]
