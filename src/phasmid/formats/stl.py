"""STL files out: the meshes of a robot, each written once."""

from __future__ import annotations

import re

import numpy as np

from phasmid.robot import Part


def stl(part: Part) -> bytes:
    """Write a part's triangles as a binary STL file, in single precision."""
    corners = part.vertices[part.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])
    faces = np.zeros(len(corners), record)
    faces["normal"] = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    faces["corners"] = corners
    return bytes(80) + len(corners).to_bytes(4, "little") + faces.tobytes()


def meshes_of(name: str) -> str:
    """Return the folder for the meshes of a robot file; two robots can lie side by side."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", f"{name}_meshes")


class StlFiles:
    """Mesh files of one robot, with names that every file system takes.

    Attributes:
        files: Content by name.
    """

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self.files: dict[str, bytes] = {}
        self._names: dict[bytes, str] = {}

    def add(self, part: Part, name: str) -> str:
        """Return the file of a part, of this name unless another part is alike.

        Args:
            part: The part.
            name: Proposed name, without an ending.
        """
        content = stl(part)
        if content not in self._names:
            stem = re.sub(r"[^A-Za-z0-9_-]+", "_", name)[:80] or "mesh"
            # Some file systems know no capitals.
            taken = {file.lower() for file in self.files}
            number, file = 1, f"{self.folder}/{stem}.stl"
            while file.lower() in taken:
                number += 1
                file = f"{self.folder}/{stem}_{number}.stl"
            self._names[content] = file
            self.files[file] = content
        return self._names[content]
