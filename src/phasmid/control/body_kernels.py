"""Centre of mass of the legs, rotations and support margin at one instant."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.types import Model
from phasmid.gait.support_kernels import edge_margin, support_edges


@compiled
def moment_of(model: Model, leg: int, q: np.ndarray, moment: np.ndarray) -> None:
    """Add a leg's first moment of mass about the body's origin, body axes [kg·m].

    Args:
        model: Masses and lengths.
        leg: Index of the leg.
        q: Joint angles [rad], shape (3,).
        moment: Changed, shape (3,).
    """
    lengths, com, mass = model.lengths[leg], model.link_com[leg], model.link_mass[leg]
    c1, s1 = math.cos(q[0]), math.sin(q[0])
    out, side, up = 0.0, 0.0, 0.0
    for k in range(3):
        if k == 0:
            x, y, z = com[0, 0], com[0, 1], com[0, 2]
        else:
            e = q[1] if k == 1 else q[1] + q[2]
            c, s = math.cos(e), math.sin(e)
            x = lengths[0] + com[k, 0] * c - com[k, 1] * s
            z = com[k, 0] * s + com[k, 1] * c
            if k == 2:
                x += lengths[1] * math.cos(q[1])
                z += lengths[1] * math.sin(q[1])
            y = -com[k, 2]
        out += mass[k] * x
        side += mass[k] * y
        up += mass[k] * z
    x, y = c1 * out - s1 * side, s1 * out + c1 * side
    whole = mass[0] + mass[1] + mass[2]
    R, p = model.R_body_hip[leg], model.p_body_hip[leg]
    for i in range(3):
        moment[i] += whole * p[i] + R[i, 0] * x + R[i, 1] * y + R[i, 2] * up


@compiled
def to_hip(R: np.ndarray, v: np.ndarray, out: np.ndarray) -> None:
    """Write the transpose of R times v."""
    for i in range(3):
        out[i] = R[0, i] * v[0] + R[1, i] * v[1] + R[2, i] * v[2]


@compiled
def rotation(roll: float, pitch: float, yaw: float, R: np.ndarray) -> None:
    """Write the rotation of roll about x, then pitch about y, then yaw about z, fixed axes."""
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    R[0, 0], R[0, 1], R[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    R[1, 0], R[1, 1], R[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    R[2, 0], R[2, 1], R[2, 2] = -sp, cp * sr, cp * cr


@compiled
def support_margin(feet: np.ndarray, standing: np.ndarray, x: float, y: float) -> float:
    """Return the distance of a point from the nearest edge of the support polygon [m].

    Args:
        feet: Feet, x and y first [m], shape (L, 2 or 3).
        standing: Nonzero for feet that stand, shape (L,).
        x: Point [m].
        y: The same.

    Returns:
        Positive inside, negative outside, where it is the distance from the nearest edge's line;
        minus infinity where fewer than three feet stand, or they stand in a line.
    """
    edges = np.empty((len(standing) * len(standing), 5))
    return edge_margin(edges, support_edges(feet, standing, edges), x, y)
