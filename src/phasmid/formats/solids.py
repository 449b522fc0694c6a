"""A robot's solids as files: STEP with its sidecar, meshes and masses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from phasmid.cad import build, meshes
from phasmid.cad.step import step_text
from phasmid.cad.weights import mass_table
from phasmid.errors import InvalidInput
from phasmid.formats.meshes import Mesh, joined, stl
from phasmid.formats.step_sidecar import sidecar_of, sidecar_text
from phasmid.recording.file import cannot_write, write_whole
from phasmid.robot import Robot
from phasmid.robot.glb import glb


def write_solids(
    robot: Robot,
    folder: Path,
    *,
    force: bool = False,
    announce: Callable[[str], None] = lambda _: None,
) -> dict[Path, str]:
    """Draw a robot and write its STEP file, meshes and masses.

    Args:
        robot: The robot.
        folder: Where the files go; it is made.
        force: Whether files of an earlier run are replaced.
        announce: Called with the name of each stage.

    Returns:
        The files, each with a description in a few words.

    Raises:
        InvalidInput: A file is there already.
        OutputError: A file cannot be written.
        PhasmidError: build123d is not installed.
    """
    name = file_name(robot.name)
    step = folder / f"{name}.step"
    files = {
        step: "assembly of named, coloured solids",
        sidecar_of(step): "which part belongs to which link, axes, densities",
        folder / f"{name}.glb": "meshes of all links; name it as appearance in the robot's file",
        folder / f"{name}-masses.md": "the file's masses beside those of the solids",
    }
    announce("solids")
    assembly = build(robot)
    looks = meshes(assembly)
    stls = {link: folder / "stl" / f"{name}.stl" for link, name in file_names(tuple(looks)).items()}
    for link, path in stls.items():
        files[path] = f"mesh of {link}, in metres"
    _check(tuple(files), force=force)
    for place in (folder, folder / "stl"):
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(place, error) from None
    announce("STEP")
    write_whole(step, step_text(assembly))
    sidecar = sidecar_text(robot, assembly)
    write_whole(sidecar_of(step), sidecar.encode())
    announce("meshes")
    write_whole(folder / f"{name}.glb", glb(looks))
    for link, parts in looks.items():
        write_whole(stls[link], stl(Mesh(*joined(parts))))
    table = f"# {robot.name}: masses\n\n{mass_table(robot, assembly)}"
    write_whole(folder / f"{name}-masses.md", table.encode())
    return files


def step_files(robot: Robot, name: str) -> dict[str, bytes]:
    """A robot as a STEP file and its sidecar, which keeps the robot's own masses.

    Args:
        robot: The robot.
        name: Of the STEP file.

    Returns:
        The two files' contents, by their names.

    Raises:
        PhasmidError: build123d is not installed.
    """
    assembly = build(robot)
    text = sidecar_text(robot, assembly, masses="file")
    return {name: step_text(assembly), sidecar_of(Path(name)).name: text.encode()}


def file_name(name: str) -> str:
    """Return a name as a file name that all systems accept."""
    plain = "".join(c if c.isalnum() or c in "-_." else "_" for c in name)
    return plain.strip(".") or "robot"


def file_names(names: Sequence[str]) -> dict[str, str]:
    """Return file names by the names of their content; equal ones are numbered."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        plain = numbered = file_name(name)
        number = 1
        # Some systems hold capital and small letters for the same.
        while numbered.casefold() in taken:
            number += 1
            numbered = f"{plain}_{number}"
        taken.add(numbered.casefold())
        found[name] = numbered
    return found


def _check(files: tuple[Path, ...], *, force: bool) -> None:
    there = [path for path in files if path.exists() or path.is_symlink()]
    if there and not force:
        raise InvalidInput(f"{there[0]} is there already.", hint="--force, or another --out")
