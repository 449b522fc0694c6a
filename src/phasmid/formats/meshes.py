"""Mesh files: STL, OBJ and PLY by trimesh, and GLB; and the STL files of a written robot."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, WrongContent, own_words
from phasmid.formats.files import check_packages, named_file
from phasmid.formats.import_options import ImportOptions
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
    """A mesh that was left out; a robot walks without it."""


def scaled(part: Part, scale: Sequence[float]) -> Part:
    """Return a mesh scaled along its axes; if mirrored, its faces are turned."""
    factors = np.asarray(scale, dtype=float)
    if (factors == 1).all():
        return part
    faces = part.faces[:, ::-1] if np.prod(np.sign(factors)) < 0 else part.faces
    return replace(part, vertices=part.vertices * factors, faces=faces)


class MeshFiles:
    """The mesh files of one model; each is read once, however many links show it.

    The option ``mesh_unit`` takes the place of a scale that is the same along all axes.

    Raises:
        InvalidInput: A package of the options has no folder.
    """

    def __init__(self, model: Path, options: ImportOptions) -> None:
        check_packages(options.packages)
        self.model, self.options = model, options
        self._read: dict[Path, tuple[Part, ...]] = {}
        self._meshes = self._faces = 0

    def meshes(self, name: str, scale: Sequence[float] = (1.0, 1.0, 1.0)) -> tuple[Part, ...]:
        """Return the meshes of a file, in metres, scaled along x, y and z as the model says.

        Raises:
            UnreadMesh: The file is absent or lies outside the model's folder; or it cannot be read,
                holds no mesh, or is in another unit; or the scale is 0.
            InvalidInput: The model shows too many meshes or faces in all.
        """
        try:
            found = self._found(name, scale)
        except UnreadMesh:
            raise
        except InvalidInput as error:
            what = f"{error.what.rstrip('.')}; it was left out."
            raise UnreadMesh(what, hint=error.hint) from None
        self.count(found)
        return found

    def _found(self, name: str, scale: Sequence[float]) -> tuple[Part, ...]:
        if 0.0 in scale:
            raise InvalidInput(f'mesh "{short(name)}" is scaled by 0.')
        path = named_file(self.model, name, "mesh", self.options.packages)
        if not path.is_file():
            raise UnreadMesh(f'mesh "{short(name)}" is not there; it was left out.')
        if path not in self._read:
            self._read[path] = read_meshes(path)
        unit = UNITS.get(self.options.mesh_unit)
        if unit is not None:
            even = len({abs(factor) for factor in scale}) == 1
            scale = [unit * (np.sign(factor) if even else factor) for factor in scale]
        found = tuple(scaled(part, scale) for part in self._read[path])
        span = max(float(np.ptp(part.vertices, axis=0).max()) for part in found)
        if span > LARGEST_SPAN:
            raise InvalidInput(
                f"mesh {path.name} spans {plain_number(span)} m.",
                hint="" if self.options.mesh_unit == "mm" else 'mesh_unit = "mm"',
            )
        return found

    def count(self, shown: tuple[Part, ...]) -> None:
        """Count what the model shows; refuse too many meshes or faces in all."""
        self._meshes += len(shown)
        self._faces += sum(len(part.faces) for part in shown)
        if self._meshes > MOST_MESHES or self._faces > MOST_FACES:
            raise InvalidInput(
                f"the model shows more than {plain_number(MOST_MESHES)} meshes or "
                f"{plain_number(MOST_FACES)} faces; such models are refused."
            )


def read_meshes(path: Path) -> tuple[Part, ...]:
    """Return the meshes in an ``.stl``, ``.obj``, ``.ply`` or ``.glb`` file, in the file's unit.

    Raises:
        InvalidInput: The file is of another kind, damaged, empty or too large.
    """
    kind, name = path.suffix.lower(), path.name
    if kind == ".glb":
        parts = [part for found in read_glb(path).values() for part in found]
        if not parts:
            raise InvalidInput(f"mesh {name} is empty.")
        return tuple(replace(part, name="") for part in parts)
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
            f"mesh {name} has {plain_number(len(corners) // 3, 9)} faces; "
            f"the limit is {plain_number(MOST_FACES)}."
        )
    bad = int(np.count_nonzero(~np.isfinite(corners).all(axis=1)))
    if bad:
        raise InvalidInput(f"mesh {name} has {bad} corners that are not finite.")
    # Adding zero makes zeros of either sign one place.
    vertices, index = np.unique(corners[:, ::-1] + 0.0, axis=0, return_inverse=True)
    return (Part(vertices[:, ::-1], index.reshape(-1, 3)),)


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
                raise WrongContent("it holds no triangles in space")
            return np.asarray(vertices[faces].reshape(-1, 3))
    except Exception as error:
        # The reader of meshes complains in many ways of its own.
        raise InvalidInput(f"mesh {name} is no {kind.upper()} file{own_words(error)}.") from None


def primitive(shape: str, **measures: Any) -> Part:
    """Return a shape of `trimesh.creation` about its centre, its axis along z [m].

    ``box`` has ``extents``, ``icosphere`` a ``radius``, ``cylinder`` and ``capsule`` also a
    ``height``; a capsule is a cylinder of that height between two half spheres.
    """
    import trimesh.creation

    fineness: dict[str, dict[str, Any]] = {
        "icosphere": {"subdivisions": 2},
        "cylinder": {"sections": 24},
        "capsule": {"count": [16, 16]},
    }
    made: Any = getattr(trimesh.creation, shape)(**measures, **fineness.get(shape, {}))
    vertices = np.asarray(made.vertices, dtype=float)
    middle = (vertices.max(axis=0) + vertices.min(axis=0)) / 2
    return Part(vertices - middle, made.faces)


def stl(part: Part) -> bytes:
    """Return triangles as a binary STL file, in single precision."""
    import trimesh

    mesh: Any = trimesh.Trimesh(part.vertices, part.faces, process=False)
    return bytes(mesh.export(file_type="stl"))


class StlFiles:
    """STL files of one robot, each mesh once, with names that every file system takes.

    Attributes:
        folder: Their folder beside the robot's file, by whose name it is called.
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
