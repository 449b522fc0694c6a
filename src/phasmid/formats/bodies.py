"""Judgement of one body: mass, centre of mass and inertia from a file against its shape."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.formats.findings import Finding, Findings, Severity
from phasmid.robot import Part
from phasmid.robot.inertial import Inertial
from phasmid.units import plain_number

SMALLEST = 0.04
"""Bodies are taken as at least this long [m]: a servo sits beside a short link."""

WIDEST_RADIUS, NARROWEST_RADIUS = 1.5, 0.02
"""Gyration radius in lengths of the body that `Link` and `Body` still accept. A rod has 0.29, two
masses at the ends of one 0.5; nothing inside its own bounds has more than 0.87 (half the diagonal
of a cube), and 1.5 leaves room for masses beside the bounds."""

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
    """Return the box of a body's meshes and of further points, such as joints that it carries.

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
) -> Findings:
    """Find what is impossible or suspect about a body's mass and inertia.

    Args:
        subject: Such as ``link tibia_rf``.
        inertial: As in the file.
        box: Where its matter is.
        where: File and line.
        inertias: Whether its inertia and its centre of mass are judged, and not its mass alone.
    """
    found = Findings()
    mass, inertia = inertial.mass, inertial.inertia
    judged = (mass, inertial.com, inertia) if inertias else (mass,)
    if not all(np.isfinite(values).all() for values in judged):
        what = "mass, centre and inertia must be finite numbers."
        found.impossible(subject, what, where, _MASSES)
    elif mass < 0:
        what = f"mass is {plain_number(mass)} kg; it must be greater than 0."
        found.impossible(subject, what, where, _MASSES)
    elif mass == 0:
        if inertias and inertia.any():
            what = "has an inertia and no mass; it must have both or neither."
            found.suspect(subject, what, where, _MASSES)
    else:
        found += _judge_mass(subject, mass, box, where)
        if inertias:
            found += _judge_centre(subject, inertial.com, box, where)
            found += _judge_inertia(subject, inertial, box, where)
    return found


_MASSES = "weigh it, or --masses geometry with --total-mass-g"
_SPREAD = "--masses geometry, which spreads each mass over its link's box"


def _judge_mass(subject: str, mass: float, box: Bounds, where: str) -> Findings:
    found = Findings()
    if not math.isfinite(box.volume) or box.volume <= 0:
        return found
    density = mass / box.volume
    if density < LIGHTEST or mass - SERVO > DENSEST * box.volume:
        found.suspect(
            subject,
            f"{plain_number(1000 * mass)} g in {plain_number(1e6 * box.volume)} cm³ of mesh is "
            f"{plain_number(density)} kg/m³; robots are made of {plain_number(LIGHTEST)} to "
            f"{plain_number(DENSEST)} kg/m³.",
            where,
            _MASSES,
        )
    return found


def _judge_centre(subject: str, com: Float[np.ndarray, "3"], box: Bounds, where: str) -> Findings:
    found = Findings()
    outside = float(np.maximum(np.maximum(box.low - com, com - box.high), 0.0).max())
    if box.solid and outside > OUTSIDE * box.size:
        what = f"centre of mass is {_mm(outside)} outside its {_mm(box.size)} box."
        far = outside > WIDEST_RADIUS * box.size
        severity = Severity.IMPOSSIBLE if far else Severity.SUSPECT
        found.append(Finding(severity, subject, what, where, _SPREAD))
    return found


def _judge_inertia(subject: str, inertial: Inertial, box: Bounds, where: str) -> Findings:
    found = Findings()
    moments = np.linalg.eigvalsh(inertial.inertia)
    excess = _excess(moments)
    shown = f"principal moments {', '.join(f'{m:.4g}' for m in moments)} kg m²"
    if moments[0] <= 0:
        found.impossible(subject, f"{shown} must all be greater than 0.", where, _SPREAD)
    elif excess > ROUNDED:
        what = f"{shown} belong to no body; the largest may not exceed the sum of the others."
        found.impossible(subject, what, where, _SPREAD)
    elif excess > 0:
        raised = plain_number(100 * excess, 2)
        what = (
            f"{shown} are those of a plate, rounded; they were raised by {raised} % of the largest."
        )
        found.note(subject, what, where)
    if moments[2] <= 0:
        return found
    radius, size = math.sqrt(moments[2] / inertial.mass), box.size
    shown = (
        f"inertia {moments[2]:.3g} kg m² with {plain_number(1000 * inertial.mass)} g gives a "
        f"gyration radius of {_mm(radius)} to a {_mm(size)} body; "
    )
    least, most = NARROWEST_RADIUS * size, WIDEST_RADIUS * size
    farthest = float(np.linalg.norm(np.maximum(inertial.com - box.low, box.high - inertial.com)))
    if not least <= radius <= most:
        slip = next((s for s in SLIPS if least <= radius * math.sqrt(s) <= 0.6 * most), None)
        what = f"{shown}it must be between {_mm(least)} and {_mm(most)}"
        if slip:
            fits = _mm(radius * math.sqrt(slip))
            what += f"; the inertia times {plain_number(slip)} would give {fits}"
        found.impossible(subject, f"{what}.", where, _SPREAD)
    elif box.solid and radius > farthest + OUTSIDE * size:
        what = f"{shown}its matter is at most {_mm(farthest)} from its centre of mass."
        found.suspect(subject, what, where, _SPREAD)
    return found


def _mm(length: float) -> str:
    """Format a length in millimetres with three digits."""
    return f"{plain_number(1000 * length, 3)} mm"


def possible(inertial: Inertial) -> Inertial:
    """Return a body's mass and a realisable inertia, with a thin plate's digits rounded up.

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
