"""Loads of the standing feet: samples in which the same feet stand, solved as one batch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.forces.cones import UNBOUNDED, Rows


class Load(NamedTuple):
    """Wrench, cost ½ Fᵀ H F - cᵀ F and limits of n samples with k feet each.

    Attributes:
        wrench: Force [N] and moment [N·m] to be given, shape (n, 6).
        feet: Feet from the point of the moment [m], shape (n, k, 3).
        share: Share of each foot, shape (n, k).
        axes: Rotations from contact axes (normal, two tangents), shape (n, k, 3, 3).
        friction: Coefficients of friction, shape (n, k).
        inverse: H⁻¹ times the share, shape (n, k, 3, 3).
        gain: c, shape (n, k, 3).
        jacobian: d foot / d q [m/rad], shape (n, k, 3, 3); zeros without joints.
        torque: Joint torques without ground [N·m], shape (n, k, 3).
        limit: Torque limits [N·m], shape (n, k, 3).
    """

    wrench: Float[np.ndarray, "samples 6"]
    feet: Float[np.ndarray, "samples feet 3"]
    share: Float[np.ndarray, "samples feet"]
    axes: Float[np.ndarray, "samples feet 3 3"]
    friction: Float[np.ndarray, "samples feet"]
    inverse: Float[np.ndarray, "samples feet 3 3"]
    gain: Float[np.ndarray, "samples feet 3"]
    jacobian: Float[np.ndarray, "samples feet 3 3"]
    torque: Float[np.ndarray, "samples feet 3"]
    limit: Float[np.ndarray, "samples feet 3"]

    def of(self, samples: np.ndarray, feet: np.ndarray | slice = slice(None)) -> Load:
        """Return some of the samples with some of the feet."""
        wrench, *per_foot = self
        return Load(wrench[samples], *(part[samples][:, feet] for part in per_foot))

    def torque_with(
        self, force: Float[np.ndarray, "samples feet 3"]
    ) -> Float[np.ndarray, "samples feet 3"]:
        """Return joint torques under ground reaction forces [N·m]."""
        return self.torque - np.einsum("nlij,nli->nlj", self.jacobian, force)

    def torque_limits(self, force: np.ndarray, V: np.ndarray, scale: np.ndarray | float) -> Rows:
        """Return the limits of the joint torques under the forces force + scale V x."""
        n, k, _, free = V.shape
        torque = self.torque_with(force)
        lower, upper = (
            np.clip((side * self.limit - torque).reshape(n, -1) / scale, -UNBOUNDED, UNBOUNDED)
            for side in (-1, 1)
        )
        change = -np.swapaxes(self.jacobian, -1, -2) @ V
        return Rows(change.reshape(n, 3 * k, free), lower, upper)


def push_limits(f: np.ndarray, U: np.ndarray) -> Rows:
    """Return the limits by which forces f + U x, in contact axes, push."""
    return Rows.below(-U[..., 0, :], f[..., 0])


def grasp_matrix(feet: Float[np.ndarray, "*batch legs 3"]) -> Float[np.ndarray, "*batch 6 axes"]:
    """Return the matrix from forces on feet [m] to the wrench about the origin, (..., 6, 3 L)."""
    legs = feet.shape[-2]
    matrix = np.zeros((*feet.shape[:-2], 6, legs, 3))
    x, y, z = np.moveaxis(feet, -1, 0)
    for i in range(3):
        matrix[..., i, :, i] = 1.0
    matrix[..., 3, :, 1], matrix[..., 3, :, 2] = -z, y
    matrix[..., 4, :, 0], matrix[..., 4, :, 2] = z, -x
    matrix[..., 5, :, 0], matrix[..., 5, :, 1] = -y, x
    return matrix.reshape(*feet.shape[:-2], 6, 3 * legs)
