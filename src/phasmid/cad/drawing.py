"""STEP files in: the placed parts of an assembly, with what their solids weigh and look like."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.cad.assembly import MassProperties
from phasmid.cad.library import check_installed
from phasmid.cad.reader import NO_STEP, TOO_MANY
from phasmid.errors import InvalidInput
from phasmid.robot import Part

LARGEST_FILE = 200_000_000
"""Files above this many bytes are refused."""

LONGEST = 300.0
"""A file that takes longer to read than this is given up [s]."""

GREY = (0.5, 0.5, 0.5, 1.0)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A round face of a part.

    Attributes:
        point: A point of its axis in the part's frame [m], shape (3,).
        direction: Of its axis, a unit vector, shape (3,).
        radius: [m].
        area: [m²].
        name: As in the file; often empty.
    """

    point: Float[np.ndarray, "3"]
    direction: Float[np.ndarray, "3"]
    radius: float
    area: float
    name: str


@dataclass(frozen=True, eq=False)
class DrawnPart:
    """A part in its place.

    Attributes:
        path: Names of the assemblies that hold it and its own, with slashes between.
        product: Name of the part wherever it is placed.
        X_drawing_part: Its pose in the drawing's frame [m], shape (4, 4).
        solid: Mass properties at a density of 1 kg/m³, in the part's frame; None for a surface
            that encloses nothing.
        look: Its triangles, in the part's frame; None where it has none.
        cylinders: Its round faces.
    """

    path: str
    product: str
    X_drawing_part: Float[np.ndarray, "4 4"]
    solid: MassProperties | None
    look: Part | None
    cylinders: tuple[Cylinder, ...]

    @cached_property
    def volume(self) -> float:
        """What it encloses [m³]."""
        return self.solid.mass if self.solid else 0.0


def read_drawing(path: Path) -> tuple[DrawnPart, ...]:
    """The parts of a STEP file.

    The file is read in a process of its own: the geometry kernel may crash over a damaged one.

    Raises:
        InvalidInput: The file cannot be read, is too large, takes too long or is damaged.
        PhasmidError: build123d is not installed.
    """
    _check(path)
    check_installed()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "parts.npz"
        paths = [str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
        try:
            done = subprocess.run(  # noqa: S603
                [sys.executable, "-m", "phasmid.cad.reader", str(path.absolute()), str(out)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                timeout=LONGEST,
                check=False,
                cwd=folder,
                env=environment,
            )
        except subprocess.TimeoutExpired:
            raise InvalidInput(
                f"{path.name} takes longer than {LONGEST:g} s to read; it was given up.",
                hint="leave screws and other small parts out of the file",
            ) from None
        if done.returncode in (TOO_MANY, NO_STEP):
            lines = done.stdout.decode("utf-8", "replace").strip().splitlines()
            said = lines[-1] if lines else "is damaged"
            limits = "; such files are refused." if done.returncode == TOO_MANY else "."
            raise InvalidInput(f"{path.name} {said}{limits}")
        if done.returncode or not out.is_file():
            raise InvalidInput(
                f"{path.name} is damaged: the geometry kernel gave up over it.",
                hint="write the file anew",
            )
        with np.load(out, allow_pickle=False) as arrays:
            return _parts(path, dict(arrays))


def _check(path: Path) -> None:
    """Refuse what is no STEP file before the kernel sees it."""
    try:
        if not path.is_file():
            known = path.exists()
            raise InvalidInput(f"{path} is not a file." if known else f"{path} does not exist.")
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(4096)
    except (OSError, ValueError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise InvalidInput(f"cannot read {path}: {reason}.") from None
    if size > LARGEST_FILE:
        raise InvalidInput(f"{path} holds more than {LARGEST_FILE} bytes; such files are refused.")
    if b"ISO-10303-21" not in head:
        raise InvalidInput(
            f"{path.name} is no STEP file; it must begin with ISO-10303-21.",
            hint="export the assembly as STEP, AP214 or AP242",
        )


def _parts(path: Path, arrays: dict[str, np.ndarray]) -> tuple[DrawnPart, ...]:
    told = json.loads(arrays["told"].tobytes())
    prototypes = [
        _prototype(path, facts, number, arrays) for number, facts in enumerate(told["prototypes"])
    ]
    return tuple(
        DrawnPart(part["path"], *_placed(prototypes[part["prototype"]], arrays[f"X{number}"]))
        for number, part in enumerate(told["parts"])
    )


Prototype = tuple[str, MassProperties | None, Part | None, tuple[Cylinder, ...]]


def _placed(
    prototype: Prototype, X: np.ndarray
) -> tuple[str, np.ndarray, MassProperties | None, Part | None, tuple[Cylinder, ...]]:
    product, solid, look, cylinders = prototype
    return product, X, solid, look, cylinders


def _prototype(
    path: Path, facts: dict[str, Any], number: int, arrays: dict[str, np.ndarray]
) -> Prototype:
    mass, vertices = arrays[f"mass{number}"], arrays[f"vertices{number}"]
    faces, rows = arrays[f"faces{number}"], arrays[f"cylinders{number}"]
    if not all(np.isfinite(array).all() for array in (mass, vertices, rows)):
        raise InvalidInput(f"{path.name}: part {facts['name']} has measures that are not finite.")
    solid = None
    if facts["solid"] and mass[0] > 0:
        solid = MassProperties(float(mass[0]), mass[1:4], mass[4:].reshape(3, 3))
    color = tuple(facts["color"]) if facts["color"] else GREY
    look = Part(vertices, faces, color, facts["name"]) if len(faces) else None
    cylinders = tuple(
        Cylinder(row[:3], row[3:6], float(row[6]), float(row[7]), name)
        for row, name in zip(rows, facts["faces"], strict=True)
    )
    return facts["name"], solid, look, cylinders
