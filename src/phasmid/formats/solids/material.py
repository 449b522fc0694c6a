"""Materials of parts: density and colour."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """A material.

    Attributes:
        name: One word.
        density: Mass by volume [kg/m³].
        color: Red, green, blue and opacity, 0 to 1.
    """

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
