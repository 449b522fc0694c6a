"""Foot forces within friction and torque limits at one instant, by one quadratic programme."""

from __future__ import annotations

import math
from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled, internal
from phasmid.control.dynamics.instant import Needs
from phasmid.control.dynamics.sharing import _grasp_of

FACES = 8
"""Faces of the pyramid inside each friction cone; its edges lie on the cone."""

WITHIN = math.cos(math.pi / FACES)
"""How far such a pyramid's faces are inside."""

DEARER = 1e3
"""What leaving out all of the motion costs beside forces of the size of the load."""

BOX, EQUATION = 0, 5
"""The solver's words for a limit and for an equation."""

UNBOUNDED = 1e30
"""What the solver takes for infinity."""


class Limited(NamedTuple):
    """Forces within the limits.

    Attributes:
        force: Of the ground on the feet [N], shape (L, 3).
        part: How much of the motion they give, 1: all of it, 0: they carry the robot at rest.
    """

    force: Float[np.ndarray, "legs 3"]
    part: float


def limited_forces(
    needs: Needs,
    rest: Needs,
    inverse: Float[np.ndarray, "legs 3 3"],
    cheapest: Float[np.ndarray, "legs 3"],
    share: Float[np.ndarray, " legs"],
    normals: Float[np.ndarray, "legs 3"],
    friction: float,
    limits: Float[np.ndarray, "2 legs 3"],
) -> Limited | None:
    """The forces nearest to the cheapest that keep friction and torque limits.

    Where the whole motion cannot be had, as much of it is given as can.

    Args:
        needs: Of the motion.
        rest: Of the robot in the same pose without any motion.
        inverse: D of each foot's cost, shape (L, 3, 3).
        cheapest: Forces that give the motion without limits [N], shape (L, 3).
        share: Each foot's part of its full share, shape (L,).
        normals: Of the ground, shape (L, 3).
        friction: Coefficient that may be used; the pyramid inside its cone is kept to.
        limits: Lowest and highest torques of the joints [N·m].

    Returns:
        None where not even the robot at rest can be carried within the limits.
    """
    feet = np.flatnonzero(share >= NEGLIGIBLE)
    scale = float(np.abs(rest.wrench[:3]).max())
    if not len(feet) or scale <= 0.0:
        return None
    count = len(feet)
    size, rows = 3 * count + 1, 6 + (FACES + 3) * count
    A, upper = np.zeros((rows, size)), np.empty(size + rows)
    lower, W = np.full(size + rows, -UNBOUNDED), np.empty((count, 3, 3))
    _lay_out(
        needs,
        rest,
        inverse,
        cheapest,
        normals,
        friction * WITHIN,
        limits,
        feet,
        scale,
        W,
        A,
        lower,
        upper,
    )
    kinds = np.zeros(size + rows, np.int32)
    kinds[size : size + 6] = EQUATION
    cost = np.zeros(size)
    cost[-1] = DEARER
    x, _, flag, _ = daqp.solve(np.eye(size), cost, A, upper, lower, kinds)
    if flag <= 0:
        return None
    force = np.zeros_like(cheapest)
    change = (W @ np.asarray(x[:-1]).reshape(count, 3, 1))[..., 0]
    force[feet] = cheapest[feet] + scale * change
    return Limited(force, min(max(1.0 - float(x[-1]), 0.0), 1.0))


NEGLIGIBLE = 1e-9
"""A foot with a smaller share than this carries nothing."""


def _lay_out_rows(
    needs: Needs,
    rest: Needs,
    inverse: np.ndarray,
    cheapest: np.ndarray,
    normals: np.ndarray,
    friction: float,
    limits: np.ndarray,
    feet: np.ndarray,
    scale: float,
    W: np.ndarray,
    A: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
) -> None:
    """The programme's rows: unknowns are y of F = cheapest + W y, and what is left out, 0 to 1."""
    count = feet.shape[0]
    last = 3 * count
    upper[:last] = 1e30
    lower[last], upper[last] = 0.0, 1.0
    first = last + 1
    grasp = np.zeros((6, 3))
    # What is left out of the wrench is no longer to be given.
    reach = 1e-9
    for k in range(count):
        for i in range(3):
            reach = max(reach, abs(needs.foot[feet[k], i]))
    for i in range(6):
        unit = 1.0 if i < 3 else 1.0 / reach
        A[i, last] = unit * (needs.wrench[i] - rest.wrench[i]) / scale
        lower[first + i] = upper[first + i] = 0.0
    for k in range(count):
        foot = feet[k]
        _root_of(inverse[foot], W[k])
        _grasp_of(needs.foot[foot], 1.0 / reach, grasp)
        for i in range(6):
            for j in range(3):
                for m in range(3):
                    A[i, 3 * k + j] += grasp[i, m] * W[k, m, j]
        n = normals[foot]
        # Two tangents, the first from the axis that lies farthest from the normal.
        t, u = np.zeros(3), np.empty(3)
        least = 0
        for i in range(1, 3):
            if abs(n[i]) < abs(n[least]):
                least = i
        t[least] = 1.0
        for i in range(3):
            t[i] -= n[least] * n[i]
        length = math.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
        for i in range(3):
            t[i] /= length
        u[0], u[1] = n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2]
        u[2] = n[0] * t[1] - n[1] * t[0]
        for face in range(8):
            row = 6 + 8 * k + face
            c, s = math.cos(math.pi * face / 4), math.sin(math.pi * face / 4)
            now = 0.0
            for i in range(3):
                side = c * t[i] + s * u[i] - friction * n[i]
                now += side * cheapest[foot, i] / scale
                for j in range(3):
                    A[row, 3 * k + j] += side * W[k, i, j]
            upper[first + row] = -now
        for joint in range(3):
            row = 6 + 8 * count + 3 * k + joint
            now = needs.torque[foot, joint]
            for i in range(3):
                J = needs.jacobian[foot, i, joint]
                now -= J * cheapest[foot, i]
                for j in range(3):
                    A[row, 3 * k + j] -= J * W[k, i, j]
            A[row, last] = (rest.torque[foot, joint] - needs.torque[foot, joint]) / scale
            lower[first + row] = (limits[0, foot, joint] - now) / scale
            upper[first + row] = (limits[1, foot, joint] - now) / scale


@internal
def _root_of(D: np.ndarray, W: np.ndarray) -> None:
    """W with W Wᵀ = D, of a positive 3 x 3 matrix."""
    W[:] = 0.0
    W[0, 0] = math.sqrt(D[0, 0])
    W[1, 0], W[2, 0] = D[1, 0] / W[0, 0], D[2, 0] / W[0, 0]
    W[1, 1] = math.sqrt(D[1, 1] - W[1, 0] * W[1, 0])
    W[2, 1] = (D[2, 1] - W[2, 0] * W[1, 0]) / W[1, 1]
    W[2, 2] = math.sqrt(D[2, 2] - W[2, 0] * W[2, 0] - W[2, 1] * W[2, 1])


_lay_out = compiled(_lay_out_rows)
