"""Compiled vectors and rotations at one instant.

Vectors are tuples of three numbers, which the compiler keeps in registers.
"""

from __future__ import annotations

import numpy as np

from phasmid.compiled import compiled
from phasmid.kinematics import shared_kernels

Vector = tuple[float, float, float]

quintic = compiled(shared_kernels.quintic)
turned = compiled(shared_kernels.turned)
rpy_rows = compiled(shared_kernels.rpy_rows)
quaternion_rows = compiled(shared_kernels.quaternion_rows)


@compiled
def vector(a: np.ndarray) -> Vector:
    """Return an array of three numbers as a vector."""
    return a[0], a[1], a[2]


@compiled
def add(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def minus(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled
def times(k: float, a: Vector) -> Vector:
    """Return k a."""
    return k * a[0], k * a[1], k * a[2]


@compiled
def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product of a and b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product of a and b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def rotate(R: np.ndarray, v: Vector) -> Vector:
    """Return R v."""
    return (
        R[0, 0] * v[0] + R[0, 1] * v[1] + R[0, 2] * v[2],
        R[1, 0] * v[0] + R[1, 1] * v[1] + R[1, 2] * v[2],
        R[2, 0] * v[0] + R[2, 1] * v[1] + R[2, 2] * v[2],
    )


@compiled
def rotate_back(R: np.ndarray, v: Vector) -> Vector:
    """Return the transpose of R times v."""
    return (
        R[0, 0] * v[0] + R[1, 0] * v[1] + R[2, 0] * v[2],
        R[0, 1] * v[0] + R[1, 1] * v[1] + R[2, 1] * v[2],
        R[0, 2] * v[0] + R[1, 2] * v[1] + R[2, 2] * v[2],
    )


@compiled
def rotate_by(w: float, x: float, y: float, z: float, v: Vector) -> Vector:
    """Return a vector rotated by a unit quaternion."""
    first, second, third = quaternion_rows(w, x, y, z, 2.0)
    return dot(first, v), dot(second, v), dot(third, v)
