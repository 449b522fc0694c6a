"""Mesh files: STL, OBJ and PLY by trimesh, and GLB; and the STL files of a written robot."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Integer

from phasmid.errors import InvalidInput
from phasmid.formats.xml import short
from phasmid.robot import Part
from phasmid.robot.appearance import MOST_FACES
from phasmid.robot.glb import LARGEST_FILE, read_glb
from phasmid.toml import read_bytes
from phasmid.units import plain_number

LARGEST_SPAN = 5.0
"""Meshes longer than this are given in another unit [m]."""

MOST_MESHES = 2000
"""Models that show more pieces than this are refused."""

LARGEST_OTHER = 12_000_000
"""OBJ and PLY files above this many bytes are refused: trimesh takes 30 times their size."""

UNITS = {"m": 1.0, "mm": 1e-3}
"""Metres per unit of mesh files."""

Color = tuple[float, float, float, float]


class UnreadMesh(InvalidInput):
    """A mesh of a kind that is not read here; a robot walks without it."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles as a file gives them.

    Attributes:
        vertices: Corners, no two of them alike, shape (V, 3).
        faces: Indices of each triangle's corners, counter-clockwise from outside, shape (F, 3).
        color: Red, green, blue and opacity, 0 to 1; None where the file gives none.
    """

    vertices: Float[np.ndarray, "vertices 3"]
    faces: Integer[np.ndarray, "faces 3"]
    color: Color | None = None

    @property
    def span(self) -> float:
        """Longest side of the box around it."""
        return float(np.ptp(self.vertices, axis=0).max())

    def scaled(self, scale: Sequence[float]) -> Mesh:
        """Return the mesh scaled along its axes; if mirrored, its faces are turned."""
        factors = np.asarray(scale, dtype=float)
        if (factors == 1).all():
            return self
        faces = self.faces[:, ::-1] if np.prod(np.sign(factors)) < 0 else self.faces
        return Mesh(self.vertices * factors, faces, self.color)


def joined(
    pieces: Sequence[Mesh | Part],
) -> tuple[Float[np.ndarray, "vertices 3"], Integer[np.ndarray, "faces 3"]]:
    """Return vertices and faces of meshes as those of one."""
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    faces = [piece.faces + start for piece, start in zip(pieces, starts, strict=False)]
    return np.concatenate([piece.vertices for piece in pieces]), np.concatenate(faces)


class MeshFiles:
    """The mesh files of one model; each is read once, however many links show it.

    Args:
        unit: ``m`` or ``mm``: the unit of all files, which takes the place of a scale that is
            the same along all axes; empty for the model's own scale.
    """

    def __init__(self, unit: str = "") -> None:
        self.unit = unit
        self._read: dict[Path, tuple[Mesh, ...]] = {}
        self._meshes = self._faces = 0

    def meshes(self, path: Path, scale: Sequence[float] = (1.0, 1.0, 1.0)) -> tuple[Mesh, ...]:
        """Return the meshes of a file, in metres.

        Args:
            path: The file.
            scale: Factors along x, y and z that the model gives.

        Raises:
            UnreadMesh: Files of this kind are not read.
            InvalidInput: The file cannot be read, holds no mesh, or is in another unit.
        """
        if path not in self._read:
            self._read[path] = read_meshes(path)
        if self.unit:
            even = len({abs(factor) for factor in scale}) == 1
            size = UNITS[self.unit]
            scale = [size * (np.sign(f) if even else f) for f in scale]
        found = tuple(mesh.scaled(scale) for mesh in self._read[path])
        self.count(found)
        span = max(mesh.span for mesh in found)
        if span > LARGEST_SPAN:
            raise InvalidInput(
                f"mesh {path.name} spans {plain_number(span)} m.",
                hint="--mesh-unit mm" if self.unit != "mm" else "",
            )
        return found

    def count(self, shown: tuple[Mesh, ...]) -> None:
        """Count what the model shows.

        Raises:
            InvalidInput: It has too many meshes or faces in all.
        """
        self._meshes += len(shown)
        self._faces += sum(len(mesh.faces) for mesh in shown)
        for number, most, noun in (
            (self._meshes, MOST_MESHES, "meshes"),
            (self._faces, MOST_FACES, "faces"),
        ):
            if number > most:
                raise InvalidInput(
                    f"the model shows more than {_grouped(most)} {noun}; such models are refused."
                )


def read_meshes(path: Path) -> tuple[Mesh, ...]:
    """Return the meshes in an ``.stl``, ``.obj``, ``.ply`` or ``.glb`` file, in the file's unit.

    Raises:
        UnreadMesh: Files of this kind are not read.
        InvalidInput: The file cannot be read, is damaged, empty or too large.
    """
    kind, name = path.suffix.lower(), path.name
    if kind == ".glb":
        parts = [part for found in read_glb(path).values() for part in found]
        if not parts:
            raise InvalidInput(f"mesh {name} is empty.")
        return tuple(Mesh(part.vertices, part.faces, part.color) for part in parts)
    if kind not in (".stl", ".obj", ".ply"):
        what = "COLLADA files" if kind == ".dae" else f'files of the kind "{kind}"'
        raise UnreadMesh(
            f"mesh {name} was left out: {what} are not read.",
            hint="convert it to STL, OBJ, PLY or GLB",
        )
    raw = read_bytes(path, LARGEST_FILE if kind == ".stl" else LARGEST_OTHER)
    corners = _corners(raw, name) if raw else np.empty((0, 3))
    if not len(corners):
        raise InvalidInput(f"mesh {name} is empty.")
    if len(corners) > 3 * MOST_FACES:
        raise InvalidInput(
            f"mesh {name} has {_grouped(len(corners) // 3)} faces; "
            f"the limit is {_grouped(MOST_FACES)}."
        )
    bad = int(np.count_nonzero(~np.isfinite(corners).all(axis=1)))
    if bad:
        raise InvalidInput(f"mesh {name} has {_grouped(bad)} corners that are not finite.")
    # Adding zero makes zeros of either sign one place.
    vertices, index = np.unique(corners[:, ::-1] + 0.0, axis=0, return_inverse=True)
    return (Mesh(vertices[:, ::-1].copy(), index.reshape(-1, 3)),)


def _corners(raw: bytes, name: str) -> Float[np.ndarray, "corners 3"]:
    """Return three corners for each triangle of a file."""
    import trimesh

    kind = name.rpartition(".")[2].lower()
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            # Without a resolver no other file is opened, such as materials.
            loaded: Any = trimesh.load_mesh(io.BytesIO(raw), file_type=kind, process=False)
            vertices = np.asarray(loaded.vertices, dtype=float)
            faces = np.asarray(loaded.faces, dtype=np.int64)
            if not faces.shape[1:] == vertices.shape[1:] == (3,):
                raise ValueError("it holds no triangles in space")
            return np.asarray(vertices[faces].reshape(-1, 3))
    except Exception as error:
        # The reader of meshes complains in many ways of its own.
        reason = short(str(error), 80).rstrip(".") or type(error).__name__
        raise InvalidInput(f"mesh {name} is no {kind.upper()} file: {reason}.") from None


def _grouped(number: int) -> str:
    return f"{number:,}".replace(",", " ")


def box(size: Sequence[float]) -> Mesh:
    """Return a box about its centre, of a length along each axis [m]."""
    return _made("box", extents=list(size))


def sphere(radius: float) -> Mesh:
    """Return a sphere about its centre."""
    return _made("icosphere", radius=radius, subdivisions=2)


def cylinder(radius: float, length: float) -> Mesh:
    """Return a cylinder about its centre, along z."""
    return _made("cylinder", radius=radius, height=length, sections=24)


def capsule(radius: float, length: float) -> Mesh:
    """Return a cylinder along z of a length between two half spheres, about its centre."""
    made = _made("capsule", radius=radius, height=length, count=[16, 16])
    middle = (made.vertices.max(axis=0) + made.vertices.min(axis=0)) / 2
    return Mesh(made.vertices - middle, made.faces)


def _made(shape: str, **measures: Any) -> Mesh:
    import trimesh.creation

    made: Any = getattr(trimesh.creation, shape)(**measures)
    return Mesh(np.array(made.vertices, dtype=float), np.array(made.faces, dtype=np.int64))


def stl(piece: Mesh | Part) -> bytes:
    """Return triangles as a binary STL file, in single precision."""
    import trimesh

    mesh: Any = trimesh.Trimesh(piece.vertices, piece.faces, process=False)
    return bytes(mesh.export(file_type="stl"))


class StlFiles:
    """STL files of one robot, each mesh once, with names that every file system takes.

    Args:
        name: Name of the robot's file; two robots can lie side by side.

    Attributes:
        folder: Their folder beside that file.
        files: Content by name.
    """

    def __init__(self, name: str) -> None:
        self.folder = re.sub(r"[^A-Za-z0-9_.-]+", "_", f"{name}_meshes")
        self.files: dict[str, bytes] = {}
        self._names: dict[bytes, str] = {}

    def add(self, part: Part, name: str) -> str:
        """Return the file of a part: a new one of this name, or that of a part that is alike."""
        # The engine and other readers know single precision alone.
        alike = part.vertices[part.faces].astype("<f4").tobytes()
        if alike not in self._names:
            stem = re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:80] or "mesh"
            # Some file systems know no capitals.
            taken = {file.lower() for file in self.files}
            number, file = 1, f"{self.folder}/{stem}.stl"
            while file.lower() in taken:
                number += 1
                file = f"{self.folder}/{stem}_{number}.stl"
            self._names[alike] = file
            self.files[file] = stl(part)
        return self._names[alike]
