"""Servos' outer measures, and the parts of a robot, each made once in its own frame [mm]."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from phasmid.formats.solids.assembly import build123d
from phasmid.servo import Servo

SHEET = 0.055
"""Thickness of bent brackets, in widths of a servo."""


@dataclass(frozen=True)
class ServoCase:
    """A servo's outside; its axis is z, its case lies along x, the origin is amid its depth.

    Attributes:
        width: Across the axis, along y [m].
        length: Along x [m].
        depth: Along the axis, over horn and idler [m].
        behind: From the axis to the case's near end [m].
        mass: As weighed [kg].
    """

    width: float
    length: float
    depth: float
    behind: float
    mass: float

    @property
    def before(self) -> float:
        """From the axis to the case's far end [m]."""
        return self.length - self.behind

    @property
    def clearance(self) -> float:
        """Radius within which the case's near end turns [m]."""
        return float((self.behind**2 + (self.width / 2) ** 2) ** 0.5)

    @property
    def w(self) -> float:
        """Width, by which parts are sized [mm]."""
        return 1000 * self.width

    @property
    def sheet(self) -> float:
        """Thickness of bent brackets [mm]."""
        return SHEET * self.w

    def scaled(self, scale: float) -> ServoCase:
        """Return a servo of the same shape and density, larger or smaller."""
        return replace(
            self,
            width=scale * self.width,
            length=scale * self.length,
            depth=scale * self.depth,
            behind=scale * self.behind,
            mass=scale**3 * self.mass,
        )


AX_12 = ServoCase(0.032, 0.050, 0.038, 0.0115, 0.0546)

CASES = {
    "AX-12A": AX_12,
    "AX-18A": replace(AX_12, mass=0.0559),
    # Where the axis stands in the MX-28's case is an assumption: as in the AX-12's.
    "MX-28": ServoCase(0.0356, 0.0506, 0.0355, 0.0115, 0.072),
    "XL430-W250": ServoCase(0.0285, 0.0465, 0.034, 0.01125, 0.0572),
}
"""The servos whose case is known, by their maker's name."""

TIGHTEST = 0.75
"""Scale of a known servo from which on it keeps its real size, and brackets are tight."""


def case_of(servo: Servo, room: float) -> ServoCase:
    """Return the case of a servo, scaled to fit if the servo is none of `CASES`.

    ``room`` is the largest scale of an AX-12's case that leaves room for the links.
    """
    if servo.name in CASES:
        # Links that are far too short for the servo's case cannot be those that it moves.
        return CASES[servo.name].scaled(1.0 if room >= TIGHTEST else room)
    return AX_12.scaled(room)


@cache
def servo(case: ServoCase) -> Any:
    """Return a servo: its case with flanges and their screw holes, the horn and the idler's boss.

    The axis is z through the origin, the case lies along x.
    """
    b = build123d()
    w, length, depth, behind = (
        1000 * c for c in (case.width, case.length, case.depth, case.behind)
    )
    horn = 0.055 * depth
    body = depth - 2 * horn
    middle = length / 2 - behind
    block = b.Pos(middle, 0, 0) * b.Box(length, w, body)
    block = b.chamfer(block.edges().filter_by(b.Axis.Z), 0.09 * w)
    # Grooves leave flanges at both ends of the depth, through which the screws go.
    groove = b.Box(0.62 * length, 0.09 * w, 0.66 * body)
    for side in (-1, 1):
        block -= b.Pos(middle + 0.10 * length, side * 0.46 * w, 0) * groove
    holes = [
        b.Pos(x, side * 0.43 * w, 0) * b.Cylinder(0.03 * w, depth)
        for side in (-1, 1)
        for x in (middle, middle + 0.16 * length, middle + 0.32 * length)
    ]
    block -= holes
    return (block + b.Cylinder(0.34 * w, depth)).solid()


@cache
def bracket(case: ServoCase, reach: float, *, start: float = 0.0) -> Any:
    """Return a bent sheet around a servo: two arms on its axis, and the web between them.

    Arms leave the axis z along x to the web, whose far face stands at ``reach``. Those that begin
    at 0 turn about the axis and carry its screws.
    """
    b = build123d()
    w, depth, sheet = case.w, 1000 * case.depth, case.sheet
    half = 0.36 * w
    if start:
        outline = b.Pos((start + reach) / 2, 0) * b.Rectangle(reach - start, 2 * half)
        holes = [b.Pos(start + 0.1 * w, y) * b.Circle(0.04 * w) for y in (-half / 2, half / 2)]
    else:
        outline = b.Circle(half) + b.Pos(reach / 2, 0) * b.Rectangle(reach, 2 * half)
        ring = [math.radians(a) for a in (45, 135, 225, 315)]
        r = 0.25 * w
        holes = [b.Pos(r * math.cos(a), r * math.sin(a)) * b.Circle(0.04 * w) for a in ring]
        holes.append(b.Circle(0.10 * w))
    arm = b.extrude(outline - holes, sheet)
    web = b.Rectangle(2 * half, depth + 2 * sheet) - [
        b.Pos(y, z) * b.Circle(0.05 * w)
        for y in (-0.6 * half, 0.6 * half)
        for z in (-0.3 * depth, 0.3 * depth)
    ]
    if not start:
        web -= b.Circle(0.16 * w)
    standing = b.Plane(origin=(reach - sheet, 0, 0), x_dir=(0, 1, 0), z_dir=(1, 0, 0))
    solid = (
        b.Pos(0, 0, depth / 2) * arm
        + b.Pos(0, 0, -depth / 2 - sheet) * arm
        + standing * b.extrude(web, sheet)
    )
    return solid.solid()


@cache
def strap(length: float, width: float, sheet: float) -> Any:
    """Return a plate along x from 0, with a window and screw holes at its ends, above z = 0."""
    b = build123d()
    outline = b.Pos(length / 2, 0) * b.RectangleRounded(length, width, 0.2 * min(length, width))
    window = b.Pos(length / 2, 0) * _slot(0.5 * length, 0.36 * width)
    holes = [
        b.Pos(x, y) * b.Circle(0.05 * width)
        for x in (0.12 * length, 0.88 * length)
        for y in (-0.3 * width, 0.3 * width)
    ]
    return b.extrude(outline - window - holes, sheet).solid()


def _slot(length: float, height: float) -> Any:
    """Return a slot along x, never higher than it is long."""
    return build123d().SlotOverall(length, min(height, 0.8 * length))


@cache
def blade(length: float, width: float, sheet: float) -> Any:
    """One cheek of a tibia: a leaf along x from 0 to its narrow end, in the plane z = 0 up."""
    b = build123d()
    top = [(0, 0.50), (0.22, 0.62), (0.60, 0.42), (1.0, 0.12)]
    under = [(1.0, -0.12), (0.62, -0.12), (0.26, -0.28), (0, -0.50)]
    over, below = ([(x * length, y * width) for x, y in row] for row in (top, under))
    edges = [
        b.Spline(*over),
        b.Line(over[-1], below[0]),
        b.Spline(*below),
        b.Line(below[-1], over[0]),
    ]
    leaf = b.make_face(edges)
    slots = [
        b.Pos(x * length, y * width)
        * b.Rot(0, 0, math.degrees(math.atan(slope * width / length)))
        * _slot(a * length, h * width)
        for x, y, slope, a, h in (
            (0.22, 0.14, 0.13, 0.22, 0.36),
            (0.50, 0.14, -0.39, 0.20, 0.26),
            (0.73, 0.08, -0.65, 0.14, 0.16),
        )
    ]
    return b.extrude(leaf - slots, sheet).solid()


@cache
def foot(length: float, radius: float) -> Any:
    """Return a rubber foot along x, from 0 to its contact point at ``length``."""
    b = build123d()
    shank = b.Rot(0, 90, 0) * b.Cone(
        0.75 * radius, radius, length - radius, align=(b.Align.CENTER, b.Align.CENTER, b.Align.MIN)
    )
    return (shank + b.Pos(length - radius, 0, 0) * b.Sphere(radius)).solid()


@cache
def beam(length: float, width: float, depth: float) -> Any:
    """Return a beam along x from 0."""
    b = build123d()
    return (b.Pos(length / 2, 0, 0) * b.Box(length, width, depth)).solid()


@cache
def plate(
    outline: tuple[tuple[float, float], ...],
    margin: float,
    sheet: float,
    screws: tuple[tuple[float, float], ...],
    screw: float,
    windows: tuple[tuple[float, float, float, float], ...] = (),
) -> Any:
    """Return a flat plate around the corners of a convex polygon, counter-clockwise, above z = 0.

    The plate goes round them by a margin, has holes of the radius ``screw``, and cut-outs with
    round corners, each by its middle and sizes along x and y.
    """
    b = build123d()
    face = b.offset(b.make_face(b.Polyline(*outline, close=True)), margin, kind=b.Kind.ARC)
    holes = [b.Pos(x, y) * b.Circle(screw) for x, y in screws]
    holes += [b.Pos(x, y) * b.RectangleRounded(p, q, 0.25 * min(p, q)) for x, y, p, q in windows]
    return b.extrude(face - holes, sheet).solid()


@cache
def box(size: tuple[float, float, float], bevel: float) -> Any:
    """Return a box on z = 0 with bevelled upright edges and upper rim."""
    b = build123d()
    block = b.Box(*size, align=(b.Align.CENTER, b.Align.CENTER, b.Align.MIN))
    edges = block.edges().filter_by(b.Axis.Z) + block.faces().sort_by(b.Axis.Z)[-1].edges()
    return b.chamfer(edges, bevel).solid()


@cache
def pillar(radius: float, height: float) -> Any:
    """Return a round pillar on z = 0."""
    b = build123d()
    return b.Cylinder(radius, height, align=(b.Align.CENTER, b.Align.CENTER, b.Align.MIN)).solid()
