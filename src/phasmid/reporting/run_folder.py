"""The folder of a run, which appears whole or not at all."""

from __future__ import annotations

import json
import re
import secrets
import shutil
from pathlib import Path

from phasmid.arguments import checked
from phasmid.errors import AlreadyExists, InvalidInput, OutputError
from phasmid.interrupts import held_signals
from phasmid.recording import Recording, save_mcap, save_recording
from phasmid.recording.file import cannot_write, check_place
from phasmid.reporting.catalogue import CATALOGUE, report_figures
from phasmid.reporting.drawing import walk_picture
from phasmid.reporting.run import read_run
from phasmid.reporting.style import encoded_figure, save_figure
from phasmid.reporting.summary import Summary, summarise
from phasmid.robot import Appearance
from phasmid.robot.glb import glb
from phasmid.toml import read_toml

OWN_FILES = ("summary.json", "recording.nc")
"""Files by which a folder is recognised as a run's."""

ENTRIES = {*OWN_FILES, "scenario.toml", "robot.toml", "figures", "recording.mcap"}
ENTRIES |= {"report.html", "video.mp4", "video.gif", "commands.toml"}
"""Entries of a run's folder; a folder with any other is never replaced."""

ROOM = 10e6
"""Room for figures and page of a run, about twice that of the paper's walk [bytes]."""


@checked
def report(
    recording: Recording,
    folder: str | Path,
    *,
    force: bool = False,
    figures: bool = True,
    mcap: bool = False,
    appearance: Appearance | None = None,
) -> Path:
    """Write a run's folder: scenario, robot, recording, summary, figures and page.

    Files are written into a folder beside it, which is renamed when it is complete; an older run is
    removed only after that.

    Args:
        recording: A simulation, an analysis or a robot's log.
        folder: The folder; folders above it are made.
        force: Replace an older run of that name.
        figures: Draw the figures, and write ``report.html``.
        appearance: The robot's meshes, kept beside its file, where they do not come with phasmid.
        mcap: Write ``recording.mcap`` too, as `phasmid.save_mcap` does.

    Returns:
        The folder.

    Raises:
        InvalidInput: The folder exists, or the recording does not carry its robot and scenario.
        OutputError: The disk is full or the folder cannot be written; nothing is left behind.
    """
    folder = Path(folder)
    check_folder(folder, force=force)
    # A recording without its robot is refused before anything is written.
    run = read_run(recording)
    target = folder.resolve()
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}.partial")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        partial.mkdir()
        _fill(recording, partial, figures=figures, appearance=appearance)
        if mcap:
            save_mcap(recording, partial / "recording.mcap", leg_names=run.robot.leg_names)
        _take_place(partial, target, folder, force=force)
    except OSError as error:
        raise cannot_write(folder, error) from None
    except OutputError as error:
        # A message must not name the folder that was there only for a moment.
        error.what = error.what.replace(str(partial), str(folder))
        raise
    finally:
        # Renamed to its place unless something failed.
        shutil.rmtree(partial, ignore_errors=True)
    return folder


def check_folder(folder: str | Path, *, force: bool = False) -> None:
    """Raise where `report` could not write a folder, before a run starts.

    Args:
        folder: Folder of the run.
        force: Replace an older run of that name.

    Raises:
        InvalidInput: It exists and may not be replaced.
        OutputError: It cannot be made there.
    """
    folder = Path(folder)
    if folder.name in ("", ".."):
        raise InvalidInput(
            f'"{folder}" is no name for a run\'s folder; it must be a new one.',
            hint=f'"{folder / "walk"}"',
        )
    try:
        if folder.exists() or folder.is_symlink():
            _check_existing(folder, force=force)
    except OSError as error:
        raise cannot_write(folder, error) from None
    check_place(folder, room=ROOM)


def _check_existing(folder: Path, *, force: bool) -> None:
    if not force:
        raise AlreadyExists(folder, option="--out DIR")
    if not folder.is_dir():
        raise InvalidInput(f"{folder} is not a folder; nothing was written.", hint="another folder")
    names = {path.name for path in folder.iterdir()}
    if names and not names & set(OWN_FILES):
        raise InvalidInput(
            f"{folder} holds other things than a run; nothing was written.", hint="another folder"
        )
    foreign = _foreign(folder)
    if foreign:
        raise InvalidInput(
            f"{folder} also holds {foreign[0]}, which is no part of a run; nothing was written.",
            hint="another folder, or move it away",
        )


def _foreign(folder: Path) -> list[str]:
    """Return the names in a run's folder, and in its figures, that no run writes."""
    figures = f"({'|'.join(map(re.escape, CATALOGUE))})([b-z]|-[0-9]+)?[.](svg|png)|walk[.]png"
    found = []
    for path in sorted(folder.iterdir()):
        if path.name == "figures" and path.is_dir():
            inside = sorted(path.iterdir())
            found += [f"figures/{p.name}" for p in inside if not re.fullmatch(figures, p.name)]
        elif path.name not in ENTRIES - {"figures"} | _meshes(folder) or path.is_dir():
            found.append(path.name)
    return found


def _meshes(folder: Path) -> set[str]:
    """Return the name that the robot's file gives to its meshes."""
    try:
        raw, _ = read_toml(folder / "robot.toml")
    except InvalidInput:
        return set()
    name = raw.get("appearance")
    return {name} if isinstance(name, str) else set()


def _fill(
    recording: Recording, folder: Path, *, figures: bool, appearance: Appearance | None
) -> None:
    for name in ("scenario", "robot", "commands"):
        if name in recording.attrs:
            text = str(recording.attrs[name])
            (folder / f"{name}.toml").write_text(text, encoding="utf-8", newline="\n")
    if appearance is not None and appearance.name and appearance.parts:
        (folder / appearance.name).write_bytes(glb(appearance.parts))
    save_recording(recording, folder / "recording.nc")
    summary = summarise(recording)
    text = json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8", newline="\n")
    if figures:
        _write_figures(recording, summary, folder, appearance)


def _write_figures(
    recording: Recording, summary: Summary, folder: Path, appearance: Appearance | None
) -> None:
    """Write the page, and the figures that are files of the folder."""
    from phasmid.reporting.webpage import page_html

    place = folder / "figures"
    place.mkdir()
    pictures, still = [], None
    for name, kind, figure in report_figures(recording):
        svg = encoded_figure(figure, "svg")
        if kind.in_page:
            pictures.append((name, kind.sentence, svg))
        if kind.in_folder:
            (place / f"{name}.svg").write_bytes(svg)
            save_figure(figure, place / f"{name}.png")
    if read_run(recording).can_be_drawn:
        still = encoded_figure(walk_picture(recording, appearance), "png")
        (place / "walk.png").write_bytes(still)
    page = page_html(recording, summary, pictures, still, appearance)
    (folder / "report.html").write_text(page, encoding="utf-8", newline="\n")


def _take_place(partial: Path, target: Path, folder: Path, *, force: bool) -> None:
    """Rename the complete folder to its name, then remove the older one."""
    # A run takes time, so that the folder may have appeared or changed since it was checked.
    if not target.exists():
        partial.rename(target)
        return
    _check_existing(folder, force=force)
    old = target.with_name(f".{target.name}.{secrets.token_hex(4)}.old")
    with held_signals():
        target.rename(old)
        try:
            partial.rename(target)
        except BaseException:
            old.rename(target)
            raise
        shutil.rmtree(old, ignore_errors=True)
