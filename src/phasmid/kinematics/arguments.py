"""Arguments of kinematics and dynamics: legs, and checks of shapes."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.robot import Robot


class LegGeometry(Protocol):
    """A leg, or the arrays of several legs."""

    @property
    def lengths(self) -> np.ndarray:
        """Lengths of coxa, femur and tibia [m], shape (..., 3)."""

    @property
    def lateral_offsets(self) -> np.ndarray:
        """Lateral offsets of coxa, femur and tibia [m], shape (..., 3)."""


def geometry(leg: LegGeometry) -> tuple[np.ndarray, np.ndarray]:
    """Return a leg's lengths, shape (..., 3), and its foot's offset from its plane, shape (...)."""
    return leg.lengths, np.asarray(leg.lateral_offsets.sum(axis=-1))


def scalar(name: str, value: float) -> float:
    """Return one number; refuse an array, which would broadcast over the axes of vectors."""
    if np.ndim(value):
        raise InvalidInput(f"{name} has shape {np.shape(value)}; it must be one number.")
    return float(value)


def per_leg(robot: Robot, **arrays: object) -> list[np.ndarray]:
    """Return arrays with three numbers for each leg of a robot; refuse other shapes."""
    found = []
    for name, values in arrays.items():
        array = np.asarray(values, dtype=float)
        if array.shape[-2:] != (len(robot.legs), 3):
            raise InvalidInput(
                f"{name} has shape {array.shape}; it must end in {len(robot.legs)}, 3: "
                "three numbers for each leg."
            )
        found.append(array)
    return found
