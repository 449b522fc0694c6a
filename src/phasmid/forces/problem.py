"""The load to be shared, with all leading axes in one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from phasmid.errors import InvalidInput
from phasmid.forces.contacts import Contacts, JointLoad
from phasmid.forces.equilibrium import grasp_matrix

NEGLIGIBLE = 1e-9
"""Share below which a foot carries nothing."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Feet, cost, limits and wrench of N samples and L legs.

    Attributes:
        names: Names of the legs.
        feet: Feet from the point of the moment [m], shape (N, L, 3).
        wrench: Force [N] and moment [N·m] to be given, shape (N, 6).
        share: Share of each foot, shape (N, L).
        axes: Rotations from contact axes (normal, two tangents), shape (N, L, 3, 3).
        friction: Coefficients of friction, shape (N, L).
        inverse: H⁻¹ of the cost, times the share, shape (N, L, 3, 3).
        gain: c of the cost, shape (N, L, 3).
        jacobian: d foot / d q [m/rad], shape (N, L, 3, 3); zeros without joints.
        torque: Joint torques without ground [N·m], shape (N, L, 3).
        limit: Torque limits [N·m], shape (N, L, 3).
    """

    names: tuple[str, ...]
    feet: Float[np.ndarray, "samples legs 3"]
    wrench: Float[np.ndarray, "samples 6"]
    share: Float[np.ndarray, "samples legs"]
    axes: Float[np.ndarray, "samples legs 3 3"]
    friction: Float[np.ndarray, "samples legs"]
    inverse: Float[np.ndarray, "samples legs 3 3"]
    gain: Float[np.ndarray, "samples legs 3"]
    jacobian: Float[np.ndarray, "samples legs 3 3"]
    torque: Float[np.ndarray, "samples legs 3"]
    limit: Float[np.ndarray, "samples legs 3"]

    @classmethod
    def of(
        cls,
        contacts: Contacts,
        wrench: Float[np.ndarray, "*#batch 6"],
        joints: JointLoad | None,
        batch: Sequence[int],
        inverse: Float[np.ndarray, "*#batch legs 3 3"],
        gain: Float[np.ndarray, "*#batch legs 3"],
    ) -> Problem:
        """Make one axis of the leading axes `batch`, which all arrays share by broadcasting."""
        legs = contacts.feet.shape[-2]
        joints = joints or JointLoad(np.zeros((legs, 3, 3)), np.zeros((legs, 3)))

        def flat(values: Any, axes: int) -> np.ndarray:
            array = np.asarray(values)
            shape = array.shape[array.ndim - axes :]
            return np.broadcast_to(array, (*batch, *shape)).reshape(-1, *shape)

        share = flat(contacts.share, 1)
        share = np.where(share < NEGLIGIBLE, 0.0, share)
        return cls(
            names=contacts.names,
            feet=flat(contacts.feet, 2),
            wrench=flat(wrench, 1),
            share=share,
            axes=flat(contacts.axes, 3),
            friction=flat(contacts.friction, 1),
            inverse=flat(inverse, 3) * share[..., None, None],
            gain=flat(gain, 2),
            jacobian=flat(joints.jacobian, 3),
            torque=flat(joints.torque, 2),
            limit=flat(joints.limit, 2),
        )

    @property
    def grasp(self) -> Float[np.ndarray, "samples 6 axes"]:
        """Grasp matrices, from all forces to the wrench, shape (N, 6, 3 L)."""
        return grasp_matrix(self.feet)

    @property
    def carrying(self) -> Bool[np.ndarray, "samples legs"]:
        """Feet that carry, shape (N, L)."""
        return self.share > 0

    @property
    def limited(self) -> bool:
        """Any joint has a torque limit."""
        return bool(np.isfinite(self.limit).any())

    def standing(
        self, samples: np.ndarray, count: int
    ) -> tuple[Problem, Float[np.ndarray, "some feet"]]:
        """Return some samples with their carrying feet only, and the indices of these feet.

        Args:
            samples: Indices of samples in each of which `count` feet carry, shape (n,).
            count: Number of feet that carry.
        """
        legs = np.argsort(~self.carrying[samples], axis=-1, kind="stable")[:, :count]
        rows = samples[:, None]
        per_foot = {
            name: getattr(self, name)[rows, legs]
            for name in self.__dataclass_fields__
            if name not in {"names", "wrench"}
        }
        return Problem(names=self.names, wrench=self.wrench[samples], **per_foot), legs


def shared_axes(
    contacts: Contacts, wrench: Float[np.ndarray, "*#batch 6"], joints: JointLoad | None
) -> tuple[int, ...]:
    """Return the leading axes of feet, wrench and joints together.

    Raises:
        InvalidInput: They do not broadcast, or the joints are of other legs.
    """
    shapes = [contacts.feet.shape[:-2], wrench.shape[:-1]]
    if joints is not None:
        legs, count = contacts.feet.shape[-2], joints.jacobian.shape[-3]
        if count != legs:
            raise InvalidInput(f"the joints' load is of {count} legs; there are {legs} feet.")
        shapes.append(joints.jacobian.shape[:-3])
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        listed = ", ".join(map(str, shapes))
        raise InvalidInput(
            f"the leading axes of feet, wrench and joints are {listed}; they must broadcast."
        ) from None
