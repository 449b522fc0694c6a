"""Vector algebra with the components along the first axis.

Vectors are (3, ..., L) and matrices (3, 3, ..., L): the long axes lie together in memory, and
what is constant per leg broadcasts by itself.
"""

from __future__ import annotations

import numpy as np

from phasmid.kinematics.matrices import Samples


def components(array: np.ndarray, axes: int = 1, lead: tuple[int, ...] | None = None) -> np.ndarray:
    """The last axes in front, contiguous; those before them broadcast to ``lead``."""
    if lead is not None:
        array = np.broadcast_to(array, (*lead, *np.shape(array)[-axes:]))
    ends = range(-axes, 0)
    return np.ascontiguousarray(np.moveaxis(np.asarray(array, dtype=float), ends, range(axes)))


def vector(x: Samples, y: Samples, z: Samples) -> np.ndarray:
    """Three components as one vector."""
    return np.stack(np.broadcast_arrays(x, y, z))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product; faster here than np.cross."""
    (ax, ay, az), (bx, by, bz) = a, b
    return vector(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


def apply(matrix: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Matrix times vector."""
    x, y, z = v
    return vector(*(row[0] * x + row[1] * y + row[2] * z for row in matrix))


def carried(p: np.ndarray, w: np.ndarray, dw: np.ndarray) -> np.ndarray:
    """Acceleration of a point p of a turning body against the body's origin."""
    return np.asarray(cross(dw, p) + cross(w, cross(w, p)))
