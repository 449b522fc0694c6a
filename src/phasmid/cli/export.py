"""``phasmid export``: a recording, robot or walk as a file of another format."""

from __future__ import annotations

import argparse
import os
import shlex
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from phasmid.cli.figures import run_name
from phasmid.cli.options import Number, refuse_given
from phasmid.cli.output import say
from phasmid.cli.report import print_damage
from phasmid.cli.scenario_options import (
    field_arguments,
    given_fields,
    print_idle,
    scenario_as_named,
    scenario_of,
    scenario_options,
)
from phasmid.errors import InvalidInput, plain
from phasmid.formats import firmware_header, import_robot, is_foreign, possible, save_robot
from phasmid.formats.robots import write_files
from phasmid.motion import plan
from phasmid.recording import load_recording
from phasmid.recording.file import check_new_file
from phasmid.scenario import option_keys

OPTIONS = {
    "--out FILE": "the file, whose ending tells its kind. Of a recording .csv, .nc or .mcap (for "
    "Foxglove and ROS 2). Of a robot .toml, .urdf, .xml (MJCF) or .step; without an ending a "
    "folder with solids and meshes (extra cad). Of a walk .h, leg kinematics and gait in C for "
    "microcontrollers. Default: a .csv beside the recording",
    "--channels A,B,...": "channels of the recording that are written; default: all",
    "--rate HZ": Number(
        "most samples a second of the recording; default: all, of .mcap 100", 1e-3, 1e6
    ),
    "--force": "replace older files",
    "--quiet": "print only errors",
}

RECORDING, ROBOT = (".csv", ".nc", ".mcap"), (".toml", ".urdf", ".xml", ".mjcf", ".step", ".stp")
"""Endings of files of a recording, and of a robot."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    words = "a recording or its result folder; or the scenario of a robot or walk; default: paper"
    scenario_options(parser, words, "RECORDING|SCENARIO")


def run(options: argparse.Namespace) -> int:
    """Write the file, and return the exit status."""
    ending = _ending(options.out) if options.out else ".csv"
    write: Callable[[argparse.Namespace], int]
    if ending in RECORDING:
        write = _recording
    elif ending == ".h":
        write = _firmware
    elif ending in ROBOT or not ending:
        write = _robot
    else:
        is_recording = options.scenario is not None and given_fields(options).get("robot") is None
        path = Path(options.out).with_suffix(".csv" if is_recording else ".toml")
        raise InvalidInput(
            f'"{plain(options.out)}" does not end in one of {", ".join((*RECORDING, *ROBOT))}, .h; '
            "a folder's name ends in a slash.",
            hint=f"--out {shlex.quote(plain(str(path)))}",
        )
    if write is not _recording:
        refuse_given(options, ("channels", "rate"), "belongs to a recording")
    return write(options)


def _ending(out: str) -> str:
    """Return the ending of a file; none of a folder, which ends in a slash or has another."""
    ending = Path(out).suffix.lower()
    is_folder = Path(out).is_dir() and ending not in {*RECORDING, *ROBOT, ".h"}
    return "" if out.endswith("/") or is_folder else ending


def _recording(options: argparse.Namespace) -> int:
    """Write a recording as a table, NetCDF or MCAP."""
    from phasmid.reporting.data_file import check_export, export

    if options.scenario is None:
        if given_fields(options).get("robot") is not None:
            raise InvalidInput("the file of the robot is not named.", hint="--out robot.urdf")
        raise InvalidInput("no recording is named.", hint="phasmid export results/paper")
    _refuse_fields(options, "a recording")
    if is_foreign(options.scenario):
        raise InvalidInput(
            f"{plain(options.scenario)} is a robot, no recording.",
            hint=f"--robot {shlex.quote(plain(options.scenario))} --out robot.toml",
        )
    given = Path(options.scenario)
    target = Path(options.out or _beside(given))
    with print_damage() as damage:
        recording = load_recording(given)
    source = given / "recording.nc" if given.is_dir() else given
    if target.resolve() == source.resolve():
        raise InvalidInput(
            f"{target} is the recording itself; nothing was written.", hint="another --out"
        )
    check_export(target, force=options.force)
    channels = [name.strip() for name in options.channels.split(",")] if options.channels else None
    export(recording, target, channels=channels, rate=options.rate, force=options.force)
    if not options.quiet:
        say(f"Written to {plain(str(target))}")
    return 2 if any(found.wrong for found in damage) else 0


def _robot(options: argparse.Namespace) -> int:
    """Write a robot in a format of robots, or its solids and meshes into a folder."""
    _refuse_fields(options, "a robot", {"robot", "servo"})
    path, scenario = Path(options.out), scenario_as_named(options)
    imported = None
    if isinstance(scenario.robot, str):
        source = scenario.robot
        imported = import_robot(source, scenario.robot_import, strict=options.strict)
        scenario = scenario.replace(robot=possible(imported, source))
    robot = scenario.base_robot()
    findings = [] if imported is None else [*imported.findings]
    if _ending(options.out):
        findings += save_robot(robot, path, force=options.force)
        files = {}
    else:
        files = _solids(robot, path, force=options.force)
    if not options.quiet:
        for finding in findings:
            say(f"  {finding.severity.value:<10} {plain(finding.sentence)}")
        say(f"Written to {plain(str(path))}: {len(robot.legs)} legs, {robot.mass:.3f} kg")
        for name, words in files.items():
            say(f"  {plain(name):<28} {words}")
    return 0


def _solids(robot: Any, folder: Path, *, force: bool) -> dict[str, str]:
    """Write the solids and meshes of a robot into a folder; return the files with a description."""
    from phasmid.formats.solids.assembly import build123d
    from phasmid.formats.step_out import cad_files

    build123d()
    files = cad_files(robot, folder)
    write_files({path: content for path, (_, content) in files.items()}, force=force)
    return {str(path.relative_to(folder)): words for path, (words, _) in files.items()}


def _firmware(options: argparse.Namespace) -> int:
    """Write leg kinematics and gait of a walk as a C header."""
    path = Path(options.out)
    check_new_file(path, option="--out FILE", force=options.force)
    scenario = scenario_of(options)
    print_idle(scenario, options, "a C header")
    own = [] if options.scenario is None else [options.scenario]
    words = ["phasmid", "export", *own, *field_arguments(options), "--out", path.name]
    header = firmware_header(plan(scenario), command=shlex.join(words))
    write_files({path: header.encode()}, force=options.force)
    if not options.quiet:
        robot = scenario.build().robot
        say(
            f"Written to {plain(str(path))}: {plain(robot.name)}, {len(robot.legs)} legs, "
            f"{scenario.stride.samples - 1} samples of a cycle"
        )
    return 0


def _refuse_fields(options: argparse.Namespace, what: str, used: Collection[str] = ()) -> None:
    """Refuse fields of a scenario that a file does not depend on.

    Args:
        options: Those of the command line.
        what: What is written.
        used: Fields that count, beside those of reading a robot.
    """
    reads = {key for key, path in option_keys().items() if path[0] == "robot_import" and used}
    idle = [key for key in given_fields(options) if key not in {*used, *reads}]
    reason = f"changes nothing of the file of {what}"
    if not used:
        refuse_given(options, ("strict",), reason)
    for key in idle:
        flag = f"--{key.replace('_', '-')}"
        raise InvalidInput(f"{flag} {reason}.", hint=f"without {flag}")


def _beside(given: Path) -> Path:
    """Return a .csv beside a recording, or beside its result folder."""
    whole = given.resolve()
    folder = whole.parent if whole.name == "recording.nc" else whole
    return Path(os.path.relpath(folder.with_name(f"{run_name(given)}.csv")))
