"""Least excess over limits that cannot be kept."""

from __future__ import annotations

from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float

from phasmid.forces.problem import Problem

FACES = 64
"""Faces of the pyramid around each cone; its edges are 0.12 % outside."""

SMALL = 1e-6
"""Cost of the forces relative to the excess; it makes the solution unique."""

DEPENDENT = 1e-7
"""Relative size of a singular value that counts as zero."""

EQUALITY = 5
"""The solver's code of an equation."""


class Limits(NamedTuple):
    """Limits A F <= upper on the forces of all feet; each ``per`` rows share one excess.

    Attributes:
        A: Shape (m, 3 k).
        upper: In units of the load, shape (m,).
        per: Number of rows of one foot or joint.
    """

    A: Float[np.ndarray, "rows axes"]
    upper: Float[np.ndarray, " rows"]
    per: int


class StandingFeet:
    """Standing feet of one sample, with forces in contact axes and in units of the load.

    Attributes:
        names: Names of the k standing legs.
        friction: Coefficients of friction, shape (k,).
        torque_limit: Torque limits of the joints [N·m], shape (k, 3).
        scale: Unit of forces and torques [N, N·m].
    """

    def __init__(self, problem: Problem, sample: int) -> None:
        count = int(problem.carrying[sample].sum())
        few, legs = problem.standing(np.array([sample]), count)
        self._few = few
        self.names = [problem.names[i] for i in legs[0]]
        self.friction, self.torque_limit = few.friction[0], few.limit[0]
        self.scale = max(float(np.abs(few.wrench[0, :3]).max()), 1e-9)
        A = few.grasp.reshape(6, count, 3).swapaxes(0, 1) @ few.axes[0]
        U, sizes, Vh = np.linalg.svd(A.swapaxes(0, 1).reshape(6, -1), full_matrices=False)
        known = sizes > DEPENDENT * sizes[0]
        self._A = sizes[known, None] * Vh[known]
        self._wrench = (U.T @ few.wrench[0])[known] / self.scale

    def pushes(self, least: float) -> Limits:
        """Return the limits of normal forces, from the least one [N] of a foot with full share."""
        A = -np.kron(np.eye(len(self.names)), [[1.0, 0.0, 0.0]])
        return Limits(A, -least * self._few.share[0] / self.scale, 1)

    def cones(self, factor: float = 1.0) -> Limits:
        """Return the friction cones, with friction times a factor."""
        angle = 2 * np.pi * np.arange(FACES) / FACES
        A = np.zeros((len(self.names), FACES, len(self.names), 3))
        for i, friction in enumerate(self.friction):
            A[i, :, i, 0] = -factor * friction
            A[i, :, i, 1], A[i, :, i, 2] = np.cos(angle), np.sin(angle)
        return Limits(A.reshape(-1, 3 * len(self.names)), np.zeros(FACES * len(self.names)), FACES)

    def torques(self) -> Limits:
        """Return the torque limits, one excess per joint."""
        few = self._few
        change = -np.swapaxes(few.jacobian[0], -1, -2) @ few.axes[0]
        A = np.zeros((len(self.names), 3, 2, len(self.names), 3))
        for i in range(len(self.names)):
            A[i, :, 0, i], A[i, :, 1, i] = change[i], -change[i]
        limit = np.minimum(few.limit[0], 1e30)
        upper = np.stack([limit - few.torque[0], limit + few.torque[0]], axis=-1) / self.scale
        return Limits(A.reshape(-1, 3 * len(self.names)), upper.ravel(), 2)

    def least_excess(self, hard: list[Limits], soft: Limits) -> np.ndarray | None:
        """Return the excesses of least sum over soft limits, per foot or joint [N, N·m].

        None where the hard limits cannot be kept.
        """
        n, m = self._A.shape[1], len(soft.upper) // soft.per
        give = -np.kron(np.eye(m), np.ones((soft.per, 1)))
        rows = [np.hstack([A, np.zeros((len(A), m))]) for A in (self._A, *(h.A for h in hard))]
        rows += [np.hstack([soft.A, give]), np.hstack([np.zeros((m, n)), -np.eye(m)])]
        A = np.concatenate(rows)
        upper = np.concatenate([self._wrench, *(h.upper for h in hard), soft.upper, np.zeros(m)])
        equations = np.arange(len(upper)) < len(self._wrench)
        lower = np.where(equations, upper, -1e30)
        kinds = np.where(equations, EQUALITY, 0).astype(np.int32)
        cost = np.concatenate([np.zeros(n), np.ones(m)])
        x, _, flag, _ = daqp.solve(SMALL * np.eye(n + m), cost, A, upper, lower, kinds)
        return np.asarray(x[n:] * self.scale) if flag > 0 else None
