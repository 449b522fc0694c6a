"""Where the trunk is and how it moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, located
from phasmid.kinematics.arguments import lead, numbers, shared_axes

ROTATION_TOLERANCE = 1e-6
"""By this much a rotation's columns may miss being orthogonal unit vectors."""


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Pose, velocity and acceleration of the body frame.

    Leading axes are broadcast to one shape; the arrays are read-only.

    Attributes:
        position: Origin of the body frame in the world [m], shape (..., 3).
        rotation: ``R_world_body``, shape (..., 3, 3).
        velocity: Velocity of the origin, world axes [m/s], shape (..., 3).
        angular_velocity: World axes [rad/s], shape (..., 3).
        acceleration: Second derivative of position, world axes, without gravity [m/s²],
            shape (..., 3).
        angular_acceleration: World axes [rad/s²], shape (..., 3).

    Raises:
        InvalidInput: A shape is wrong, a number is not finite, or a rotation is none.
    """

    position: Float[np.ndarray, "*#batch 3"]
    rotation: Float[np.ndarray, "*#batch 3 3"]
    velocity: Float[np.ndarray, "*#batch 3"]
    angular_velocity: Float[np.ndarray, "*#batch 3"]
    acceleration: Float[np.ndarray, "*#batch 3"]
    angular_acceleration: Float[np.ndarray, "*#batch 3"]

    def __post_init__(self) -> None:
        with located("body motion"):
            self._take(numbers(**{each.name: getattr(self, each.name) for each in fields(self)}))
        R = self.rotation
        miss = np.abs(R @ np.swapaxes(R, -1, -2) - np.eye(3)).max(initial=0.0)
        if miss > ROTATION_TOLERANCE or np.any(np.linalg.det(R) < 0):
            raise InvalidInput(
                "rotation is no rotation; its columns must be orthogonal unit vectors of a "
                "right-handed frame.",
                where="body motion",
                hint="phasmid.kinematics.rotation_rpy or quaternion_rotation",
            )

    def _take(self, arrays: Mapping[str, np.ndarray]) -> None:
        tails = {name: (3, 3) if name == "rotation" else (3,) for name in arrays}
        leads = {name: lead(name, array, tails[name]) for name, array in arrays.items()}
        for name, array in arrays.items():
            if not np.all(np.isfinite(array)):
                index = tuple(map(int, np.argwhere(~np.isfinite(array))[0]))
                raise InvalidInput(f"{name}{list(index)} is {array[index]}; it must be finite.")
        axes = shared_axes(leads)
        for name, array in arrays.items():
            own = np.broadcast_to(array.copy(), (*axes, *tails[name]))
            object.__setattr__(self, name, own)

    @classmethod
    def at_rest(
        cls,
        position: Float[np.ndarray, "*#batch 3"] | None = None,
        rotation: Float[np.ndarray, "*#batch 3 3"] | None = None,
    ) -> BodyMotion:
        """A trunk that stands still.

        Args:
            position: Origin of the body frame in the world [m], shape (..., 3); (0, 0, 0) by
                default.
            rotation: ``R_world_body``, shape (..., 3, 3); level and facing x by default.
        """
        zero = np.zeros(3)
        return cls(
            position=zero if position is None else position,
            rotation=np.eye(3) if rotation is None else rotation,
            velocity=zero,
            angular_velocity=zero,
            acceleration=zero,
            angular_acceleration=zero,
        )
