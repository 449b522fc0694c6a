"""Masses and inertias by options, in place of a file's."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot
from phasmid.formats.findings import Findings
from phasmid.formats.options import ImportOptions
from phasmid.robot import Part
from phasmid.robot.inertial import Inertial
from phasmid.units import plain_number

SLENDER = 0.25
"""Width of a link without a mesh, of its length; that of the PhantomX's femur."""

THINNEST = 0.005
"""Least side of the box of a link [m]: a mesh may be flat, a link is not."""

NO_MASS = "--masses geometry with --total-mass-g"
"""Hint where a link has no mass."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A link in its frame of Table 1, or the trunk in the body's, with unchecked masses.

    Attributes:
        subject: Of messages, such as ``link tibia_rf``.
        leg: Name of its leg; empty for the trunk.
        joint: ``coxa``, ``femur``, ``tibia``, or ``body``.
        length: From joint to joint [m].
        size: Box of the trunk [m], shape (3,).
        inertial: Mass and inertia; None where there is none.
        parts: Its look, in this frame.
        where: File and line.
    """

    subject: str
    leg: str
    joint: str
    length: float
    size: Float[np.ndarray, "3"]
    inertial: Inertial | None
    parts: tuple[Part, ...]
    where: str

    @property
    def mass(self) -> float:
        """Mass [kg]; 0 without one."""
        return self.inertial.mass if self.inertial else 0.0

    @property
    def box(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of its meshes, or of a rod or box in their place [m]."""
        half = SLENDER * self.length / 2
        if self.parts:
            corners = np.concatenate([part.vertices for part in self.parts])
        elif self.joint == "body":
            corners = np.array([-self.size / 2, self.size / 2])
        else:
            corners = np.array([[0.0, -half, -half], [self.length, half, half]])
        low, high = corners.min(axis=0), corners.max(axis=0)
        thin = np.maximum(0.0, THINNEST - (high - low)) / 2
        return np.array([low - thin, high + thin])

    def spread(self, mass: float) -> Piece:
        """Return the link as a solid box of a mass [kg]."""
        low, high = self.box
        a, b, c = (high - low) ** 2
        inertia = np.diag([b + c, a + c, a + b]) * mass / 12
        return replace(self, inertial=Inertial(mass, (low + high) / 2, inertia))


def weighed(links: Sequence[Piece], options: ImportOptions, findings: Findings) -> list[Piece]:
    """Apply the options to the masses and inertias of links.

    Args:
        links: All links of a robot.
        options: Options ``masses`` and ``total_mass``.
        findings: Receives what was done.

    Raises:
        InvalidRobot: There is no mass to scale.
    """
    chosen, total_mass = list(links), options.total_mass
    bare = sum(not link.mass for link in links)
    if options.masses == "geometry" and bare and total_mass is not None:
        volumes = [float(np.prod(np.diff(link.box, axis=0))) for link in links]
        density = total_mass / sum(volumes)
        findings.note(
            "masses",
            f"{bare} of {len(links)} links have no mass in the file; {plain_number(total_mass)} kg "
            "were shared among all links by the volume of their boxes.",
        )
        return [link.spread(density * v) for link, v in zip(links, volumes, strict=True)]
    if options.masses == "geometry":
        what = "every link keeps its mass, spread over its box; the file's inertias are not used."
        findings.note("masses", what)
        chosen = [link.spread(link.mass) if link.inertial else link for link in links]
    total = sum(link.mass for link in chosen)
    if total_mass is None or math.isclose(total, total_mass, rel_tol=1e-12):
        return chosen
    if not total > 0:
        raise InvalidRobot("no link has a mass that could be scaled.", hint="--masses geometry")
    factor = total_mass / total
    findings.note(
        "masses",
        f"were scaled by {plain_number(factor)}, from {plain_number(total)} kg to "
        f"{plain_number(total_mass)} kg.",
    )
    return [
        replace(link, inertial=link.inertial and link.inertial.scaled(factor)) for link in chosen
    ]
