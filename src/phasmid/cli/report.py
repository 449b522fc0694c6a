"""``phasmid report``: the result folder, figures or video of recordings."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.figures import FIGURES_ALONE, draw_figures, list_figures
from phasmid.cli.figures import OPTIONS as FIGURE_OPTIONS
from phasmid.cli.options import declare, refuse_given
from phasmid.cli.output import say
from phasmid.cli.walk import (
    REPORT_OPTIONS,
    check_film,
    check_page,
    leg_numbers,
    open_page,
    own_appearance,
    print_report,
    write_film,
    write_report,
)
from phasmid.errors import InvalidInput, plain

if TYPE_CHECKING:
    from phasmid.recording import DamagedRecording, Recording
    from phasmid.robot import Appearance
    from phasmid.scenario import Scenario

OPTIONS = {
    "--out DIR": "result folder; default: the recording's name without its ending; with --figures "
    "their folder; default: plots/NAME",
    **REPORT_OPTIONS,
}

FOLDER_ALONE = ("mcap", "no_figures", "open")
"""Options of a result folder, which --figures does not write."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "recordings",
        nargs="*",
        metavar="RECORDING",
        help="a recording.nc, its folder, or the .mcap of a run, also of an interrupted one; "
        "several are compared by --figures",
    )
    declare(parser.add_argument_group("figures"), FIGURE_OPTIONS)


@contextmanager
def print_damage() -> Iterator[list[DamagedRecording]]:
    """Print the damages of a recording that is read in the body, and yield them."""
    from phasmid.recording import DamagedRecording

    found: list[DamagedRecording] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DamagedRecording)
        yield found
    found += [w.message for w in caught if isinstance(w.message, DamagedRecording)]
    for damage in found:
        say(f"phasmid: {damage}", file=sys.stderr)


def run(options: argparse.Namespace) -> int:
    """Make the result folder or draw the figures, and return the exit status."""
    if options.list_figures:
        list_figures()
        return 0
    _refuse(options)
    from phasmid.recording import load_recording

    paths = [Path(name) for name in options.recordings]
    with print_damage() as damage:
        recordings = [load_recording(path) for path in paths]
    if options.figures is None:
        _make_folder(paths[0], recordings[0], options)
    else:
        check_film(options)
        draw_figures(paths, recordings, options)
        if options.video is not None:
            _, look = _scenario_and_look(paths[0], recordings[0])
            write_film(recordings[0], options, look)
    return 2 if any(found.wrong for found in damage) else 0


def _refuse(options: argparse.Namespace) -> None:
    """Refuse options that do not go together."""
    names = options.recordings
    if not names:
        raise InvalidInput("no recording is named.", hint="phasmid report results/paper")
    if options.figures is None and not all(Path(name).exists() for name in names):
        _refuse_figures(names)
    if len(names) > 1 and options.figures is None:
        every = " ".join(map(plain, names))
        raise InvalidInput(
            "several recordings have no common result folder; figures compare them.",
            hint=f"phasmid report {every} --figures joint-torque",
        )
    if len(names) > 1 and options.video is not None:
        raise InvalidInput(f"a video shows one run; {len(names)} were given.", hint="one recording")
    if options.figures is None:
        refuse_given(options, FIGURES_ALONE, "belongs to --figures, which is missing")
    else:
        refuse_given(options, FOLDER_ALONE, "belongs to a result folder")


def _refuse_figures(names: Sequence[str]) -> None:
    """Refuse names of figures in the place of recordings."""
    # Lazy import: figures take two seconds to import.
    from phasmid.reporting.catalogue import CATALOGUE

    figures = [name for name in names if name in CATALOGUE]
    if figures:
        runs = " ".join(plain(name) for name in names if name not in figures) or "results/paper"
        raise InvalidInput(
            f'"{figures[0]}" is a figure, no recording.',
            hint=f"phasmid report {runs} --figures {','.join(figures)}",
        )


def _make_folder(path: Path, recording: Recording, options: argparse.Namespace) -> None:
    """Make the result folder of a recording, and its video."""
    from phasmid.reporting import check_folder, read_run

    # Only a file has a suffix.
    folder = Path(options.out or (path if path.is_dir() else path.with_suffix("")))
    check_folder(folder, force=options.force)
    check_film(options)
    check_page(options)
    legs = leg_numbers(options.legs, read_run(recording).robot)
    scenario, look = _scenario_and_look(path, recording)
    if "joint_position" in recording and "joint_position_measured" not in recording:
        # Lazy import: the simulation imports the whole controller.
        from phasmid.simulation import with_sensors

        recording = with_sensors(scenario.build(), recording)
    write_report(recording, folder, options, look)
    print_report(recording, folder, options, legs)
    write_film(recording, options, look)
    open_page(folder, options)


def _scenario_and_look(path: Path, recording: Recording) -> tuple[Scenario, Appearance | None]:
    """Return the scenario of a recording, and the robot's own meshes."""
    from phasmid.robot import Appearance
    from phasmid.scenario import recorded_scenario

    scenario = recorded_scenario(recording.attrs, path if path.is_dir() else path.parent)
    look = own_appearance(scenario.base_robot())
    # Read before the folder is replaced.
    return scenario, look and Appearance.of(look.parts, look.name)
