"""Moments of mass about the origin of a frame."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def moments_about_origin(
    mass: Float[np.ndarray, "*batch"],
    com: Float[np.ndarray, "*batch 3"],
    inertia: Float[np.ndarray, "*batch 3 3"],
) -> tuple[Float[np.ndarray, "*batch 3"], Float[np.ndarray, "*batch 3 3"]]:
    """First and second moments of rigid bodies about the origins of their frames.

    Args:
        mass: Masses [kg], shape (...).
        com: Centres of mass in the bodies' frames [m], shape (..., 3).
        inertia: About the centres of mass [kg·m²], shape (..., 3, 3).

    Returns:
        Mass times centre of mass [kg·m], shape (..., 3), and the inertia about the origin
        [kg·m²], shape (..., 3, 3).

    Source: the parallel axis theorem.
    """
    first = mass[..., None] * com
    square = np.sum(first * com, axis=-1)[..., None, None] * np.eye(3)
    return first, inertia + square - first[..., :, None] * com[..., None, :]
