"""Contacts of the feet, and the load of the joints."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from phasmid.arguments import numbers
from phasmid.errors import InvalidInput


@dataclass(frozen=True, eq=False)
class Contacts:
    """Point contacts of the feet with the ground.

    Attributes:
        feet: Feet from the point of the moment [m], shape (..., L, 3).
        share: Feet that stand (bool), or the share of its full load that each carries, 0 to 1,
            shape (..., L); kept as a number.
        normals: Outward normals of the ground at the feet, of any length above 0; up by default.
            Shape (..., L, 3) or (3,); kept as unit vectors.
        friction: Coefficient of Coulomb friction, shape (..., L) or one number.
        leg_names: Names of the legs for messages; by default their numbers from 1.

    Raises:
        InvalidInput: A number is not finite or out of range, or a shape does not fit.
    """

    feet: Float[np.ndarray, "..."]
    share: Float[np.ndarray, "..."] | Bool[np.ndarray, "..."]
    normals: Float[np.ndarray, "..."] = field(default_factory=lambda: np.array([0.0, 0, 1]))
    friction: float | Float[np.ndarray, "..."] = 0.7
    leg_names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        feet = _finite(self.feet, "feet")
        if feet.ndim < 2 or feet.shape[-1] != 3 or feet.shape[-2] == 0:
            raise InvalidInput(f"feet have shape {feet.shape}; it must end in L, 3: legs, axes.")
        legs = feet.shape[:-1]
        share = _fitting(self.share, legs, "share")
        friction = _fitting(self.friction, legs, "friction")
        normals = _fitting(self.normals, feet.shape, "normals")
        bad = share[(share < 0) | (share > 1)]
        if bad.size:
            raise InvalidInput(f"share is {bad[0]:g}; a foot's share must be between 0 and 1.")
        if not (friction >= 0).all():
            raise InvalidInput(f"friction is {friction.min():g}; it must be 0 or more.")
        length = np.linalg.norm(normals, axis=-1, keepdims=True)
        if not length.all():
            raise InvalidInput(
                "a normal is (0, 0, 0); it must point out of the ground.", hint="(0, 0, 1) is up"
            )
        if self.leg_names and len(self.leg_names) != legs[-1]:
            raise InvalidInput(f"{len(self.leg_names)} leg_names are given for {legs[-1]} legs.")
        names = self.leg_names or tuple(str(i + 1) for i in range(legs[-1]))
        values = (feet, share, normals / length, friction, names)
        for name, value in zip(self.__dataclass_fields__, values, strict=True):
            object.__setattr__(self, name, value)

    @property
    def stance(self) -> Bool[np.ndarray, "*batch legs"]:
        """Feet that carry, shape (..., L)."""
        return np.asarray(self.share) > 0

    @property
    def axes(self) -> Float[np.ndarray, "*batch legs 3 3"]:
        """Rotations from contact axes (normal, two tangents), shape (..., L, 3, 3)."""
        n = self.normals
        # The tangent starts from the axis farthest from the normal.
        start = np.eye(3)[np.argmin(np.abs(n), axis=-1)]
        first = start - n * np.sum(n * start, axis=-1, keepdims=True)
        first /= np.linalg.norm(first, axis=-1, keepdims=True)
        return np.stack([n, first, np.cross(n, first)], axis=-1)


@dataclass(frozen=True, eq=False)
class JointLoad:
    """Load of the joints: torque = torque without ground - Jᵀ force.

    Attributes:
        jacobian: d foot / d q in the axes of the forces [m/rad], shape (..., L, 3, 3).
        torque: Joint torques of the motion without the ground [N·m], shape (..., L, 3).
        limit: Torque limit of each joint, in both directions [N·m], shape (..., L, 3) or one
            number; none by default. `FrictionCone` and `SmallestLargestLoad` keep it.

    Raises:
        InvalidInput: A number is not finite, a limit is negative, or a shape does not fit.
    """

    jacobian: Float[np.ndarray, "..."]
    torque: Float[np.ndarray, "..."]
    limit: float | Float[np.ndarray, "..."] = np.inf

    def __post_init__(self) -> None:
        jacobian = _finite(self.jacobian, "jacobian")
        if jacobian.ndim < 3 or jacobian.shape[-2:] != (3, 3):
            raise InvalidInput(f"jacobian has shape {jacobian.shape}; it must end in L, 3, 3.")
        limit = numbers(self.limit, "limit")
        if not (limit >= 0).all():
            raise InvalidInput(f"limit is {limit.min():g} N·m; it must be 0 or more.")
        object.__setattr__(self, "jacobian", jacobian)
        object.__setattr__(self, "torque", _fitting(self.torque, jacobian.shape[:-1], "torque"))
        object.__setattr__(self, "limit", np.broadcast_to(limit, jacobian.shape[:-1]))

    def with_ground(
        self, force: Float[np.ndarray, "*batch legs 3"]
    ) -> Float[np.ndarray, "*batch legs 3"]:
        """Return the joint torques with ground reaction forces [N], both of shape (..., L, 3)."""
        return self.torque - np.einsum("...ij,...i->...j", self.jacobian, force)


def _finite(values: object, name: str) -> np.ndarray:
    array = numbers(values, name)
    if not np.isfinite(array).all():
        raise InvalidInput(f"{name} must be finite numbers; some are infinite or NaN.")
    return array


def _fitting(values: object, shape: tuple[int, ...], name: str) -> np.ndarray:
    array = _finite(values, name)
    try:
        return np.broadcast_to(array, shape)
    except ValueError:
        raise InvalidInput(f"{name} has shape {array.shape}; it must fit {shape}.") from None
