"""Appearance of a robot: coloured meshes of its links, without effect on physics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float, Integer

from phasmid.errors import InvalidRobot

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
        if not np.isfinite(vertices).all():
            raise InvalidRobot(f"{what} has corners that are not finite.")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise InvalidRobot(f"{what}: a face refers to a corner that does not exist.")
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

    @cached_property
    def parts(self) -> Mapping[str, tuple[Part, ...]]:
        """Parts of each named link.

        Raises:
            InvalidInput: The file cannot be read.
        """
        return self.read()

    def link(self, leg: str, joint: str) -> tuple[Part, ...]:
        """Return the parts of a leg's link, its own or the shared ones."""
        return self.parts.get(f"{leg}.{joint}", self.parts.get(joint, ()))

    @property
    def body(self) -> tuple[Part, ...]:
        """Parts of the trunk."""
        return self.parts.get("body", ())
