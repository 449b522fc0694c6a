"""Poses in URDF files: a position, and three angles in radians."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.formats.xml import Element
from phasmid.kinematics import rotation_rpy

WHOLE_TURN = 2.02 * math.pi
"""A turn and a hundredth [rad]: limits of ±6.28 or ±6.3 rad are in use, larger ones are degrees."""

ENDLESS = 1000.0
"""Limits of a joint from here on mean none [rad]."""


def pose_of(element: Element | None) -> Float[np.ndarray, "4 4"]:
    """Return the pose of an ``<origin>``: turned by Rz(yaw) Ry(pitch) Rx(roll), then moved.

    Args:
        element: The origin; without one the pose is none.

    Raises:
        InvalidInput: An angle is more than a turn, as degrees are.
    """
    X = np.eye(4)
    if element is None:
        return X
    roll, pitch, yaw = element.numbers("rpy", 3, (0.0, 0.0, 0.0))
    if max(abs(roll), abs(pitch), abs(yaw)) > WHOLE_TURN:
        turned = " ".join(f"{angle:.5g}" for angle in np.radians([roll, pitch, yaw]))
        raise InvalidInput(
            f"<origin>: rpy {roll:g} {pitch:g} {yaw:g} rad is more than a turn; "
            "URDF angles are radians.",
            where=element.where,
            hint=f'rpy="{turned}", if these are degrees',
        )
    if roll or pitch or yaw:
        X[:3, :3] = rotation_rpy(*map(np.asarray, (roll, pitch, yaw)))
    X[:3, 3] = element.numbers("xyz", 3, (0.0, 0.0, 0.0))
    return X
