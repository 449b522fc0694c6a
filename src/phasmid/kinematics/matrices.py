"""Matrices of samples from their entries."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

Samples = np.ndarray | np.float64
"""One number per sample; NumPy makes a scalar of a single one."""


def matrix(*rows: Sequence[Samples | float]) -> np.ndarray:
    """Return one matrix per sample from rows of entries that broadcast, shape (..., R, C)."""
    shapes = {np.shape(entry) for row in rows for entry in row}
    shape = shapes.pop() if len(shapes) == 1 else np.broadcast_shapes(*shapes)
    filled = np.empty((*shape, len(rows), len(rows[0])))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            filled[..., i, j] = entry
    return filled


def dh_transform(
    alpha: Samples, a: Samples, d: Samples, theta: Samples
) -> Float[np.ndarray, "*batch 4 4"]:
    """Transform between neighbouring frames in modified Denavit-Hartenberg form (Craig).

    Args:
        alpha: Angle between the joint axes, about the previous x [rad].
        a: Distance between the joint axes, along the previous x [m].
        d: Offset along the joint axis [m].
        theta: Joint angle [rad].

    Returns:
        ``X_previous_next``, shape (..., 4, 4).

    Source: Eq. 1 with its entry (1,4) corrected to a.
    """
    ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    return matrix(
        [ct, -st, 0.0, a],
        [st * ca, ct * ca, -sa, -sa * d],
        [st * sa, ct * sa, ca, ca * d],
        [0.0, 0.0, 0.0, 1.0],
    )
