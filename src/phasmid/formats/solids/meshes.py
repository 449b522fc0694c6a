"""Triangles of an assembly's solids: the look of a robot."""

from __future__ import annotations

import numpy as np

from phasmid.formats.solids.assembly import MM, Assembly, Placed
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
    found: dict[str, tuple[Part, ...]] = {}
    for joint in ("body", *JOINTS):
        links = {
            link: parts
            for link, parts in assembly.links.items()
            if link.rpartition(".")[2] == joint
        }
        first, *others = links.values()
        if all(_alike(parts, first) for parts in others):
            links = {joint: first}
        found |= {link: tuple(map(_mesh, parts)) for link, parts in links.items()}
    return found


def _mesh(part: Placed) -> Part:
    """Return a part's triangles, in its link's frame."""
    vertices, faces = part.solid.shape.tessellate(TOLERANCE, ANGULAR_TOLERANCE)
    corners = np.array([tuple(vertex) for vertex in vertices]) / MM
    color = part.solid.material.color
    return Part(corners, np.array(faces), color, part.name).at(part.X_link_part)


def _alike(one: tuple[Placed, ...], other: tuple[Placed, ...]) -> bool:
    return len(one) == len(other) and all(
        a.name == b.name
        and a.solid.shape is b.solid.shape
        and np.allclose(a.X_link_part, b.X_link_part, rtol=0, atol=1e-9)
        for a, b in zip(one, other, strict=True)
    )
