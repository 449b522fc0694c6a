"""Judgement of one body: mass, centre of mass and inertia from a file against its shape."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.formats.findings import Finding, Severity
from phasmid.robot import Part
from phasmid.robot.inertial import Inertial
from phasmid.units import plain_number

SMALLEST = 0.04
"""Bodies are taken as at least this long [m]: a servo sits beside a short link."""

WIDEST_RADIUS, NARROWEST_RADIUS = 1.5, 0.02
"""Gyration radius in lengths of the body that `Link` and `Body` still accept. A rod has 0.29, two
masses at the ends of one 0.5; nothing inside its own bounds has more than 0.87 (half the diagonal
of a cube), and 1.5 leaves room for masses beside the bounds."""

LIKELY_RADII = (0.05, 0.9)
"""Gyration radius in lengths of the body that its own bounds allow; used to find slips of unit."""

LIGHTEST, DENSEST = 100.0, 9000.0
"""Densities of robot materials [kg/m³]: printed foam and thin shells above 100, brass and
copper below 9000."""

ROUNDED, ROUND_OFF = 1e-3, 1e-10
"""Part by which the largest moment of a plate may exceed the sum of the others when it was written
with four digits, and when it was only computed."""

SERVO = 0.06
"""A link may weigh a servo more than its mesh does [kg]: a servo between two links is drawn with
one and weighed with the other; those of this project's presets have 55 to 57 g."""

OUTSIDE = 0.1
"""Centres of mass may lie outside a body's bounds by this part of its length: meshes leave out
screws, cables and horns."""

SLIPS = (1e-3, 1e-6, 1e-9, 1e3, 1e6)
"""Factors by which a wrong unit spoils a number: mm for m, g for kg, g mm² for kg m²."""

Find = Callable[[Severity, str, str], None]
"""Records a finding: severity, sentence and hint."""

AXES = ((0, 1, "xy", 2), (0, 2, "xz", 1), (1, 2, "yz", 0))
"""Rows and columns of the products of inertia, their names, and the axis square to both."""


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of a body's matter, as far as a file shows it.

    Attributes:
        low: Lowest corner of its box, in the body's frame [m], shape (3,).
        high: Highest corner, shape (3,).
        volume: Of its closed meshes [m³]; NaN where they are not closed, or there are none.
        solid: Whether the box is of meshes and not of joints alone.
    """

    low: Float[np.ndarray, "3"]
    high: Float[np.ndarray, "3"]
    volume: float
    solid: bool

    @property
    def size(self) -> float:
        """Its longest side [m]."""
        return max(float((self.high - self.low).max()), SMALLEST)


def bounds(parts: Iterable[Part], points: Iterable[Float[np.ndarray, "3"]]) -> Bounds:
    """The box of a body's meshes and of further points, such as joints that it carries.

    Args:
        parts: Its look, in its frame.
        points: Places that belong to it, in its frame [m].
    """
    parts = tuple(parts)
    corners = [np.zeros((1, 3)), *(np.reshape(point, (1, 3)) for point in points)]
    corners += [part.vertices for part in parts]
    everything = np.concatenate(corners)
    volume = sum((_volume(part) for part in parts), 0.0) if parts else math.nan
    return Bounds(everything.min(axis=0), everything.max(axis=0), volume, bool(parts))


def _volume(part: Part) -> float:
    """Volume inside a mesh; NaN where it is not closed.

    Source: the divergence theorem, V = Σ a · (b × c) / 6; the area vectors of a closed surface
    add up to zero.
    """
    a, b, c = (part.vertices[part.faces[:, i]] for i in range(3))
    areas = np.cross(b - a, c - a) / 2
    total = float(np.linalg.norm(areas, axis=1).sum())
    if not total or np.linalg.norm(areas.sum(axis=0)) > 1e-3 * total:
        return math.nan
    return abs(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum())) / 6


def judge_body(
    subject: str, inertial: Inertial, box: Bounds, where: str, *, inertias: bool = True
) -> list[Finding]:
    """Find impossible or suspect numbers in a body's mass and inertia.

    Args:
        subject: Such as ``link tibia_rf``.
        inertial: As in the file.
        box: Where its matter is.
        where: File and line.
        inertias: Whether its inertia and its centre of mass are judged, and not its mass alone.
    """
    found: list[Finding] = []

    def find(severity: Severity, what: str, hint: str) -> None:
        found.append(Finding(severity, subject, what, where, hint))

    mass, inertia = inertial.mass, inertial.inertia
    judged = (mass, inertial.com, inertia) if inertias else (mass,)
    if not all(np.isfinite(values).all() for values in judged):
        find(Severity.IMPOSSIBLE, "mass, centre and inertia must be finite numbers.", _MASSES)
        return found
    if mass < 0:
        find(
            Severity.IMPOSSIBLE,
            f"mass is {plain_number(mass)} kg; it must be greater than 0.",
            _MASSES,
        )
        return found
    if mass == 0:
        if inertias and inertia.any():
            what = "has an inertia and no mass; it must have both or neither."
            find(Severity.SUSPECT, what, _MASSES)
        return found
    _judge_mass(find, mass, box)
    if inertias:
        _judge_centre(find, inertial.com, box)
        _judge_inertia(find, inertial, box)
    return found


_MASSES = "weigh it, or --masses phantomx-mk4"
_SPREAD = "--masses geometry, which spreads each mass over its link's box, or --masses phantomx-mk4"


def _judge_mass(find: Find, mass: float, box: Bounds) -> None:
    if not math.isfinite(box.volume) or box.volume <= 0:
        return
    density = mass / box.volume
    if density >= LIGHTEST and mass - SERVO <= DENSEST * box.volume:
        return
    slip = _slip(density, (LIGHTEST, DENSEST))
    find(
        Severity.SUSPECT,
        f"{plain_number(1000 * mass)} g in {plain_number(1e6 * box.volume)} cm³ of mesh is "
        f"{plain_number(density)} kg/m³; what robots are made of has {plain_number(LIGHTEST)} to "
        f"{plain_number(DENSEST)}"
        + (f"; the mass times {plain_number(slip)} would fit." if slip else "."),
        _MASSES,
    )


def _judge_centre(find: Find, com: Float[np.ndarray, "3"], box: Bounds) -> None:
    def beyond(point: np.ndarray) -> float:
        return float(np.maximum(np.maximum(box.low - point, point - box.high), 0.0).max())

    outside = beyond(com)
    if not box.solid or outside <= OUTSIDE * box.size:
        return
    far = outside > WIDEST_RADIUS * box.size
    slip = next((s for s in SLIPS if beyond(s * com) <= OUTSIDE * box.size), None) if far else None
    find(
        Severity.IMPOSSIBLE if far else Severity.SUSPECT,
        f"centre of mass lies {_mm(outside)} outside its {_mm(box.size)} box"
        + (
            f"; times {plain_number(slip)} it would lie inside."
            if slip
            else "; it must lie inside."
        ),
        _SPREAD,
    )


def _judge_inertia(find: Find, inertial: Inertial, box: Bounds) -> None:
    mass, com, inertia = inertial.mass, inertial.com, inertial.inertia
    moments = np.linalg.eigvalsh(inertia)
    shown = ", ".join(f"{moment:.4g}" for moment in moments)
    if moments[0] <= 0:
        what = f"principal moments {shown} kg m² must all be greater than 0{_product(inertia)}."
        find(Severity.IMPOSSIBLE, what, _SPREAD)
    elif _excess(moments) > ROUNDED:
        what = (
            f"principal moments {shown} kg m² belong to no body; the largest may not exceed the "
            f"sum of the others{_product(inertia)}."
        )
        find(Severity.IMPOSSIBLE, what, _SPREAD)
    elif _excess(moments) > 0:
        what = (
            f"principal moments {shown} kg m² are those of a plate, rounded; they were raised by "
            f"{plain_number(100 * _excess(moments), 2)} % of the largest."
        )
        find(Severity.NOTE, what, "")
    if moments[2] <= 0:
        return
    radius, size = math.sqrt(moments[2] / mass), box.size
    shown = (
        f"inertia {moments[2]:.3g} kg m² with {plain_number(1000 * mass)} g gives a gyration "
        f"radius of {_mm(radius)} to a {_mm(size)} body; "
    )
    least, most = NARROWEST_RADIUS * size, WIDEST_RADIUS * size
    if not least <= radius <= most:
        what = f"{shown}it must lie between {_mm(least)} and {_mm(most)}"
        slip = _slip((radius / size) ** 2, (LIKELY_RADII[0] ** 2, LIKELY_RADII[1] ** 2))
        if slip:
            fits = _mm(radius * math.sqrt(slip))
            what += f"; the inertia times {plain_number(slip)} would give {fits}"
        find(Severity.IMPOSSIBLE, what + ".", _SPREAD)
        return
    farthest = float(np.linalg.norm(np.maximum(com - box.low, box.high - com)))
    if box.solid and radius > farthest + OUTSIDE * size:
        what = (
            f"{shown}no point of it lies that far from its centre of mass, but at most "
            f"{_mm(farthest)}."
        )
        find(Severity.SUSPECT, what, _SPREAD)


def _mm(length: float) -> str:
    """A length as people read it, to three digits."""
    return f"{plain_number(1000 * length, 3)} mm"


def possible(inertial: Inertial) -> Inertial:
    """A body's mass and inertia, of a plate with its digits rounded the right way.

    In a plate the largest moment is the sum of the others, and rounded numbers may exceed it, which
    no body's do; then a little is added to each moment.
    """
    if not np.isfinite(inertial.inertia).all():
        return inertial
    excess = _excess(np.linalg.eigvalsh(inertial.inertia))
    if not 0 < excess <= ROUNDED:
        return inertial
    largest = float(np.linalg.eigvalsh(inertial.inertia)[2])
    raised = inertial.inertia + excess * largest * np.eye(3)
    return Inertial(inertial.mass, inertial.com, raised)


def _excess(moments: Float[np.ndarray, "3"]) -> float:
    """Return the relative excess of the largest principal moment over the sum of the others."""
    if moments[2] <= 0:
        return 0.0
    excess = float((moments[2] - moments[0] - moments[1]) / moments[2])
    return excess if excess > ROUND_OFF else 0.0


def _product(inertia: np.ndarray) -> str:
    """The product of inertia that is larger than any body's, in words; empty where none is."""
    for i, j, names, k in AXES:
        # The integral of |xy| is at most half that of x² + y².
        if abs(inertia[i, j]) > max(inertia[k, k] / 2, 0.0) * (1 + 1e-9):
            return (
                f"; product {names} is {inertia[i, j]:.3g}, and no body's is more than half of "
                f"{'xyz'[k] * 2}, {inertia[k, k] / 2:.3g}"
            )
    return ""


def _slip(value: float, likely: tuple[float, float]) -> float | None:
    """The factor of a wrong unit that makes a number likely; None where none does."""
    return next((s for s in SLIPS if likely[0] <= value * s <= likely[1]), None)
