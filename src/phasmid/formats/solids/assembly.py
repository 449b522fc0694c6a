"""Assemblies: placed solids, link by link, their masses and triangles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import PhasmidError
from phasmid.extras import install_hint
from phasmid.robot import JOINTS, Part
from phasmid.robot.inertial import Inertial, merged

MM = 1000.0
"""Solids are drawn in millimetres, everything else is in metres."""

TOLERANCE = 0.15
"""Largest distance of a triangle from the solid [mm]."""

ANGULAR_TOLERANCE = 0.8
"""Largest angle between neighbouring triangles on a round face [rad]."""


@dataclass(frozen=True)
class Material:
    """A material: its density [kg/m³], and red, green, blue and opacity, 0 to 1."""

    name: str
    density: float
    color: tuple[float, float, float, float]


def _rgb(code: str) -> tuple[float, float, float, float]:
    r, g, b = (int(code[i : i + 2], 16) / 255 for i in (0, 2, 4))
    return r, g, b, 1.0


ALUMINIUM = Material("aluminium", 2680.0, _rgb("aab2bd"))
PAINTED = Material("painted aluminium", 2680.0, _rgb("5b9a3c"))
ACRYLIC = Material("acrylic", 1190.0, _rgb("3a424e"))
RUBBER = Material("rubber", 1150.0, _rgb("1d2024"))
NYLON = Material("nylon", 1150.0, _rgb("d5d9de"))
BATTERY = Material("battery", 2000.0, _rgb("2c4a86"))
BOARD = Material("circuit board", 1850.0, _rgb("1f5b4a"))
SERVO = Material("servo", 900.0, _rgb("23272d"))
"""A servo's own mass is known; this density stands for it only where that is not."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A distinct part, which may be placed many times.

    Attributes:
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
    """A part in its place, by its name in the link and its pose in the link's frame [m]."""

    name: str
    solid: Solid
    X_link_part: Float[np.ndarray, "4 4"]


@dataclass(frozen=True, eq=False)
class Assembly:
    """A robot of solids.

    Attributes:
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
    """Compute the mass properties of a uniform solid, in millimetres.

    Its mass [kg], as weighed, takes the place of the density [kg/m³].
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


def unique(path: str, taken: set[str]) -> str:
    """Reserve a path; add a number if it is taken."""
    name, number = path, 1
    while name in taken:
        number += 1
        name = f"{path}_{number}"
    taken.add(name)
    return name


@cache
def build123d() -> Any:
    """Import and return build123d.

    Raises:
        PhasmidError: It is not installed, or cannot be loaded.
    """
    check_installed()
    try:
        return import_module("build123d")
    except ImportError as error:
        # The cause shows an import that Ctrl-C interrupted.
        reason = " ".join(str(error).split())[:160]
        raise PhasmidError(f"build123d is installed and cannot be loaded: {reason}.") from error


def check_installed() -> None:
    """Refuse to go on without the library; it is not loaded, which takes seconds."""
    if find_spec("OCP") is None or find_spec("build123d") is None:
        raise PhasmidError(
            "solids and STEP files need build123d, which is not installed.",
            hint=install_hint("cad"),
        )
