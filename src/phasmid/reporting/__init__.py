"""From a recording to numbers, figures and a run's folder."""

from phasmid.reporting.catalogue import CATALOGUE, FigureKind, can_be_plotted, figures, plot
from phasmid.reporting.data_file import check_export, export
from phasmid.reporting.drawing import draw_robot, walk_picture
from phasmid.reporting.film.video import check_video, save_video
from phasmid.reporting.run import Run, Source, read_run
from phasmid.reporting.run_folder import check_folder, report
from phasmid.reporting.summary import Summary, summarise
from phasmid.reporting.text import print_summary

__all__ = [
    "CATALOGUE",
    "FigureKind",
    "Run",
    "Source",
    "Summary",
    "can_be_plotted",
    "check_export",
    "check_folder",
    "check_video",
    "draw_robot",
    "export",
    "figures",
    "plot",
    "print_summary",
    "read_run",
    "report",
    "save_video",
    "summarise",
    "walk_picture",
]
