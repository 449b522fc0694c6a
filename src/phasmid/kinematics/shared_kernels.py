"""Formulas that NumPy applies to arrays and compiled code to numbers.

NumPy calls them as they are; `kinematics.vector_kernels` compiles the same functions.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

Numbers = TypeVar("Numbers", float, np.ndarray)
"""A number, or an array of them."""


def quintic(u: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """Return a quintic from 0 at u = 0 to 1 at u = 1, and its first two derivatives by u.

    Both derivatives vanish at both ends.

    Args:
        u: Share of the way in time, in [0, 1].

    Source: the paper's 5th degree polynomial.
    """
    rest = u * (1 - u)
    return u * u * u * (10 + u * (6 * u - 15)), 30 * rest * rest, 60 * rest * (1 - 2 * u)


def turned(angle: Numbers, x: Numbers, y: Numbers) -> tuple[Numbers, Numbers]:
    """Return a plane vector after a turn to the left [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return c * x - s * y, s * x + c * y


def rpy_rows(
    roll: Numbers, pitch: Numbers, yaw: Numbers
) -> tuple[tuple[Numbers, Numbers, Numbers], ...]:
    """Return the rows of the rotation by roll about x, then pitch about y, then yaw about z [rad].

    The axes are fixed.

    Source: T_B^G, corrected, with x forward (the paper's forward axis is y).
    """
    cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    cy, sy = np.cos(yaw), np.sin(yaw)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def quaternion_rows(
    w: Numbers, x: Numbers, y: Numbers, z: Numbers, factor: float = 2.0
) -> tuple[tuple[Numbers, Numbers, Numbers], ...]:
    """Return the rows of the rotation of a quaternion.

    Args:
        w: Scalar part.
        x: Vector part.
        y: Vector part.
        z: Vector part.
        factor: 2 over the square of the quaternion's length.
    """
    return (
        (
            1 - factor * (y * y + z * z),
            factor * (x * y - w * z),
            factor * (x * z + w * y),
        ),
        (
            factor * (x * y + w * z),
            1 - factor * (x * x + z * z),
            factor * (y * z - w * x),
        ),
        (
            factor * (x * z - w * y),
            factor * (y * z + w * x),
            1 - factor * (x * x + y * y),
        ),
    )
