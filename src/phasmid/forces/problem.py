"""The load to be shared, all samples in a row."""

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
"""A foot with a smaller share than this carries nothing."""


@dataclass(frozen=True, eq=False)
class Problem:
    """N samples of L feet, every number of each.

    Attributes:
        names: Names of the legs.
        feet: Feet from the point about which moments are taken [m], shape (N, L, 3).
        wrench: Force [N] and moment [N·m] to be given, shape (N, 6).
        share: Each foot's part of its full share, shape (N, L).
        axes: Rotations from contact axes (normal, two tangents), shape (N, L, 3, 3).
        friction: Coefficients of friction, shape (N, L).
        inverse: H⁻¹ of the cost, times the share, shape (N, L, 3, 3).
        gain: c of the cost, shape (N, L, 3).
        jacobian: d foot / d q [m/rad], shape (N, L, 3, 3); zeros where torques have no limits.
        torque: Joint torques without ground [N·m], shape (N, L, 3).
        limit: Largest torques [N·m], shape (N, L, 3).
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

    @property
    def grasp(self) -> Float[np.ndarray, "samples 6 axes"]:
        """The matrix from all forces to the wrench, shape (N, 6, 3 L)."""
        return grasp_matrix(self.feet)

    @property
    def limited(self) -> bool:
        """Whether any joint has a torque limit."""
        return bool(np.isfinite(self.limit).any())

    def standing(
        self, samples: np.ndarray, count: int
    ) -> tuple[Problem, Float[np.ndarray, "some feet"]]:
        """Some samples with the feet that carry alone, and which those are, shape (n, count).

        Args:
            samples: Numbers of the samples, shape (n,); in each ``count`` feet carry.
            count: Number of feet that carry.
        """
        legs = np.argsort(self.share[samples] <= 0, axis=-1, kind="stable")[:, :count]
        rows = samples[:, None]
        per_foot = {
            name: getattr(self, name)[rows, legs]
            for name in self.__dataclass_fields__
            if name not in {"names", "wrench"}
        }
        return Problem(names=self.names, wrench=self.wrench[samples], **per_foot), legs

    def carrying(self) -> Bool[np.ndarray, "samples legs"]:
        """Which feet carry, shape (N, L)."""
        return self.share > 0


def in_a_row(
    contacts: Contacts,
    wrench: Float[np.ndarray, "*#batch 6"],
    joints: JointLoad | None,
    batch: Sequence[int],
    inverse: Float[np.ndarray, "*#batch legs 3 3"],
    gain: Float[np.ndarray, "*#batch legs 3"],
) -> Problem:
    """A problem with the leading axes made one.

    Args:
        contacts: The feet.
        wrench: What they must give.
        joints: What the joints carry, if it counts.
        batch: The leading axes that all share.
        inverse: H⁻¹ of the cost.
        gain: c of the cost.
    """
    legs = contacts.feet.shape[-2]
    if joints is None:
        zero = np.zeros((legs, 3))
        joints = JointLoad(np.zeros((legs, 3, 3)), zero)

    def row(values: Any, axes: int) -> np.ndarray:
        array = np.asarray(values)
        shape = array.shape[array.ndim - axes :]
        return np.broadcast_to(array, (*batch, *shape)).reshape(-1, *shape)

    share = row(contacts.share, 1)
    share = np.where(share < NEGLIGIBLE, 0.0, share)
    return Problem(
        names=contacts.names,
        feet=row(contacts.feet, 2),
        wrench=row(wrench, 1),
        share=share,
        axes=row(contacts.axes, 3),
        friction=row(contacts.friction, 1),
        inverse=row(inverse, 3) * share[..., None, None],
        gain=row(gain, 2),
        jacobian=row(joints.jacobian, 3),
        torque=row(joints.torque, 2),
        limit=row(joints.limit, 2),
    )


def shared_axes(
    contacts: Contacts, wrench: Float[np.ndarray, "*#batch 6"], joints: JointLoad | None
) -> tuple[int, ...]:
    """The leading axes of feet, wrench and joints together.

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
