"""``phasmid walk``: plan, analyse, simulate and report one walk."""

from __future__ import annotations

import argparse
import json
import os
import string
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args, get_origin

from phasmid.errors import InvalidInput, plain

if TYPE_CHECKING:
    from phasmid.recording import Recording
    from phasmid.robot import Appearance, Robot
    from phasmid.scenario import Scenario

PLACES = {"robot", "height_map"}
"""Fields that name a file."""

TEXTS = {"name", "description", "gait", "terrain", "foot", "masses", "servo_model", "package"}
"""Fields whose value is text, also where it looks like a number."""


def run(options: argparse.Namespace) -> int:
    """Walk as the options say; returns the exit status."""
    scenario = scenario_of(options)
    from phasmid.motion import Motion, load_trajectory, plan
    from phasmid.recording import check_log, check_mcap, load_recording
    from phasmid.reporting import check_folder
    from phasmid.scenario import idle_fields
    from phasmid.simulation import (
        check_time_step,
        record,
        time_step_refinement,
        with_sensors,
    )

    walk: Motion = (
        load_trajectory(options.trajectory, scenario.load_robot(), unit=options.trajectory_unit)
        if options.trajectory
        else plan(scenario)
    )
    check_time_step(scenario, walk)
    legs = leg_numbers(options.legs, walk.robot)
    folder = Path(
        options.out or Path("results") / folder_name(options, scenario, options.trajectory)
    )
    check_folder(folder, force=options.force)
    log = log_of(folder)
    check_log(log, force=options.force)
    if options.mcap:
        check_mcap()
    check_film(options)
    if not options.quiet:
        for sentence in idle_fields(scenario):
            print(f"phasmid: note: {plain(sentence)}", file=sys.stderr)
    try:
        with progress_bar(scenario.duration, quiet=options.quiet) as progress:
            trouble = record(scenario, walk, log, progress=progress, force=options.force)
        if trouble and trouble.ending.name == "STOPPED":
            # Who stops a run wants its end: numbers and pictures can be made later.
            print(f"phasmid: {trouble.sentence}\n{later(log)}", file=sys.stderr)
            return 130
        recording = with_sensors(scenario, load_recording(log))
        if options.check_time_step and not trouble:
            refinement = time_step_refinement(scenario, walk)
            recording.attrs |= refinement.attributes() if refinement else {}
        write_report(recording, folder, options, own_appearance(walk.robot))
    except KeyboardInterrupt:
        if log.exists():
            print(f"phasmid: stopped.\n{later(log)}", file=sys.stderr)
            return 130
        raise
    # The folder is whole: nobody need read what is printed.
    log.unlink(missing_ok=True)
    print_report(recording, folder, options, legs)
    if trouble:
        print(f"phasmid: {trouble.sentence}", file=sys.stderr)
    write_film(recording, options, own_appearance(walk.robot))
    return 3 if trouble else 0


def log_of(folder: Path) -> Path:
    """The log that stands beside a result folder while its run goes on."""
    return folder.with_name(f"{folder.name}.rec")


def later(log: Path) -> str:
    """What to try where a run was stopped."""
    return f"  try  phasmid report {plain(str(log))}, which makes the folder of it"


def own_appearance(robot: Robot) -> Appearance | None:
    """The meshes of a robot that no other file keeps: those that come with phasmid are found."""
    from phasmid.robot import preset_names

    look = robot.appearance
    return None if look is None or look.name.removesuffix(".glb") in preset_names() else look


def write_report(
    recording: Recording,
    folder: Path,
    options: argparse.Namespace,
    appearance: Appearance | None = None,
) -> None:
    """Write a recording's folder, as the options say."""
    from phasmid.reporting import report

    figures = not options.no_figures
    report(
        recording,
        folder,
        force=options.force,
        figures=figures,
        mcap=options.mcap,
        appearance=appearance,
    )


def print_report(
    recording: Recording,
    folder: Path,
    options: argparse.Namespace,
    legs: tuple[int, ...] | None,
) -> None:
    """Print a recording's summary and what its folder holds, as the options say."""
    from phasmid.reporting import print_summary

    if options.quiet:
        return
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    print_summary(summary, legs=legs)
    written = "recording.nc, summary.json, scenario.toml, robot.toml"
    written += ", commands.toml" if "commands" in recording.attrs else ""
    written += f"{', recording.mcap' if options.mcap else ''}"
    written += f"{'' if options.no_figures else ', figures/, report.html'}"
    print(f"\nWritten to {plain(str(folder))}{os.sep}: {written}")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Give a parser the scenario, its fields and the output."""
    add_scenario_options(parser)
    parser.add_argument(
        "--trajectory",
        metavar="FILE",
        help="joint angles to follow instead of a plan: a .csv, .npy, .nc or .rec file",
    )
    parser.add_argument(
        "--trajectory-unit",
        choices=("rad", "deg"),
        default="rad",
        help="of its angles, where the file does not say; default: rad",
    )
    parser.add_argument(
        "--check-time-step",
        action="store_true",
        help="simulate two cycles again at half the time step, and tell the difference",
    )
    add_report_options(parser)
    add_field_options(parser)


def add_scenario_options(parser: argparse.ArgumentParser) -> None:
    """Give a parser the scenario and the output."""
    add_scenario_option(parser)
    parser.add_argument("--out", metavar="DIR", help="result folder; default: results/NAME")


def add_scenario_option(parser: argparse.ArgumentParser) -> None:
    """Give a parser the scenario."""
    from phasmid.scenario import scenario_names

    parser.add_argument(
        "scenario",
        nargs="?",
        default="paper",
        metavar="SCENARIO",
        help=f"a preset ({', '.join(scenario_names())}) or a file; default: paper",
    )


def add_field_options(parser: argparse.ArgumentParser) -> None:
    """Give a parser all fields of a scenario."""
    from phasmid.gait import GAITS
    from phasmid.robot import preset_names
    from phasmid.scenario import option_keys

    fields = parser.add_argument_group(
        "fields of the scenario", "Each replaces what the scenario says."
    )
    for key, path in option_keys().items():
        words = _help_of(path)
        if key == "robot":
            words = f"a preset ({', '.join(preset_names())}) or a file"
        elif key == "gait":
            words = "; ".join(f"{', '.join(gaits)} of {n} legs" for n, gaits in GAITS.items())
            words += "; alternating, wave, ripple of others; or a gait file (.toml)"
        fields.add_argument(
            f"--{key.replace('_', '-')}",
            dest=f"field:{key}",
            metavar=_metavar(path),
            help=words,
        )


def check_film(options: argparse.Namespace) -> None:
    """Refuse a video's file that could not be written, before a run starts."""
    if options.video is not None:
        from phasmid.video import check_video

        check_video(options.video, force=options.force)


def write_film(
    recording: Recording, options: argparse.Namespace, appearance: Appearance | None
) -> None:
    """Write a recording's video where one is asked for; what it needs may be absent here."""
    if options.video is None:
        return
    from phasmid.video import lack, save_video

    missing = lack(Path(options.video).suffix.lower())
    if missing is not None:
        # The folder is whole: this is advice, and no failure.
        instead = "" if options.no_figures else " the 3-D replay was written instead."
        print(
            f"phasmid: {missing.sentence}; the recording is complete.{instead}\n"
            f"  try  {missing.advice}",
            file=sys.stderr,
        )
        return
    with told_progress("filming", "frames", quiet=options.quiet) as progress:
        path = save_video(
            recording,
            options.video,
            appearance=appearance,
            force=options.force,
            progress=progress,
        )
    if not options.quiet:
        print(f"Written to {plain(str(path))}")


def add_report_options(parser: argparse.ArgumentParser) -> None:
    """Give a parser what is asked of a report."""
    parser.add_argument("--force", action="store_true", help="replace the folder of an earlier run")
    parser.add_argument(
        "--legs", metavar="1,2,...", help="legs that the summary lists; default: all"
    )
    parser.add_argument(
        "--mcap", action="store_true", help="also write ROS 2 messages, for Foxglove (extra ros)"
    )
    parser.add_argument(
        "--video", metavar="FILE", help="also write a .mp4 or .gif of the robot (extra video)"
    )
    parser.add_argument("--no-figures", action="store_true", help="write data and summary only")
    parser.add_argument("--quiet", action="store_true", help="print only errors")


def _table_of(path: tuple[str, ...]) -> Any:
    from phasmid.scenario.scenario import Scenario

    table: Any = Scenario
    for part in path[:-1]:
        table = table.model_fields[part].annotation
    return table


def _metavar(path: tuple[str, ...]) -> str:
    from phasmid.tables import choices

    words = "|".join(choices(_table_of(path).model_fields[path[-1]]))
    return words or _list_form(path) or "VALUE"


def _help_of(path: tuple[str, ...]) -> str:
    """What a field is, from the attributes of its table's docstring."""
    from phasmid import units
    from phasmid.tables import quantity

    table = _table_of(path)
    lines = [line.strip() for line in (table.__doc__ or "").splitlines()]
    start = next((i for i, s in enumerate(lines) if s.startswith(f"{path[-1]}: ")), None)
    if start is None:
        return ""
    words = [lines[start].partition(": ")[2]]
    for line in lines[start + 1 :]:
        if not line or line.split(":")[0].isidentifier():
            break
        words.append(line)
    carried = quantity(table.model_fields[path[-1]])
    text = " ".join(words).replace("``", "").replace("%", "%%")
    if carried:
        si, shown = units.SI[carried.dimension].symbol, units.UNITS[carried.unit].symbol
        text = text.replace(f"[{si}]", f"[{shown}]")
    return text


def folder_name(options: argparse.Namespace, scenario: Scenario, *sources: str | None) -> str:
    """The name that is given, or the scenario's and what sources and options changed of it."""
    if vars(options)["field:name"] is not None:
        return scenario.name
    words = [scenario.name]
    words += [Path(source).stem for source in sources if source]
    for key, value in vars(options).items():
        if key.startswith("field:") and value is not None:
            file = key.removeprefix("field:") in PLACES or value.endswith(".toml")
            text = Path(value).stem if file else value
            words.append(f"{key.removeprefix('field:').replace('_', '-')}-{text}")
    name = "_".join(words)
    plain = "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "-" for c in name)
    return plain[:100]


def scenario_of(options: argparse.Namespace) -> Scenario:
    """The scenario that the options ask for."""
    from phasmid.scenario import load_scenario, option_keys
    from phasmid.tables import dotted

    scenario = load_scenario(options.scenario)
    given = {
        key.removeprefix("field:"): value
        for key, value in vars(options).items()
        if key.startswith("field:") and value is not None
    }
    flags = {option_keys()[key]: f"--{key.replace('_', '-')}" for key in given}

    def locate(loc: tuple[str | int, ...]) -> tuple[str, str]:
        for path, flag in flags.items():
            if loc[: len(path)] == path:
                return flag + dotted(loc[len(path) :]), ""
        return dotted(loc), options.scenario

    changed = scenario.changed({key: _value(key, text) for key, text in given.items()}, locate)
    return _with_robot(changed, quiet=options.quiet)


def _with_robot(scenario: Scenario, *, quiet: bool) -> Scenario:
    """The scenario with its robot read, so that a foreign file is read once and judged aloud."""
    from phasmid.formats import Severity, import_robot, is_foreign, possible

    source = scenario.robot
    if not isinstance(source, str) or not is_foreign(source):
        return scenario
    imported = import_robot(source, scenario.robot_import.options())
    robot = possible(imported, source)
    if not quiet:
        notes = [f for f in imported.findings if f.severity is Severity.NOTE]
        for finding in imported.findings:
            if finding.severity is not Severity.NOTE:
                print(f"phasmid: {plain(finding.sentence)}", file=sys.stderr)
        if notes:
            told = f"phasmid check {plain(str(source))}"
            print(f"phasmid: {len(notes)} notes on the robot; {told} tells them.", file=sys.stderr)
    return scenario.replace(robot=robot)


def _value(key: str, text: str) -> Any:
    """An option's text as a number, a list of numbers, or text."""
    from phasmid.scenario import option_keys

    form = _list_form(option_keys()[key])
    if form and text.startswith("["):
        try:
            return tomllib.loads(f"list = {text}")["list"]
        except tomllib.TOMLDecodeError:
            flag = f"--{key.replace('_', '-')}"
            raise InvalidInput(
                f'{flag} is "{text}"; it must be a list.', hint=f"{flag} {form}"
            ) from None
    if form.endswith(";..."):
        return [[number_or_text(part) for part in row.split(",")] for row in text.split(";")]
    if form.endswith(",...") or (form and "," in text):
        return [number_or_text(part) for part in text.split(",")]
    return text if key in {*PLACES, *TEXTS} else number_or_text(text)


def _list_form(path: tuple[str, ...]) -> str:
    """How a field that is a list is written as an option; empty where it is none."""
    pending = [_table_of(path).model_fields[path[-1]].annotation]
    while pending:
        kind = pending.pop()
        parts = get_args(kind)
        if get_origin(kind) is tuple:
            if parts[-1] is not Ellipsis:
                return ",".join(string.ascii_uppercase[: len(parts)])
            inner = get_args(parts[0]) if get_origin(parts[0]) is tuple else ()
            return f"{','.join(string.ascii_uppercase[: len(inner)])};..." if inner else "A,B,..."
        pending += parts
    return ""


def check_lists(arguments: list[str]) -> None:
    """Refuse a list whose numbers stand apart: the second would be taken for a scenario."""
    from phasmid.scenario import option_keys

    lists = {
        f"--{key.replace('_', '-')}" for key, path in option_keys().items() if _list_form(path)
    }
    for flag, first, second in zip(arguments, arguments[1:], arguments[2:], strict=False):
        numbers = (number_or_text(first), number_or_text(second))
        if flag in lists and not any(isinstance(number, str) for number in numbers):
            raise InvalidInput(
                f'{flag} takes one list; "{second}" stands apart.', hint=f"{flag} {first},{second}"
            )


def number_or_text(text: str) -> int | float | str:
    """An option's text as a number, where it is one."""
    try:
        return int(text)
    except ValueError:
        pass
    try:
        number = float(text)
    except ValueError:
        return text
    # 1e3 samples are a whole number of them.
    return int(number) if number.is_integer() and abs(number) < 1e15 else number


def leg_numbers(text: str | None, robot: Robot) -> tuple[int, ...] | None:
    """Numbers of a robot's legs, as an option lists them; None where it does not."""
    if text is None:
        return None
    legs = []
    for part in text.split(","):
        if not (part.strip().isascii() and part.strip().isdigit()):
            raise InvalidInput(
                f'--legs is "{text}"; it must be leg numbers with commas between.',
                hint="--legs 1,2,3",
            )
        robot.leg(int(part))
        legs.append(int(part))
    return tuple(legs)


@contextmanager
def progress_bar(duration: float, *, quiet: bool) -> Iterator[Any]:
    """A bar of simulated seconds on a terminal."""
    with told_progress("walking", "s", quiet=quiet) as told:
        yield None if told is None else lambda done: told(done, duration)


@contextmanager
def told_progress(what: str, unit: str, *, quiet: bool) -> Iterator[Any]:
    """A bar on a terminal, told what is done and all; nothing where the output is piped."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    digits = ".1f" if unit == "s" else ".0f"
    columns = (
        TextColumn(what),
        BarColumn(),
        TextColumn(f"{{task.completed:{digits}}} of {{task.total:{digits}}} {unit}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
