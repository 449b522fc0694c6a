"""``python -m phasmid.formats.solids.reader FILE OUT`` reads a STEP file in a process of its own.

The geometry kernel can crash, loop or eat memory over a damaged file; here only this process does.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.formats.solids.assembly import (
    ANGULAR_TOLERANCE,
    MM,
    TOLERANCE,
    build123d,
    solid_mass,
    unique,
)
from phasmid.formats.solids.drawing import REFUSED, Cylinder, DrawnPart, save_parts
from phasmid.robot import Part

MOST_PARTS = 4000
"""Files of more placed parts than this are refused."""

MOST_TRIANGLES = 4_000_000
"""Files whose parts make more triangles than this are refused."""

MEMORY = 12_000_000_000
"""Most address space that the process may take [B], where the system can limit it."""

_OTHER_FILE = re.compile(
    rb"(?:DOCUMENT_FILE|EXTERNAL_IDENTIFICATION_ASSIGNMENT)[^']{0,80}(?:'([^']*)')?", re.IGNORECASE
)
"""Entities of a STEP file that name other files, which the kernel would open wherever they lie."""


class _Refused(Exception):
    """A file over a limit, or one without shapes; the sentence follows its name."""


def main(file: str, out: str) -> int:
    """Read a file and write its parts; return the exit status."""
    with suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        parts = _read(Path(file))
    except _Refused as refused:
        print(refused, flush=True)  # noqa: T201
        return REFUSED
    save_parts(parts, Path(out))
    return 0


def _read(file: Path) -> list[DrawnPart]:
    if other := _OTHER_FILE.search(file.read_bytes()):
        name = (other.group(1) or b"").decode("utf-8", "replace")
        shown = "".join(c for c in name if c.isprintable())[:100] or "one"
        raise _Refused(f"has parts in other files, such as {shown}; write all parts into one")
    b = build123d()
    root = b.import_step(str(file))
    # A single root is the robot, whose name says nothing of its parts.
    root.label = "" if root.children else root.label or "part"
    measured: dict[Any, DrawnPart] = {}
    parts: list[DrawnPart] = []
    triangles = 0
    for path, node in _leaves(root, root.label, set()):
        X = _pose(node.global_location)
        # In its own frame it equals all others that share its solid.
        shape = type(node)(node.wrapped.Located(b.Location().wrapped))
        if shape not in measured:
            measured[shape] = _measured(shape, node.label, node.color)
        parts.append(measured[shape].at(X, path))
        triangles += len(parts[-1].look.faces) if parts[-1].look else 0
        if len(parts) > MOST_PARTS or triangles > MOST_TRIANGLES:
            raise _Refused(
                f"holds more than {MOST_PARTS} parts or {MOST_TRIANGLES} triangles; such files "
                "are refused"
            )
    if not parts:
        raise _Refused("holds no shapes that can be read")
    return parts


def _leaves(node: Any, path: str, taken: set[str]) -> Iterator[tuple[str, Any]]:
    """Yield path and shape of every placed part."""
    for child in node.children:
        name = child.label.replace("/", "_")[:200] or "part"
        yield from _leaves(child, unique(f"{path}/{name}".strip("/"), taken), taken)
    if not node.children and node.wrapped is not None:
        yield path, node


def _pose(place: Any) -> np.ndarray:
    turn = place.wrapped.Transformation()
    X = np.eye(4)
    X[:3] = [[turn.Value(row, column) for column in (1, 2, 3, 4)] for row in (1, 2, 3)]
    X[:3, 3] /= MM
    return X


def _measured(shape: Any, name: str, color: Any) -> DrawnPart:
    """Measure a part, in its own frame."""
    try:
        corners, faces = shape.tessellate(TOLERANCE, ANGULAR_TOLERANCE)
    except AttributeError:
        # A face that cannot be drawn.
        corners, faces = [], []
    vertices = np.reshape([tuple(corner) for corner in corners], (-1, 3)) / MM
    solid = solid_mass(shape, 1.0) if shape.solids() else None
    cylinders = tuple(
        Cylinder(
            np.array(tuple(face.axis_of_rotation.position)) / MM,
            np.array(tuple(face.axis_of_rotation.direction)),
            face.area / MM**2,
        )
        for face in shape.faces().filter_by(build123d().GeomType.CYLINDER)
        if face.radius
    )
    numbers = [vertices] + [np.r_[c.point, c.direction, c.area] for c in cylinders]
    if solid is not None:
        numbers += [np.array(solid.mass), solid.com, solid.inertia]
    if not all(np.isfinite(array).all() for array in numbers):
        raise _Refused(f"has a part {name} with measures that are not finite")
    if solid is not None and not solid.mass > 0:
        solid = None
    look = None
    if len(faces):
        look = Part(vertices, np.array(faces), tuple(color) if color else Part.color, name)
    return DrawnPart("", name, solid, look, cylinders)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2]))
