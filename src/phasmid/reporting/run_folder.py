"""A run's folder, which appears whole or not at all."""

from __future__ import annotations

import json
import os
import re
import secrets
import shutil
from pathlib import Path

from phasmid.arguments import path_of
from phasmid.errors import AlreadyExists, InvalidInput, OutputError
from phasmid.recording import Recording, check_mcap, check_recording, save_mcap, save_recording
from phasmid.reporting.companion import Draw, drawing
from phasmid.reporting.gallery import WALK, Gallery
from phasmid.reporting.source import read_source
from phasmid.reporting.style import uncollected
from phasmid.reporting.summary import Summary, summarise
from phasmid.robot import Appearance
from phasmid.robot.appearance import glb
from phasmid.toml import read_toml

OWN_FILES = ("summary.json", "recording.nc")
"""A folder that holds one of these is a run's."""

ENTRIES = {*OWN_FILES, "scenario.toml", "robot.toml", "figures", "recording.mcap"}
ENTRIES |= {"report.html", "video.mp4", "video.gif", "commands.toml"}
"""All that phasmid puts into a run's folder; with anything else in it, it is never replaced."""


def report(
    recording: Recording,
    folder: str | Path,
    *,
    force: bool = False,
    figures: bool = True,
    mcap: bool = False,
    appearance: Appearance | None = None,
) -> Path:
    """Write a run's folder: scenario, robot, recording, numbers, figures and the page of all these.

    Everything is written into a folder beside it first, which is then renamed, so that the folder
    is complete as soon as it exists; an older run is removed only after that.

    Args:
        recording: A simulation, an analysis or a robot's log.
        folder: Where to; folders above it are made.
        force: Whether an older run of that name is replaced.
        figures: Whether pictures are drawn, and ``report.html`` written, which shows them.
        appearance: The robot's meshes, kept beside its file; those that come with phasmid are
            found without it.
        mcap: Whether ``recording.mcap`` is written too, as `phasmid.save_mcap` does.

    Returns:
        The folder.

    Raises:
        InvalidInput: The folder exists, or the recording does not carry its robot and scenario, or
            the extra ``ros`` is not installed.
        OutputError: The disk is full or the folder cannot be written; nothing is left behind.
    """
    check_recording(recording)
    folder = path_of("folder", folder)
    check_folder(folder, force=force)
    # What the recording lacks is found out before anything is written.
    source = read_source(recording)
    if mcap:
        check_mcap()
    target = folder.resolve()
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}.partial")
    try:
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            partial.mkdir()
            _fill(recording, partial, figures=figures, appearance=appearance)
            if mcap:
                save_mcap(recording, partial / "recording.mcap", leg_names=source.robot.leg_names)
            _take_place(partial, target, folder, force=force)
        except BaseException:
            shutil.rmtree(partial, ignore_errors=True)
            raise
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(f"cannot write {folder}: {reason}.") from None
    except OutputError as error:
        # A message must not name the folder that was there only for a moment.
        error.what = error.what.replace(str(partial), str(folder))
        raise
    return folder


def check_folder(folder: str | Path, *, force: bool = False) -> None:
    """Refuse a folder into which `report` could not write; to be asked before a run starts.

    Args:
        folder: Where the run shall go.
        force: Whether an older run of that name may be replaced.

    Raises:
        InvalidInput: It exists and may not be replaced.
        OutputError: It cannot be made there.
    """
    folder = path_of("folder", folder)
    if folder.name in ("", ".."):
        raise InvalidInput(
            f'"{folder}" is no name for a run\'s folder; it must be a new one.',
            hint=f'"{folder / "walk"}"',
        )
    try:
        exists = folder.exists() or folder.is_symlink()
        if exists:
            _check_existing(folder, force=force)
        parent = folder.resolve().parent
        while not parent.exists():
            parent = parent.parent
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(f"cannot write {folder}: {reason}.") from None
    if not parent.is_dir():
        raise OutputError(f"cannot write {folder}: {parent} is not a folder.")
    if not os.access(parent, os.W_OK | os.X_OK):
        raise OutputError(f"cannot write {folder}: {parent} is not writable.")


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
    from phasmid.reporting.catalogue import CATALOGUE

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
    for name in ("scenario", "robot"):
        text = str(recording.attrs[name])
        (folder / f"{name}.toml").write_text(text, encoding="utf-8", newline="\n")
    if "commands" in recording.attrs:
        text = str(recording.attrs["commands"])
        (folder / "commands.toml").write_text(text, encoding="utf-8", newline="\n")
    if appearance is not None and appearance.name and appearance.parts:
        (folder / appearance.name).write_bytes(glb(appearance.parts))
    if not figures:
        _write_numbers(recording, folder)
        return
    gallery = Gallery(recording, appearance)
    with uncollected(), drawing(gallery) as draw:
        summary = _write_numbers(recording, folder)
        _write_pictures(gallery, draw, summary, folder)


def _write_numbers(recording: Recording, folder: Path) -> Summary:
    """Write the recording and its summary."""
    save_recording(recording, folder / "recording.nc")
    summary = summarise(recording)
    text = json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8", newline="\n")
    return summary


def _write_pictures(gallery: Gallery, draw: Draw, summary: Summary, folder: Path) -> None:
    """Write the page, and the figures that the folder has as files."""
    from phasmid.reporting.webpage import Page, Picture

    page = Page(gallery.recording, summary, gallery.appearance)
    drawn = draw(gallery.of_page)
    pictures = [
        Picture(name, kind.sentence, drawn[name, "svg"])
        for name, kind in gallery.kinds.items()
        if kind.in_page
    ]
    text = page.html(pictures, drawn.get(WALK))
    (folder / "report.html").write_text(text, encoding="utf-8", newline="\n")
    drawn |= draw(gallery.of_folder)
    place = folder / "figures"
    place.mkdir()
    for (name, ending), content in drawn.items():
        if (name, ending) == WALK or gallery.kinds[name].in_folder:
            (place / f"{name}.{ending}").write_bytes(content)


def _take_place(partial: Path, target: Path, folder: Path, *, force: bool) -> None:
    """Rename the complete folder to its name, then remove the older one."""
    # A run takes time, so that the folder may have appeared or changed since it was checked.
    if not target.exists():
        partial.rename(target)
        return
    _check_existing(folder, force=force)
    old = target.with_name(f".{target.name}.{secrets.token_hex(4)}.old")
    target.rename(old)
    try:
        partial.rename(target)
    except BaseException:
        old.rename(target)
        raise
    try:
        shutil.rmtree(old, ignore_errors=True)
    except BaseException:
        # What was interrupted is the removal of what is no longer needed.
        shutil.rmtree(old, ignore_errors=True)
        raise
