"""``phasmid walk``: plan, analyse, simulate and report one walk."""

from __future__ import annotations

import argparse
import json
import os
import sys
import webbrowser
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from phasmid.cli.live import add_live_options, check_live, served
from phasmid.cli.options import refuse_given, whole_numbers
from phasmid.cli.output import has_display, say
from phasmid.cli.progress import progress_bar
from phasmid.cli.result_folder import log_of, result_folder
from phasmid.cli.scenario_options import OUT, print_idle, scenario_of, scenario_options
from phasmid.errors import InvalidInput, plain

if TYPE_CHECKING:
    from phasmid.motion import Motion
    from phasmid.recording import Recording
    from phasmid.robot import Appearance, Robot
    from phasmid.scenario import Scenario
    from phasmid.simulation import Run

REPORT_OPTIONS = {
    "--force": "replace the folder of an earlier run",
    "--legs 1,2,...": "legs that the summary, or the figures, show; default: all",
    "--mcap": "also write ROS 2 messages, for Foxglove",
    "--video FILE": "also write a .mp4 or .gif of the robot (extra video)",
    "--no-figures": "write data and summary only",
    "--open": "open report.html in the browser when done",
    "--quiet": "print only errors",
}
"""Options of a report."""

OPTIONS = {
    **OUT,
    "--trajectory FILE": "joint angles to follow instead of a plan: .csv, .npy, .nc or .mcap",
    **REPORT_OPTIONS,
}


def run(options: argparse.Namespace) -> int:
    """Walk, and return the exit status."""
    if options.trajectory is None:
        refuse_given(options, ("trajectory_unit",), "needs --trajectory")
    scenario = scenario_of(options)
    from phasmid.motion import plan
    from phasmid.simulation import new_run, with_time_step

    walk: Motion = _trajectory(options, scenario) if options.trajectory else plan(scenario)
    with_time_step(scenario, walk)
    words = [f"trajectory-{Path(options.trajectory).stem}"] if options.trajectory else []
    print_idle(scenario, options, "a simulated walk")
    return make_run(lambda: new_run(scenario, walk), scenario, options, words)


def _trajectory(options: argparse.Namespace, scenario: Scenario) -> Motion:
    from phasmid.motion import load_trajectory

    robot = scenario.build().robot
    unit: Literal["rad", "deg"] = options.trajectory_unit or "rad"
    try:
        return load_trajectory(options.trajectory, robot, unit=unit)
    except InvalidInput as error:
        error.hint = error.hint.replace("unit =", "trajectory_unit =")
        raise


def make_run(
    begin: Callable[[], Run], scenario: Scenario, options: argparse.Namespace, words: Sequence[str]
) -> int:
    """Make a run with its result folder, summary and video, and return the exit status.

    Args:
        begin: Returns the run; called after the options have been checked.
        scenario: Its scenario.
        options: Those of the command line.
        words: Parts of the folder's name.
    """
    from phasmid.recording import check_log, load_recording
    from phasmid.recording.file import check_place
    from phasmid.reporting import check_folder
    from phasmid.simulation import with_sensors

    robot = scenario.build().robot
    legs, appearance = leg_numbers(options.legs, robot), own_appearance(robot)
    folder = result_folder(options, scenario, words)
    check_folder(folder, force=options.force)
    log = log_of(folder)
    check_log(log, force=options.force)
    check_film(options)
    check_page(options)
    check_live(options)
    run = begin()
    # The folder is written beside the log, and its compressed recording takes less.
    sample = sum(channel[:1].nbytes for channel in run.channels(run.first).values())
    check_place(folder, room=(3 if options.mcap else 2) * len(run.time) * sample)
    before = _inode(folder)
    try:
        with (
            served(run, options),
            progress_bar("walking", scenario.duration, quiet=options.quiet) as progress,
        ):
            trouble = run.record(log, progress=progress, force=options.force)
        recording = with_sensors(run.experiment, load_recording(log))
        write_report(recording, folder, options, appearance)
    except KeyboardInterrupt as stop:
        if _inode(folder) != before:
            # The folder is complete.
            log.unlink(missing_ok=True)
        if not log.exists():
            raise
        # The report can be made later from the log.
        later = f"  try  phasmid report {plain(str(log))}, which makes the folder of it"
        raise KeyboardInterrupt(f"{str(stop) or 'stopped.'}\n{later}") from stop
    # The folder is complete.
    log.unlink(missing_ok=True)
    print_report(recording, folder, options, legs)
    if trouble:
        say(f"phasmid: {trouble.sentence}", file=sys.stderr)
    write_film(recording, options, appearance)
    if not trouble:
        open_page(folder, options)
    return 3 if trouble else 0


def _inode(folder: Path) -> int | None:
    """Return what tells a folder from another one of its name; None where there is none."""
    try:
        return folder.stat().st_ino
    except OSError:
        return None


def own_appearance(robot: Robot) -> Appearance | None:
    """Return the meshes of a robot, unless they are those of a preset."""
    from phasmid.robot import preset_names

    look = robot.appearance
    return None if look is None or look.name.removesuffix(".glb") in preset_names() else look


def write_report(
    recording: Recording, folder: Path, options: argparse.Namespace, appearance: Appearance | None
) -> None:
    """Write the result folder of a recording."""
    from phasmid.reporting import report

    with progress_bar("drawing the figures", quiet=options.quiet or options.no_figures):
        report(
            recording,
            folder,
            force=options.force,
            figures=not options.no_figures,
            mcap=options.mcap,
            appearance=appearance,
        )


def print_report(
    recording: Recording, folder: Path, options: argparse.Namespace, legs: tuple[int, ...] | None
) -> None:
    """Print the summary of a recording and the files of its folder."""
    from phasmid.reporting import print_summary

    if options.quiet:
        return
    print_summary(json.loads((folder / "summary.json").read_text(encoding="utf-8")), legs=legs)
    written = ["recording.nc", "summary.json", "scenario.toml", "robot.toml"]
    written += ["commands.toml"] * ("commands" in recording.attrs)
    written += ["recording.mcap"] * options.mcap
    written += [] if options.no_figures else ["figures/", "report.html"]
    say(f"\nWritten to {plain(str(folder))}{os.sep}: {', '.join(written)}")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--trajectory-unit",
        choices=("rad", "deg"),
        help="unit of the trajectory's angles, if the file has none; default: rad",
    )
    add_live_options(parser)
    scenario_options(parser)


def check_film(options: argparse.Namespace) -> None:
    """Refuse a video file that cannot be written, before the run."""
    if options.video is not None:
        from phasmid.reporting import check_video

        check_video(options.video, force=options.force)


def check_page(options: argparse.Namespace) -> None:
    """Refuse to open a page that is not written."""
    if options.open and options.no_figures:
        raise InvalidInput("--open shows report.html, which --no-figures leaves out; one must go.")


def open_page(folder: Path, options: argparse.Namespace) -> None:
    """Open the page of a result folder if the options ask for it and there is a browser."""
    page = folder / "report.html"
    if not options.open:
        return
    if has_display():
        webbrowser.open(page.absolute().as_uri())
    elif not options.quiet:
        say(f"No browser can open a window here; the page is {plain(str(page))}.")


def write_film(
    recording: Recording, options: argparse.Namespace, appearance: Appearance | None
) -> None:
    """Write the video of a recording, or print what it needs."""
    if options.video is None:
        return
    from phasmid.reporting import save_video
    from phasmid.reporting.renderer import opengl_lack

    missing = opengl_lack()
    if missing is not None:
        # The folder is complete: this is a note, not an error.
        has_page = not options.no_figures and getattr(options, "figures", None) is None
        instead = " report.html has a 3-D replay instead." if has_page else ""
        say(
            f"phasmid: {missing.sentence}; the recording is complete.{instead}\n"
            f"  try  {missing.advice}",
            file=sys.stderr,
        )
        return
    notice = f"filming into {plain(str(options.video))}"
    with progress_bar("filming", quiet=options.quiet, notice=notice) as progress:
        path = save_video(
            recording, options.video, appearance=appearance, force=options.force, progress=progress
        )
    if not options.quiet:
        say(f"Written to {plain(str(path))}")


def leg_numbers(text: str | None, robot: Robot, flag: str = "--legs") -> tuple[int, ...] | None:
    """Return the leg numbers of an option; None without it."""
    if text is None:
        return None
    legs = whole_numbers(flag, text, "leg numbers", "1")
    for leg in legs:
        robot.leg(leg)
    return tuple(legs)
