"""The smallest foot forces that hold the robot."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from phasmid.errors import InfeasibleLoad, InvalidInput
from phasmid.forces.arguments import finite

MISSED = 1e-9
"""Part of the load by which the equations may be missed; it is round-off, below 1e-12."""


def minimum_norm(
    feet: Float[np.ndarray, "*batch legs 3"],
    stance: Bool[np.ndarray, "*batch legs"],
    wrench: Float[np.ndarray, "*batch 6"],
) -> Float[np.ndarray, "*batch legs 3"]:
    """Foot forces of least sum of squares that give a force and a moment.

    It knows neither friction nor that the ground cannot pull; on level ground, with the centre of
    mass between three standing feet, its forces at rest are vertical and push.

    Args:
        feet: Feet from the point about which the moment is taken [m], shape (..., L, 3).
        stance: Which feet stand; the others get no force, shape (..., L). At least three must,
            not on one line.
        wrench: Force [N] and moment [N·m] that the ground must give, shape (..., 6).

    Returns:
        Forces of the ground on the feet, in the axes of the inputs [N], shape (..., L, 3).

    Raises:
        InfeasibleLoad: In some sample the standing feet are fewer than three or lie on a line.
        InvalidInput: A number is not finite, or the shapes do not fit each other.

    Source: minimisation of the norm of the feet forces, as the paper's abstract names it.
    """
    feet, weight, wrench = finite(feet, "feet"), finite(stance, "stance"), finite(wrench, "wrench")
    batch = wrench.shape[:-1]
    if (feet.shape, wrench.shape) != ((*batch, *weight.shape[-1:], 3), (*batch, 6)) or (
        weight.shape != feet.shape[:-1]
    ):
        raise InvalidInput(
            f"feet, stance and wrench have shapes {feet.shape}, {weight.shape} and {wrench.shape}; "
            "they must be (..., L, 3), (..., L) and (..., 6) with the same leading axes."
        )
    # The Lagrange multipliers of the six equations are a force and a moment, and each foot's
    # force is F_i = force + moment x p_i; so the whole problem is one 6 x 6 solution.
    p = feet * weight[..., None]
    normal = np.zeros((*wrench.shape[:-1], 6, 6))
    count = weight.sum(axis=-1)
    x, y, z = np.moveaxis(p.sum(axis=-2), -1, 0)
    normal[..., 0, 0] = normal[..., 1, 1] = normal[..., 2, 2] = count
    # Force rows: the sum over the feet of (moment x p_i); moment rows: its transpose.
    normal[..., 0, 4], normal[..., 0, 5] = z, -y
    normal[..., 1, 3], normal[..., 1, 5] = -z, x
    normal[..., 2, 3], normal[..., 2, 4] = y, -x
    normal[..., 3:, :3] = np.swapaxes(normal[..., :3, 3:], -1, -2)
    second = np.swapaxes(p, -1, -2) @ p
    trace = np.trace(second, axis1=-2, axis2=-1)
    normal[..., 3:, 3:] = trace[..., None, None] * np.eye(3) - second
    try:
        multipliers = np.linalg.solve(normal, wrench[..., None])
        missed = np.abs(normal @ multipliers - wrench[..., None]).max(axis=(-2, -1))
    except np.linalg.LinAlgError:
        missed = np.array(np.inf)
    # Feet on a line make the system singular, which round-off may hide; its solution is then huge.
    if not np.all(missed <= MISSED * (1.0 + np.abs(wrench).max(axis=-1))):
        raise InfeasibleLoad(
            "somewhere fewer than three feet stand, or on one line; they cannot give any load.",
            limit="feet",
            hint="three standing feet or more, not on one line",
        )
    multipliers = multipliers[..., 0]
    force, moment = multipliers[..., None, :3], multipliers[..., None, 3:]
    turned = np.cross(np.broadcast_to(moment, p.shape), p)
    return force * weight[..., None] + turned
