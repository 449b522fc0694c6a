"""STEP files as drawings: the placed parts of an assembly, with their masses and meshes."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.formats.solids.assembly import check_installed
from phasmid.robot import Part
from phasmid.robot.inertial import Inertial
from phasmid.toml import read_bytes

LARGEST_FILE = 200_000_000
"""Largest file that is read [bytes]."""

LONGEST = 300.0
"""Longest time for reading a file [s]."""

READER = "phasmid.formats.solids.reader"
"""The module that reads in a process of its own."""

REFUSED = 3
"""Exit status of the reader for a file that it refuses; its sentence is printed."""


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A cylindrical face of a part: a point of its axis [m], its direction and area [m²]."""

    point: Float[np.ndarray, "3"]
    direction: Float[np.ndarray, "3"]
    area: float


@dataclass(frozen=True, eq=False)
class DrawnPart:
    """A part in its place, in the drawing's frame.

    Attributes:
        path: Names of the assemblies that hold it and its own, with slashes between.
        product: Name of the part wherever it is placed.
        solid: Mass and inertia at a density of 1 kg/m³; None for a surface that encloses nothing.
        look: Its triangles; None where it has none.
        cylinders: Its cylindrical faces.
    """

    path: str
    product: str
    solid: Inertial | None
    look: Part | None
    cylinders: tuple[Cylinder, ...]

    def at(self, X: Float[np.ndarray, "4 4"], path: str) -> DrawnPart:
        """Return the part in another place, at a path."""
        R, p = X[:3, :3], X[:3, 3]
        return DrawnPart(
            path,
            self.product,
            self.solid and self.solid.at(X),
            self.look and self.look.at(X),
            tuple(
                replace(face, point=R @ face.point + p, direction=R @ face.direction)
                for face in self.cylinders
            ),
        )


def read_drawing(path: Path) -> tuple[DrawnPart, ...]:
    """Read the parts of a STEP file, in a process of its own: the geometry kernel may crash.

    Raises:
        InvalidInput: The file cannot be read, is too large, takes too long or is damaged.
        PhasmidError: build123d is not installed.
    """
    if b"ISO-10303-21" not in read_bytes(path, LARGEST_FILE)[:4096]:
        raise InvalidInput(
            f"{path.name} is no STEP file; it must begin with ISO-10303-21.",
            hint="export the assembly as STEP, AP214 or AP242",
        )
    check_installed()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "parts"
        paths = [str(Path(__file__).parents[3]), os.environ.get("PYTHONPATH", "")]
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
        try:
            done = subprocess.run(  # noqa: S603
                [sys.executable, "-m", READER, str(path.absolute()), str(out)],
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
        if done.returncode == REFUSED:
            lines = done.stdout.decode("utf-8", "replace").strip().splitlines()
            raise InvalidInput(f"{path.name} {lines[-1] if lines else 'is damaged'}.")
        if done.returncode or not out.is_file():
            raise InvalidInput(
                f"{path.name} is damaged: the geometry kernel gave up over it.",
                hint="write the file anew",
            )
        return _loaded(out)


def save_parts(parts: Sequence[DrawnPart], file: Path) -> None:
    """Write parts as arrays of numbers and names, which can hold no code."""
    arrays: dict[str, Any] = {"paths": [p.path for p in parts]}
    arrays["products"] = [p.product for p in parts]
    for n, part in enumerate(parts):
        if part.solid is not None:
            arrays[f"solid{n}"] = np.r_[part.solid.mass, part.solid.com, part.solid.inertia.ravel()]
        if part.look is not None:
            arrays[f"vertices{n}"], arrays[f"faces{n}"] = part.look.vertices, part.look.faces
            arrays[f"color{n}"] = np.array(part.look.color)
        rows = [np.r_[face.point, face.direction, face.area] for face in part.cylinders]
        arrays[f"cylinders{n}"] = np.reshape(rows, (-1, 7))
    with file.open("wb") as out:
        np.savez(out, **arrays)


def _loaded(file: Path) -> tuple[DrawnPart, ...]:
    """Read what `save_parts` wrote."""
    parts = []
    with np.load(file, allow_pickle=False) as arrays:
        names = zip(arrays["paths"].tolist(), arrays["products"].tolist(), strict=True)
        for n, (path, product) in enumerate(names):
            solid = look = None
            if f"solid{n}" in arrays:
                mass, *numbers = arrays[f"solid{n}"].tolist()
                solid = Inertial(mass, np.array(numbers[:3]), np.reshape(numbers[3:], (3, 3)))
            if f"vertices{n}" in arrays:
                color = tuple(arrays[f"color{n}"].tolist())
                look = Part(arrays[f"vertices{n}"], arrays[f"faces{n}"], color, product)
            rows = arrays[f"cylinders{n}"]
            cylinders = tuple(Cylinder(row[:3], row[3:6], float(row[6])) for row in rows)
            parts.append(DrawnPart(path, product, solid, look, cylinders))
    return tuple(parts)
