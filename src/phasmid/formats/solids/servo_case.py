"""The outer measures of servos, as their makers' drawings give them."""

from __future__ import annotations

from dataclasses import dataclass, replace

from phasmid.robot import Servo

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
