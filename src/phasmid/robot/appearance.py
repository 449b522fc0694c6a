"""Appearance of a robot: coloured meshes of its links, without effect on physics."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Integer

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.robot.gltf import check_glb
from phasmid.robot.plain_glb import PlainMesh, plain_meshes

LARGEST_FILE = 64_000_000
"""Files of meshes above this many bytes are refused."""

MOST_FACES = 5_000_000
"""Meshes of more triangles than this are refused."""


@dataclass(frozen=True, eq=False)
class Part:
    """Rigid part of a link: a triangle mesh of one colour, in the link's frame.

    Attributes:
        vertices: Corners [m], shape (V, 3).
        faces: Indices of each triangle's corners, counter-clockwise from outside, shape (F, 3).
        color: Red, green, blue and opacity, 0 to 1.
        name: Such as ``servo``; empty where it has none.

    Raises:
        InvalidRobot: The mesh is empty, not finite, too large, or a face has no such corner.
    """

    vertices: Float[np.ndarray, "vertices 3"]
    faces: Integer[np.ndarray, "faces 3"]
    color: tuple[float, float, float, float] = (0.5, 0.5, 0.5, 1.0)
    name: str = ""

    def __post_init__(self) -> None:
        what = f"mesh {self.name}".strip()
        vertices = np.array(self.vertices, dtype=float)
        faces = np.array(self.faces, dtype=np.int64)
        for array, noun in ((vertices, "corners"), (faces, "faces")):
            if array.ndim != 2 or array.shape[1] != 3 or not len(array):
                raise InvalidRobot(
                    f"{what} has {noun} of shape {array.shape}; it must be (n, 3), n 1 or more."
                )
            array.flags.writeable = False
        if len(faces) > MOST_FACES:
            raise InvalidRobot(f"{what} has {len(faces)} faces; the limit is {MOST_FACES}.")
        bad = int(np.count_nonzero(~np.isfinite(vertices).all(axis=1)))
        if bad:
            raise InvalidRobot(f"{what} has {bad} corners that are not finite.")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InvalidRobot(f"{what}: a face names a corner that is not there.")
        if not all(0 <= c <= 1 for c in self.color) or len(self.color) != 4:
            raise InvalidRobot(f"{what}: a colour is four numbers from 0 to 1.")
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)

    def at(self, X: Float[np.ndarray, "4 4"]) -> Part:
        """Return the part transformed by a pose, such as ``X_link_part``."""
        moved = self.vertices @ X[:3, :3].T + X[:3, 3]
        return Part(moved, self.faces, self.color, self.name)


@dataclass(frozen=True, eq=False)
class Appearance:
    """Meshes of a robot's links, read from the file at the first access.

    A link is called ``body``, or ``LEG.coxa``, ``LEG.femur`` and ``LEG.tibia`` after its leg;
    ``coxa``, ``femur`` and ``tibia`` alone stand for every leg that has none of its own. Frames
    are the body's and those of Table 1.

    Attributes:
        read: Gives the parts of each named link.
        name: Of its file, without folders; empty where there is none.
    """

    read: Callable[[], Mapping[str, tuple[Part, ...]]] = field(repr=False)
    name: str = ""

    @classmethod
    def of(cls, parts: Mapping[str, tuple[Part, ...]], name: str = "") -> Appearance:
        """Return the appearance of parts."""
        return cls(lambda: parts, name)

    @classmethod
    def from_file(cls, path: Path) -> Appearance:
        """Return the appearance in a ``.glb`` file, which is read at the first access."""
        return cls(lambda: read_glb(path), path.name)

    @cached_property
    def parts(self) -> Mapping[str, tuple[Part, ...]]:
        """Parts of each named link.

        Raises:
            InvalidInput: The file cannot be read.
        """
        return self.read()

    def link(self, leg: str, joint: str) -> tuple[Part, ...]:
        """Return the parts of a leg's link, its own or the shared ones.

        Args:
            leg: Name of the leg.
            joint: ``coxa``, ``femur`` or ``tibia``.
        """
        return self.parts.get(f"{leg}.{joint}", self.parts.get(joint, ()))

    @property
    def body(self) -> tuple[Part, ...]:
        """Parts of the trunk."""
        return self.parts.get("body", ())


def read_glb(path: Path) -> dict[str, tuple[Part, ...]]:
    """Read the parts of a binary glTF file with nodes named ``LINK/PART``.

    Raises:
        InvalidInput: It is absent, too large or no such file.
        InvalidRobot: A mesh in it is impossible.
    """
    try:
        with path.open("rb") as file:
            raw = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise InvalidInput(f"cannot read {path}: {reason}.") from None
    if len(raw) > LARGEST_FILE:
        raise InvalidInput(f"{path} holds more than {LARGEST_FILE} bytes; such files are refused.")
    check_glb(raw, path.name, most_bytes=LARGEST_FILE, most_faces=MOST_FACES)
    parts: dict[str, list[Part]] = {}
    plain = plain_meshes(raw)
    for node, vertices, faces, color in _any_meshes(raw, path.name) if plain is None else plain:
        link, _, name = node.partition("/")
        parts.setdefault(link, []).append(Part(vertices, faces, color, name))
    return {link: tuple(found) for link, found in parts.items()}


def _any_meshes(raw: bytes, name: str) -> list[PlainMesh]:
    """Read the meshes of any file in its own frame.

    Raises:
        InvalidInput: It is no such file.
        InvalidRobot: A mesh in it is impossible.
    """
    import trimesh

    try:
        scene: Any = trimesh.load_scene(io.BytesIO(raw), file_type="glb", process=False)
        found = [(node, *scene.graph[node]) for node in sorted(scene.graph.nodes_geometry)]
        meshes = [
            (str(node), np.array(X, dtype=float), mesh.vertices, _faces(mesh), _color(mesh))
            for node, X, mesh in ((n, X, scene.geometry[geometry]) for n, X, geometry in found)
        ]
    except Exception as error:
        # The mesh reader raises many kinds of exceptions.
        raise InvalidInput(f"{name} is no binary glTF file: {error}.") from None
    placed = [
        (node, Part(np.asarray(vertices), np.asarray(faces), color, node.partition("/")[2]).at(X))
        for node, X, vertices, faces, color in meshes
    ]
    return [PlainMesh(node, part.vertices, part.faces, part.color) for node, part in placed]


def _faces(mesh: Any) -> Any:
    if not hasattr(mesh, "faces"):
        raise ValueError("it holds points or lines without faces")
    return mesh.faces


def _color(mesh: Any) -> tuple[float, float, float, float]:
    material = getattr(mesh.visual, "material", None)
    rgba = getattr(material, "baseColorFactor", None)
    if rgba is None:
        return 0.5, 0.5, 0.5, 1.0
    r, g, b, a = (float(c) / 255 for c in np.asarray(rgba, dtype=float))
    return r, g, b, a


def glb(parts: Mapping[str, tuple[Part, ...]]) -> bytes:
    """Return parts as a binary glTF file for `read_glb`, in single precision."""
    import trimesh as library

    # Its own annotations are partial.
    trimesh: Any = library
    scene = trimesh.Scene()
    for link, pieces in parts.items():
        for number, part in enumerate(pieces):
            rgba = [round(255 * c) for c in part.color]
            material = trimesh.visual.material.PBRMaterial(
                baseColorFactor=rgba, metallicFactor=0.1, roughnessFactor=0.7
            )
            mesh = trimesh.Trimesh(part.vertices, part.faces, process=False)
            mesh.visual = trimesh.visual.TextureVisuals(material=material)
            name = f"{link}/{part.name or number}"
            if name in scene.graph.nodes:
                name = f"{link}/{part.name} {number}"
            scene.add_geometry(mesh, node_name=name, geom_name=name)
    return bytes(scene.export(file_type="glb"))
