"""Robots from files of any format, and to files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from phasmid.arguments import checked
from phasmid.errors import AlreadyExists, InvalidInput, InvalidRobot
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.import_options import ImportOptions, is_foreign
from phasmid.formats.importing import Imported, robot_from_tree
from phasmid.formats.judge import judge_robot
from phasmid.formats.tree import Tree, tree_of
from phasmid.formats.urdf_in import read_urdf
from phasmid.formats.urdf_out import urdf_files
from phasmid.formats.xml import LARGEST_FILE, read_xml
from phasmid.recording.file import cannot_write, check_place, write_whole
from phasmid.robot import Robot, robot_to_toml
from phasmid.robot import load_robot as load_own_robot
from phasmid.robot.appearance import Appearance
from phasmid.robot.file import OTHER_FORMATS
from phasmid.robot.glb import glb
from phasmid.robot.unread import refuse_unread
from phasmid.toml import read_bytes

ROBOT_SUFFIXES = (".toml", *OTHER_FORMATS)
"""Endings of robot files; an ``.xml`` is MJCF or URDF by its root element."""


@checked
def load_robot(source: str | Path, options: ImportOptions | None = None) -> Robot:
    """Load a robot from a preset or a file.

    Args:
        source: Name of a preset, such as ``phantomx-paper``, or path of a ``.toml``, ``.urdf``,
            ``.xml`` (MJCF or URDF) or ``.step`` file.
        options: Data that the file lacks; presets and ``.toml`` files need none.

    Raises:
        InvalidInput: There is no such preset or file, or it is not well formed.
        InvalidRobot: No machine could have these numbers, or the model does not cover it.
    """
    if is_foreign(source):
        return possible(import_robot(source, options), source)
    # Judging takes a moment, and such a robot is possible by construction.
    return _own_robot(source, options)


def possible(imported: Imported, source: str | Path) -> Robot:
    """Return the robot that `import_robot` found in a file.

    Raises:
        InvalidRobot: There is none; the error is the first reason.
    """
    if imported.robot is not None:
        return imported.robot
    first, *others = imported.impossible
    every = f"phasmid check --robot {source}, which lists all findings"
    more = f" (and {len(others)} more like it)" if others else ""
    raise InvalidRobot(
        f"{first.sentence}{more}",
        where=first.where or Path(source).name,
        hint=f"{first.hint}, or {every}" if first.hint else every,
    )


@checked
def import_robot(
    source: str | Path, options: ImportOptions | None = None, *, strict: bool = False
) -> Imported:
    """Load a robot with all findings about its description.

    Args:
        source: As of `load_robot`.
        options: Data that the file lacks; presets and ``.toml`` files need none.
        strict: Whether a file with anything that is ignored is refused.

    Returns:
        The robot, or the reason why there is none; and all findings.

    Raises:
        InvalidInput: There is no such preset or file, or it is not well formed; or it holds what
            is ignored, and that is refused.
        InvalidRobot: Its links and joints form no tree, or a ``.toml`` robot is impossible.
    """
    if not is_foreign(source):
        robot = _own_robot(source, options)
        return Imported(robot, judge_robot(robot))
    options = options or ImportOptions()
    tree = _tree(Path(source), options)
    if strict and tree.findings:
        first = tree.findings[0]
        raise InvalidInput(first.sentence, where=first.where, hint="leave --strict out")
    return robot_from_tree(tree, options)


def _own_robot(source: str | Path, options: ImportOptions | None) -> Robot:
    """Load a preset or a ``.toml`` file, which is read as it stands."""
    if options is not None and options != ImportOptions():
        raise InvalidInput(
            f"{source} describes its robot in full; options of reading are for URDF, MJCF and "
            "STEP files.",
            hint=f"phasmid export --robot {source} --out robot.toml, and change it there",
        )
    return load_own_robot(source)


def _tree(path: Path, options: ImportOptions) -> Tree:
    """Read a file of another program with the reader of its format."""
    refuse_unread(path)
    suffix = path.suffix.lower()
    is_urdf = suffix == ".urdf"
    if suffix == ".xml":
        is_urdf = read_xml(read_bytes(path, LARGEST_FILE), path.name).tag == "robot"
    if is_urdf:
        return read_urdf(path, options)
    # Lazy imports: the engine and the sidecar's tables are needed for these formats alone.
    if suffix in (".step", ".stp"):
        from phasmid.formats.step_in import read_step

        return read_step(path)
    from phasmid.formats.mjcf_in import read_mjcf

    return read_mjcf(path, options)


@checked
def save_robot(robot: Robot, path: str | Path, *, force: bool = False) -> tuple[Finding, ...]:
    """Write a robot to a file of the format that its ending names.

    Args:
        robot: The robot.
        path: A ``.toml``, ``.urdf``, ``.xml`` (MJCF) or ``.step`` file. Meshes go beside it.
        force: Whether files of these names are replaced.

    Returns:
        Notes on data that the format cannot hold.

    Raises:
        InvalidInput: The ending names no format, a file is there already, or a library of an
            extra is missing.
        OutputError: A file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in ROBOT_SUFFIXES:
        raise InvalidInput(
            f'"{path.name}" does not end as a robot file does.',
            hint=f'"{path.stem}.toml", or one of {", ".join(ROBOT_SUFFIXES[1:])}',
        )
    files = {path.parent / name: data for name, data in _files(robot, path).items()}
    # The robot's own file last: when it appears, what it names is there.
    files[path] = files.pop(path)
    write_files(files, force=force)
    what = LOST.get(path.suffix.lower())
    hint = "a .toml file keeps everything"
    return (Finding(Severity.NOTE, path.name, what, hint=hint),) if what else ()


def write_files(files: Mapping[Path, bytes], *, force: bool = False) -> None:
    """Write the files of a robot and their folders, in this order.

    Without ``force`` files of the same content alone may be there.

    Raises:
        AlreadyExists: A file is there already.
        OutputError: A file cannot be written.
    """
    try:
        for path, data in files.items():
            if not force and path.exists() and not (path.is_file() and path.read_bytes() == data):
                raise AlreadyExists(path, option="file")
        for path in files:
            check_place(path)
            path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(Path(error.filename or path), error) from None
    for path, data in files.items():
        write_whole(path, data)


def _files(robot: Robot, path: Path) -> dict[str, bytes]:
    """Return the content of a robot's files, by their names beside its own."""
    suffix = path.suffix.lower()
    if suffix == ".toml":
        look, files = robot.appearance, {}
        if look is not None and look.parts:
            look = Appearance.of(look.parts, f"{path.stem}.glb")
            files[look.name] = glb(look.parts)
        text = robot_to_toml(replace(robot, appearance=look))
        return {**files, path.name: text.encode("utf-8")}
    if suffix in (".step", ".stp"):
        # Lazy import: the solids' modules are needed here alone.
        from phasmid.formats.step_out import step_files

        return step_files(robot, path.name)
    if suffix == ".urdf":
        return urdf_files(tree_of(robot), path.stem)
    # Lazy import: SciPy's rotations take 0.2 s.
    from phasmid.formats.mjcf_out import mjcf_files

    files = mjcf_files(robot, path.stem)
    # An .mjcf keeps its ending.
    return {path.name: files.pop(f"{path.stem}.xml"), **files}


_NUMBERS = (
    "keeps geometry, masses, meshes, limits, effort, speed, friction and stance; the servos' own "
    "laws, voltages and zeros, the trunk's box, and names of legs that do not follow their places, "
    "are lost."
)
_SOLIDS = (
    "STEP keeps solids of phasmid's shaping; joints, masses and the servo are in the file "
    "beside it; neutral feet and names of legs are lost."
)

LOST = {
    ".urdf": f"URDF {_NUMBERS}",
    **dict.fromkeys((".xml", ".mjcf"), f"MJCF {_NUMBERS}"),
    **dict.fromkeys((".step", ".stp"), _SOLIDS),
}
"""Properties of a robot that a format cannot hold."""
