"""Load of the standing feet: samples in which equally many feet stand, solved as one batch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from phasmid.forces.cones import UNBOUNDED, Rows
from phasmid.forces.contacts import Contacts, JointLoad

NEGLIGIBLE = 1e-9
"""Share below which a foot carries nothing."""


@dataclass(frozen=True, eq=False)
class Load:
    """Wrench, cost and limits of n samples with k standing feet each.

    Attributes:
        samples: Indices of the samples, shape (n,).
        legs: Indices of the standing legs, shape (n, k).
        names: Names of all legs.
        wrench: Force [N] and moment [N·m] to be given, shape (n, 6).
        feet: Feet from the point of the moment [m], shape (n, k, 3).
        share: Share of each foot, shape (n, k).
        axes: Rotations from contact axes (normal, two tangents), shape (n, k, 3, 3).
        friction: Coefficients of friction, shape (n, k).
        inverse: H⁻¹ of the cost, times the share, shape (n, k, 3, 3).
        gain: c of the cost, shape (n, k, 3).
        jacobian: d foot / d q [m/rad], shape (n, k, 3, 3); zeros without joints.
        torque: Joint torques without ground [N·m], shape (n, k, 3).
        limit: Torque limits [N·m], shape (n, k, 3).
    """

    samples: Int[np.ndarray, " samples"]
    legs: Int[np.ndarray, "samples feet"]
    names: tuple[str, ...]
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

    @property
    def grasp(self) -> Float[np.ndarray, "samples 6 axes"]:
        """Grasp matrices, from all forces to the wrench, shape (n, 6, 3 k)."""
        return grasp_matrix(self.feet)

    def of(self, rows: np.ndarray) -> Load:
        """Return some of the samples, by their rows here."""
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return Load(**{k: v if k == "names" else v[rows] for k, v in fields.items()})

    def in_contact_axes(
        self, force: Float[np.ndarray, "samples feet 3"]
    ) -> Float[np.ndarray, "samples feet 3"]:
        """Return forces by normal and tangential components."""
        return np.einsum("nlij,nli->nlj", self.axes, force)

    def torque_with(
        self, force: Float[np.ndarray, "samples feet 3"]
    ) -> Float[np.ndarray, "samples feet 3"]:
        """Return joint torques under ground reaction forces [N·m]."""
        return self.torque - np.einsum("nlij,nli->nlj", self.jacobian, force)


def push_limits(
    load: Load, f: np.ndarray, U: np.ndarray, least: float, scale: np.ndarray | float
) -> Rows:
    """Return the limits by which forces f + U x, in contact axes and units of scale, push."""
    return Rows.below(-U[..., 0, :], f[..., 0] - least * load.share / scale)


def torque_limits(load: Load, force: np.ndarray, V: np.ndarray, scale: np.ndarray | float) -> Rows:
    """Return the limits of the joint torques under the forces force + scale V x."""
    n, k, _, free = V.shape
    torque = load.torque_with(force)
    lower, upper = (
        np.clip((side * load.limit - torque).reshape(n, -1) / scale, -UNBOUNDED, UNBOUNDED)
        for side in (-1, 1)
    )
    change = -np.swapaxes(load.jacobian, -1, -2) @ V
    return Rows(change.reshape(n, 3 * k, free), lower, upper)


def loads(
    contacts: Contacts,
    wrench: Float[np.ndarray, "*#batch 6"],
    joints: JointLoad | None,
    cost: tuple[Float[np.ndarray, "*#batch legs 3 3"], Float[np.ndarray, "*#batch legs 3"]],
    batch: tuple[int, ...],
) -> Iterator[Load]:
    """Yield the load by the number of standing feet; samples are counted over the leading axes."""
    legs = contacts.feet.shape[-2]
    joints = joints or JointLoad(np.zeros((legs, 3, 3)), np.zeros((legs, 3)))

    def flat(values: Any, axes: int) -> np.ndarray:
        array = np.asarray(values)
        shape = array.shape[array.ndim - axes :]
        return np.broadcast_to(array, (*batch, *shape)).reshape(-1, *shape)

    share = flat(contacts.share, 1)
    stands = share >= NEGLIGIBLE
    per_foot = {
        "feet": flat(contacts.feet, 2),
        "share": share,
        "axes": flat(contacts.axes, 3),
        "friction": flat(contacts.friction, 1),
        "inverse": flat(cost[0], 3) * share[..., None, None],
        "gain": flat(cost[1], 2),
        "jacobian": flat(joints.jacobian, 3),
        "torque": flat(joints.torque, 2),
        "limit": flat(joints.limit, 2),
    }
    count = stands.sum(axis=-1)
    for k in np.unique(count):
        samples = np.flatnonzero(count == k)
        standing = np.argsort(~stands[samples], axis=-1, kind="stable")[:, :k]
        yield Load(
            samples,
            standing,
            contacts.leg_names,
            flat(wrench, 1)[samples],
            **{name: values[samples[:, None], standing] for name, values in per_foot.items()},
        )


def grasp_matrix(feet: Float[np.ndarray, "*batch legs 3"]) -> Float[np.ndarray, "*batch 6 axes"]:
    """Return the grasp matrix, from all foot forces to the wrench, shape (..., 6, 3 L).

    Args:
        feet: Feet from the point of the moment [m], shape (..., L, 3).
    """
    legs = feet.shape[-2]
    matrix = np.zeros((*feet.shape[:-2], 6, legs, 3))
    x, y, z = np.moveaxis(feet, -1, 0)
    for i in range(3):
        matrix[..., i, :, i] = 1.0
    matrix[..., 3, :, 1], matrix[..., 3, :, 2] = -z, y
    matrix[..., 4, :, 0], matrix[..., 4, :, 2] = z, -x
    matrix[..., 5, :, 0], matrix[..., 5, :, 1] = -y, x
    return matrix.reshape(*feet.shape[:-2], 6, 3 * legs)
