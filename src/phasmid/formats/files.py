"""Files that a robot's description names, which are read only inside the model's folder."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from phasmid.errors import InvalidInput, plain
from phasmid.toml import toml_value

_UPWARDS = 8
"""Number of folders above a file that are searched for its package."""


def _inside(folder: Path, name: str, noun: str, *, start: Path | None = None) -> Path:
    """Resolve a name inside a folder; the file need not exist.

    Nothing but a relative path that stays in the folder is accepted: no absolute path, no drive,
    no address, no link. The name counts from ``start`` inside the folder, or from the folder.
    """
    shown = plain(name if len(name) <= 200 else f"{name[:200]}…")
    parts = name.replace("\\", "/").split("/")
    odd = not name.isprintable() or ":" in name or len(name) > 4000 or parts[0] in {"", "~"}
    path = Path(os.path.normpath((start or folder).joinpath(*parts)))
    try:
        if odd or not path.is_relative_to(folder):
            raise OSError
        inner = [path, *path.parents][: len(path.parts) - len(folder.parts)]
        linked = any(step.is_symlink() for step in inner)
    except (OSError, ValueError):
        raise InvalidInput(
            f'{noun} "{shown}" lies outside the model folder.',
            hint="put it into the model's folder",
        ) from None
    if linked:
        raise InvalidInput(
            f'{noun} "{shown}" leads over a link, which is not followed.',
            hint="put the file itself there",
        )
    return path


def _model_folder(file: Path) -> Path:
    """Find the folder of all files of a model: its package, or that of the file itself."""
    folder = file.resolve().parent
    for parent in [folder, *folder.parents][:_UPWARDS]:
        if (parent / "package.xml").is_file():
            return parent
    is_part = folder.name.lower() in {"urdf", "robots", "mjcf", "xml"}
    # All of a home folder or a disk is no model.
    is_all = folder.parent in (Path.home(), Path(folder.anchor))
    return folder.parent if is_part and not is_all else folder


def check_packages(packages: Mapping[str, str]) -> None:
    """Refuse packages of an option whose folder is not there."""
    for package, folder in packages.items():
        if not Path(folder).is_dir():
            raise InvalidInput(
                f"no such folder: {plain(folder[:200])}.",
                where=f"option --package {plain(package[:100])}",
            )


def named_file(file: Path, name: str, noun: str, packages: Mapping[str, str]) -> Path:
    """Resolve a name in a model's file, ``package://`` included.

    A name that leads elsewhere, such as a path of its maker's machine, is looked for by its last
    folders in the model's own.

    Raises:
        InvalidInput: The name leads outside the model's folder, or its package is unknown.
    """
    try:
        return _resolved(file, name, noun, packages)
    except InvalidInput:
        steps = [step for step in re.split(r"[/\\]+", name) if step not in ("", "..", "~")]
        for first in range(1, len(steps)):
            with suppress(InvalidInput):
                path = _inside(_model_folder(file), "/".join(steps[first:]), noun)
                if path.is_file():
                    return path
        raise


def _resolved(file: Path, name: str, noun: str, packages: Mapping[str, str]) -> Path:
    found = re.match(r"(?:package|model)://([^/\\]+)[/\\]+", name)
    if not found:
        folder = _model_folder(file)
        return _inside(folder, name, noun, start=file.resolve().parent)
    package = found.group(1)
    rest = name[found.end() :]
    if package in packages:
        return _inside(Path(packages[package]).resolve(), rest, noun)
    own = _model_folder(file)
    if package in (own.name, _package_name(own)):
        return _inside(own, rest, noun)
    shown = plain(package[:100])
    raise InvalidInput(
        f'{noun} "{plain(rest[:200])}" is in package "{shown}", which is unknown.',
        hint=f"package = {toml_value(f'{shown}=.')}, with the folder of the package",
    )


def _package_name(folder: Path) -> str:
    """Return the package name in a folder's ``package.xml``; empty without one."""
    try:
        with (folder / "package.xml").open("rb") as file:
            found = re.search(rb"<name>\s*([^<>\s]{1,200})\s*</name>", file.read(100_000))
    except OSError:
        return ""
    return found.group(1).decode("utf-8", "replace") if found else ""
