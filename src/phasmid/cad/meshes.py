"""Triangles of an assembly's solids: the look of a robot."""

from __future__ import annotations

import numpy as np

from phasmid.cad.assembly import MM, Assembly, Solid
from phasmid.robot import JOINTS, Part

TOLERANCE = 0.15
"""Largest distance of a triangle from the solid [mm]."""

ANGULAR_TOLERANCE = 0.8
"""Largest angle between neighbouring triangles on a round face [rad]."""


def meshes(assembly: Assembly) -> dict[str, tuple[Part, ...]]:
    """Coloured meshes of each link, in the links' frames.

    Returns:
        ``body``, and ``coxa``, ``femur`` and ``tibia`` where all legs are alike, ``LEG.coxa`` and
        so on where they are not.
    """
    made: dict[int, Part] = {}
    found: dict[str, tuple[Part, ...]] = {}
    for link, parts in assembly.links.items():
        pieces = []
        for placed in parts:
            key = id(placed.solid.shape)
            if key not in made:
                made[key] = mesh(placed.solid)
            part = made[key].at(placed.X_link_part)
            color = placed.solid.material.color
            pieces.append(Part(part.vertices, part.faces, color, placed.name))
        found[link] = tuple(pieces)
    shared = {"body": found.pop("body")}
    for joint in JOINTS:
        same = [pieces for link, pieces in found.items() if link.endswith(f".{joint}")]
        if all(_alike(pieces, same[0]) for pieces in same):
            shared[joint] = same[0]
        else:
            shared |= {k: v for k, v in found.items() if k.endswith(f".{joint}")}
    return shared


def mesh(solid: Solid) -> Part:
    """Return a part's triangles, in its own frame."""
    vertices, faces = solid.shape.tessellate(TOLERANCE, ANGULAR_TOLERANCE)
    corners = np.array([(vertex.X, vertex.Y, vertex.Z) for vertex in vertices]) / MM
    return Part(corners, np.array(faces), solid.material.color, solid.name)


def _alike(one: tuple[Part, ...], other: tuple[Part, ...]) -> bool:
    if one is other:
        return True
    return len(one) == len(other) and all(
        a.name == b.name
        and a.color == b.color
        and a.vertices.shape == b.vertices.shape
        and np.array_equal(a.faces, b.faces)
        and np.allclose(a.vertices, b.vertices, rtol=0, atol=1e-9)
        for a, b in zip(one, other, strict=True)
    )
