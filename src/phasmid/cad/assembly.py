"""An assembly: placed solids, link by link, and what they weigh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.cad.library import build123d, occt
from phasmid.cad.material import Material

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
        is_hinge: Whether z of its frame is the axis of a joint.
    """

    name: str
    shape: Any
    material: Material
    mass: float | None = None
    is_hinge: bool = False


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


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass of a link and how it is spread.

    Attributes:
        mass: Mass [kg].
        com: Centre of mass in the link's frame [m], shape (3,).
        inertia: About the centre of mass, in the link's axes [kg·m²], shape (3, 3).
    """

    mass: float
    com: Float[np.ndarray, "3"]
    inertia: Float[np.ndarray, "3 3"]

    def at(self, X: Float[np.ndarray, "4 4"]) -> MassProperties:
        """The same mass seen from another frame, given the pose of its own in that one."""
        R = X[:3, :3]
        return MassProperties(self.mass, R @ self.com + X[:3, 3], R @ self.inertia @ R.T)


def mass_properties(assembly: Assembly) -> dict[str, MassProperties]:
    """Mass, centre of mass and inertia of each link, computed from its solids."""
    weighed: dict[int, MassProperties] = {}
    links = {}
    for link, parts in assembly.links.items():
        masses = []
        for part in parts:
            solid = part.solid
            if id(solid) not in weighed:
                weighed[id(solid)] = solid_mass(solid.shape, solid.material.density, solid.mass)
            masses.append(weighed[id(solid)].at(part.X_link_part))
        links[link] = together(masses)
    return links


def solid_mass(shape: Any, density: float, mass: float | None = None) -> MassProperties:
    """Mass properties of a uniform solid.

    Args:
        shape: The library's solid, in millimetres.
        density: Mass by volume [kg/m³].
        mass: As weighed [kg], in place of the density.
    """
    found = occt("GProp").GProp_GProps()
    occt("BRepGProp").BRepGProp.VolumeProperties_s(shape.wrapped, found)
    volume, centre, tensor = found.Mass(), found.CentreOfMass(), found.MatrixOfInertia()
    per_volume = density / MM**3 if mass is None else mass / volume
    inertia = np.array([[tensor.Value(row, column) for column in (1, 2, 3)] for row in (1, 2, 3)])
    return MassProperties(
        per_volume * volume,
        np.array([centre.X(), centre.Y(), centre.Z()]) / MM,
        per_volume * inertia / MM**2,
    )


def together(masses: list[MassProperties]) -> MassProperties:
    """Several masses of one frame as one."""
    mass = sum(part.mass for part in masses)
    com = np.sum([part.mass * part.com for part in masses], axis=0) / mass
    inertia = np.zeros((3, 3))
    for part in masses:
        d = part.com - com
        inertia += part.inertia + part.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return MassProperties(float(mass), com, inertia)


def location(X: Float[np.ndarray, "4 4"]) -> Any:
    """A pose in the library's words."""
    gp = occt("gp")
    turn = gp.gp_Trsf()
    rows = [[float(c) for c in (*X[row, :3], MM * X[row, 3])] for row in range(3)]
    turn.SetValues(*(c for row in rows for c in row))
    return build123d().Location(turn)
