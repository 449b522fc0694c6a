"""Motion of the trunk: pose, velocity and acceleration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.arguments import check_arrays
from phasmid.errors import InvalidInput

ROTATION_TOLERANCE = 1e-6
"""Largest deviation of a rotation's columns from orthogonal unit vectors."""


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Pose, velocity and acceleration of the body frame; leading axes broadcast.

    Attributes:
        position: Origin of the body frame in the world [m], shape (..., 3).
        rotation: ``R_world_body``, shape (..., 3, 3).
        velocity: Velocity of the origin, world axes [m/s], shape (..., 3).
        angular_velocity: World axes [rad/s], shape (..., 3).
        acceleration: Second derivative of position, world axes, without gravity [m/s²],
            shape (..., 3).
        angular_acceleration: World axes [rad/s²], shape (..., 3).

    Raises:
        InvalidInput: A matrix is not a rotation, or a shape is wrong.
    """

    position: Float[np.ndarray, "*#batch 3"]
    rotation: Float[np.ndarray, "*#batch 3 3"]
    velocity: Float[np.ndarray, "*#batch 3"]
    angular_velocity: Float[np.ndarray, "*#batch 3"]
    acceleration: Float[np.ndarray, "*#batch 3"]
    angular_acceleration: Float[np.ndarray, "*#batch 3"]

    def __post_init__(self) -> None:
        check_arrays(self)
        R = np.asarray(self.rotation)
        deviation = np.abs(R @ np.swapaxes(R, -1, -2) - np.eye(3)).max(initial=0.0)
        if not deviation <= ROTATION_TOLERANCE or np.any(np.linalg.det(R) < 0):
            raise InvalidInput(
                "rotation is not a rotation; its columns must be orthogonal unit vectors of a "
                "right-handed frame.",
                where="body motion",
                hint="phasmid.kinematics.rotation_rpy or quaternion_rotation",
            )

    @classmethod
    def at_rest(
        cls,
        position: Float[np.ndarray, "*#batch 3"] | None = None,
        rotation: Float[np.ndarray, "*#batch 3 3"] | None = None,
    ) -> BodyMotion:
        """Motion of a trunk at rest.

        Args:
            position: Origin of the body frame in the world [m], shape (..., 3); (0, 0, 0) by
                default.
            rotation: ``R_world_body``, shape (..., 3, 3); level and facing x by default.
        """
        position = np.zeros(3) if position is None else position
        return cls(position, np.eye(3) if rotation is None else rotation, *[np.zeros(3)] * 4)
