"""Assemblies: placed solids, link by link, and their masses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.formats.solids.library import build123d
from phasmid.formats.solids.material import Material
from phasmid.robot.inertial import Inertial, merged

MM = 1000.0
"""Solids are drawn in millimetres, everything else is in metres."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A distinct part, which may be placed many times.

    Attributes:
        name: Such as ``servo``.
        shape: The library's solid, in millimetres, in the part's own frame.
        material: Gives its density and colour.
        mass: As weighed [kg]; None to take it from the density.
    """

    name: str
    shape: Any
    material: Material
    mass: float | None = None


@dataclass(frozen=True, eq=False)
class Placed:
    """A part in its place.

    Attributes:
        name: Its name in the link.
        solid: The part.
        X_link_part: Its pose in the link's frame [m], shape (4, 4).
    """

    name: str
    solid: Solid
    X_link_part: Float[np.ndarray, "4 4"]


@dataclass(frozen=True, eq=False)
class Assembly:
    """A robot of solids.

    Attributes:
        name: Of the robot.
        links: Parts by link: ``body``, and ``LEG.coxa``, ``LEG.femur``, ``LEG.tibia``.
        poses: Pose of each link's frame in the body's, as drawn [m], each of shape (4, 4).
    """

    name: str
    links: Mapping[str, tuple[Placed, ...]]
    poses: Mapping[str, Float[np.ndarray, "4 4"]]


def mass_properties(assembly: Assembly) -> dict[str, Inertial]:
    """Compute mass, centre of mass and inertia of each link from its solids."""
    links = {}
    for link, parts in assembly.links.items():
        solids = [(part.solid, part.X_link_part) for part in parts]
        whole = merged([solid_mass(s.shape, s.material.density, s.mass).at(X) for s, X in solids])
        assert whole is not None
        links[link] = whole
    return links


def solid_mass(shape: Any, density: float, mass: float | None = None) -> Inertial:
    """Compute the mass properties of a uniform solid.

    Args:
        shape: The library's solid, in millimetres.
        density: Mass by volume [kg/m³].
        mass: As weighed [kg], in place of the density.
    """
    per_volume = density / MM**3 if mass is None else mass / shape.volume
    return Inertial(
        per_volume * shape.volume,
        np.array(tuple(shape.center(build123d().CenterOf.MASS))) / MM,
        per_volume * np.array(shape.matrix_of_inertia) / MM**2,
    )


def location(X: Float[np.ndarray, "4 4"]) -> Any:
    """Convert a pose to the library's location."""
    b = build123d()
    origin, x, z = ([float(c) for c in row] for row in (MM * X[:3, 3], X[:3, 0], X[:3, 2]))
    return b.Location(b.Plane(origin=origin, x_dir=x, z_dir=z))
