"""Contacts of the feet, and the load of the joints."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from phasmid.errors import InvalidInput
from phasmid.kinematics import jacobian
from phasmid.robot import Robot


def contact_points(
    robot: Robot, feet: Float[np.ndarray, "*batch legs 3"], normals: Float[np.ndarray, "..."]
) -> Float[np.ndarray, "*batch legs 3"]:
    """Return the points at which feet touch the ground: below the centre of a ball, or the feet.

    Args:
        robot: The robot, L legs.
        feet: Feet in any axes [m], shape (..., L, 3).
        normals: Outward unit normals of the ground in these axes, shape (..., L, 3) or (3,).
    """
    return feet - robot.foot_radius * normals if robot.foot_radius else feet


def contact_jacobian(
    robot: Robot,
    q: Float[np.ndarray, "*batch legs 3"],
    R_world_body: Float[np.ndarray, "*batch 3 3"],
    normals: Float[np.ndarray, "..."],
) -> Float[np.ndarray, "*batch legs 3 3"]:
    """Return the Jacobians of the tibiae's points that touch the ground, body at rest.

    A force on the ball of a foot acts below its centre. With the Jacobian of the centre the moment
    of its tangential part about the centre would be lost.

    Args:
        robot: The robot, L legs.
        q: Joint angles [rad], shape (..., L, 3).
        R_world_body: Rotations of the body, shape (..., 3, 3).
        normals: Outward unit normals of the ground in world axes, shape (..., L, 3) or (3,).

    Returns:
        d point / d q in world axes [m/rad], shape (..., L, 3, 3).
    """
    R_world_hip = R_world_body[..., None, :, :] @ robot.arrays.R_body_hip
    if not robot.foot_radius:
        return np.asarray(R_world_hip @ jacobian(robot.arrays, q))
    offset = -robot.foot_radius * np.einsum("...ji,...j->...i", R_world_hip, normals)
    return np.asarray(R_world_hip @ jacobian(robot.arrays, q, offset))


@dataclass(frozen=True, eq=False)
class Contacts:
    """Point contacts of the feet with the ground.

    Attributes:
        feet: Points of contact from the point of the moment [m], shape (..., L, 3).
        share: Feet that stand (bool), or the share of its full load that each carries, 0 to 1,
            shape (..., L); kept as a number.
        normals: Outward normals of the ground at the feet, of any length above 0; up by default.
            Shape (..., L, 3) or (3,); kept as unit vectors.
        friction: Coefficient of Coulomb friction, shape (..., L) or one number.
        leg_names: Names of the legs for messages; by default their numbers from 1.

    Raises:
        InvalidInput: A number is out of range.
    """

    feet: Float[np.ndarray, "..."]
    share: Float[np.ndarray, "..."] | Bool[np.ndarray, "..."]
    normals: Float[np.ndarray, "..."] = field(default_factory=lambda: np.array([0.0, 0, 1]))
    friction: float | Float[np.ndarray, "..."] = 0.7
    leg_names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        legs = self.feet.shape[:-1]
        share = np.broadcast_to(np.asarray(self.share, dtype=float), legs)
        friction = np.broadcast_to(np.asarray(self.friction, dtype=float), legs)
        if not ((share >= 0) & (share <= 1)).all():
            raise InvalidInput(
                f"share is {share.min():g} to {share.max():g}; it must be between 0 and 1."
            )
        if not (friction >= 0).all():
            raise InvalidInput(f"friction is {friction.min():g}; it must be 0 or more.")
        length = np.linalg.norm(self.normals, axis=-1, keepdims=True)
        if not length.all():
            raise InvalidInput(
                "a normal is (0, 0, 0); it must point out of the ground.", hint="(0, 0, 1) is up"
            )
        normals = np.broadcast_to(self.normals / length, self.feet.shape)
        names = self.leg_names or tuple(str(i + 1) for i in range(legs[-1]))
        values = {"share": share, "normals": normals, "friction": friction, "leg_names": names}
        for name, value in values.items():
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
        jacobian: d contact point / d q in the axes of the forces [m/rad], shape (..., L, 3, 3).
        torque: Joint torques of the motion without the ground [N·m], shape (..., L, 3).
        limit: Torque limit of each joint, in both directions [N·m], shape (..., L, 3) or one
            number; none by default. `FrictionCone` and `SmallestLargestLoad` keep it.
    """

    jacobian: Float[np.ndarray, "..."]
    torque: Float[np.ndarray, "..."]
    limit: float | Float[np.ndarray, "..."] = np.inf

    def __post_init__(self) -> None:
        joints = self.jacobian.shape[:-1]
        object.__setattr__(self, "torque", np.broadcast_to(self.torque, joints))
        object.__setattr__(self, "limit", np.broadcast_to(self.limit, joints))

    def with_ground(
        self, force: Float[np.ndarray, "*batch legs 3"]
    ) -> Float[np.ndarray, "*batch legs 3"]:
        """Return the joint torques with ground reaction forces [N], both of shape (..., L, 3)."""
        return self.torque - np.einsum("...ij,...i->...j", self.jacobian, force)
