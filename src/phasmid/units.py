"""Units other than SI, which end the names of keys and options."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache


@dataclass(frozen=True)
class Unit:
    """A unit as it ends a key, such as ``mm`` in ``femur_mm``.

    Attributes:
        symbol: How it is printed.
        dimension: Its dimension; units of one dimension are interchangeable.
        per_si: How many of it make one SI unit.
    """

    symbol: str
    dimension: str
    per_si: float

    def to_si(self, value: float) -> float:
        """Turn a number in this unit into SI."""
        # A division by a whole number keeps 40 mm the double nearest to 0.04.
        return value / self.per_si

    def from_si(self, value: float) -> float:
        """Turn an SI number into this unit."""
        return value * self.per_si


STANDARD_GRAVITY = 9.81
"""Acceleration of free fall by which weights are turned into masses; the paper's [m/s²]."""

UNITS = {
    "m": Unit("m", "length", 1.0),
    "cm": Unit("cm", "length", 100.0),
    "mm": Unit("mm", "length", 1000.0),
    "kg": Unit("kg", "mass", 1.0),
    "g": Unit("g", "mass", 1000.0),
    "rad": Unit("rad", "angle", 1.0),
    "deg": Unit("deg", "angle", 180.0 / math.pi),
    "s": Unit("s", "time", 1.0),
    "ms": Unit("ms", "time", 1000.0),
    "n": Unit("N", "force", 1.0),
    "kg_m2": Unit("kg m^2", "inertia", 1.0),
    "g_mm2": Unit("g mm^2", "inertia", 1e9),
    "rad_per_s": Unit("rad/s", "angular velocity", 1.0),
    "deg_per_s": Unit("°/s", "angular velocity", 180.0 / math.pi),
    "m_per_s": Unit("m/s", "velocity", 1.0),
    "mm_per_s": Unit("mm/s", "velocity", 1000.0),
    "kg_m3": Unit("kg/m^3", "density", 1.0),
    "g_cm3": Unit("g/cm^3", "density", 0.001),
    "v": Unit("V", "voltage", 1.0),
    # Temperatures stay in degrees Celsius: only their differences enter any equation.
    "degc": Unit("°C", "temperature", 1.0),
    "rpm": Unit("rpm", "angular velocity", 30.0 / math.pi),
}
"""Known units by the ending of a key; the first of each dimension is SI."""

SI = {unit.dimension: unit for unit in reversed(UNITS.values()) if unit.per_si == 1.0}
"""The SI unit of each dimension."""


def plain_number(value: float, digits: int = 4) -> str:
    """Return a number for a message, without a power of ten and with its thousands apart.

    Args:
        value: The number.
        digits: Significant digits.
    """
    # Beyond these sizes the zeros would say less than the power.
    if not 1e-9 <= abs(value) < 1e12:
        return f"{value + 0.0:.{digits}g}"
    rounded = float(f"{value:.{digits}g}")
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(rounded))))
    text = f"{rounded:,.{decimals}f}".replace(",", " ")
    return text.rstrip("0").rstrip(".") if "." in text else text


def rounded_down(value: float) -> str:
    """Return an upper bound, greater than 0, in three digits and not above it."""
    place = 10.0 ** (2 - math.floor(math.log10(value)))
    return f"{math.floor(value * place * (1 + 1e-9)) / place:.12g}"


def beyond(value: float, limit: float, digits: int) -> tuple[str, str]:
    """Return a number and the limit that it exceeds, with enough digits to differ.

    Args:
        value: The number.
        limit: The limit.
        digits: Least number of significant digits.
    """
    while (texts := (f"{value:.{digits}g}", f"{limit:.{digits}g}"))[0] == texts[1] and digits < 17:
        digits += 1
    return texts


@lru_cache(4096)
def split_unit(key: str) -> tuple[str, str]:
    """Split a key into its name and the unit that ends it.

    Args:
        key: Such as ``femur_mm`` or ``inertia_g_mm2``.

    Returns:
        Name and unit ending; the ending is empty where the key has none.
    """
    for ending in sorted(UNITS, key=len, reverse=True):
        if key.endswith(f"_{ending}"):
            return key[: -len(ending) - 1], ending
    return key, ""


def text(value: float, ending: str) -> str:
    """Format an SI number in the given unit, such as ``-82 mm``."""
    unit = UNITS[ending]
    return f"{unit.from_si(value):.4g} {unit.symbol}"
