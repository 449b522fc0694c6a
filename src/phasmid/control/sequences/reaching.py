"""Which angles put all feet somewhere, within reach and joint limits."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from phasmid.kinematics import hip_from_body, link_frames
from phasmid.kinematics.leg import angles_and_margin
from phasmid.robot import Robot

STRETCH_MARGIN = 1e-4
"""Square of the distance that a foot keeps from full stretch, as a share of the leg's [1]."""


def angles_and_reach(
    robot: Robot, p_body_feet: Float[np.ndarray, "*batch legs 3"], margin: float = 0.0
) -> tuple[Float[np.ndarray, "*batch legs 3"], Bool[np.ndarray, "*batch legs"]]:
    """Joint angles of all legs for feet in the body frame, and which of them can be had.

    Args:
        robot: The robot, L legs.
        p_body_feet: Feet in the body frame [m], shape (..., L, 3).
        margin: Angle that they keep from the joint limits [rad].

    Returns:
        Angles [rad], shape (..., L, 3), and whether each leg has them, shape (..., L).
    """
    arrays = robot.arrays
    q, slack = angles_and_margin(arrays, hip_from_body(robot, p_body_feet))
    longest = (arrays.lengths[:, 1] + arrays.lengths[:, 2]) ** 2
    low, high = arrays.joint_limits[..., 0] + margin, arrays.joint_limits[..., 1] - margin
    # Written so that NaN counts as out of reach.
    near = slack >= STRETCH_MARGIN * longest
    return q, near & ((q >= low - 1e-9) & (q <= high + 1e-9)).all(axis=-1)


def knees_and_feet(
    robot: Robot, q: Float[np.ndarray, "*batch legs 3"]
) -> tuple[Float[np.ndarray, "*batch legs 3"], Float[np.ndarray, "*batch legs 3"]]:
    """Knees and feet in the body frame [m], each of shape (..., L, 3)."""
    frames = link_frames(robot, q)
    knees = frames.position[..., 2, :]
    ends = np.array([leg.tibia.end for leg in robot.legs])
    return knees, knees + np.einsum("...lij,lj->...li", frames.rotation[..., 2, :, :], ends)
