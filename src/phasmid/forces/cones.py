"""Minimum of a cost over an affine set within circular cones and linear limits."""

from __future__ import annotations

from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float

FACES = 8
"""Faces of the initial pyramid around each cone."""


def directions(faces: int) -> Float[np.ndarray, "faces 2"]:
    """Return the tangential directions of the faces of a pyramid."""
    angle = 2 * np.pi * np.arange(faces) / faces
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


ROUND = directions(FACES)
"""Tangential directions of the initial pyramid's faces."""

ASIDE = 0.05
"""A face within this angle of the touching plane is dropped [rad]."""

SWING = 0.015
"""Rotation of a direction above which its last touching plane is kept [rad]."""

TOLERANCE = 1e-11
"""Tolerance of cones and optimality, relative to the load."""

MOST_PROGRAMMES = 200
"""Most quadratic programmes of a sample; 4 or 5 are usual, above 20 rare."""

PATIENCE = 6
"""Programmes after which a foot at its cone's tip keeps its last touching planes."""

KEPT = 4
"""Number of touching planes that are kept."""

TIP = 0.01
"""Tangential force near the tip, relative to the load."""

PROXIMAL = 1e-3
"""Proximal curvature of a linear cost about the last point."""


class Rows(NamedTuple):
    """Linear limits lower <= A x <= upper, one set per sample.

    Attributes:
        A: Shape (N, m, d).
        lower: Shape (N, m).
        upper: Shape (N, m).
    """

    A: Float[np.ndarray, "samples rows free"]
    lower: Float[np.ndarray, "samples rows"]
    upper: Float[np.ndarray, "samples rows"]

    def of(self, some: np.ndarray | slice) -> Rows:
        """Return the limits of some samples."""
        return Rows(*(part[some] for part in self))

    @classmethod
    def join(cls, *sets: Rows) -> Rows:
        """Join several sets of limits."""
        return cls(*(np.concatenate(parts, axis=1) for parts in zip(*sets, strict=True)))

    @classmethod
    def below(cls, A: np.ndarray, upper: np.ndarray) -> Rows:
        """Return the limits A x <= upper."""
        return cls(A, np.full(upper.shape, -UNBOUNDED), upper)


ROUND_OFF = 1e-15
"""Round-off of a force, relative to the load."""

SETTLED = 0.1
"""Change of a linear cost at convergence, relative to the tolerance."""

UNBOUNDED = 1e30
"""Infinity of the solver."""


def cheapest_points(
    force: Float[np.ndarray, "samples feet 3"],
    U: Float[np.ndarray, "samples feet 3 free"],
    friction: Float[np.ndarray, "samples feet"],
    limits: Rows,
    slope: Float[np.ndarray, " free"] | None = None,
    tolerance: float = TOLERANCE,
) -> Float[np.ndarray, "samples free"]:
    """Return the x of least cost with every foot's force f + U x in its friction cone.

    The cost is ½ xᵀ x, or slope · x with a slope.

    Each cone |tangential force| <= friction * normal force starts as a pyramid around it. Each
    iteration adds the half space that touches the cone at the last force, and the cone's curvature
    there, times the multiplier of the limit, to the cost. This is Newton's method on the
    optimality conditions: it meets the circular cone to round-off after a few programmes.

    Args:
        force: Forces for x = 0 in contact axes (normal first), in units of the load: (N, k, 3).
        U: Change of the forces with x, shape (N, k, 3, d).
        friction: Coefficients of friction, shape (N, k).
        limits: Further limits.
        slope: Of a linear cost, shape (d,).
        tolerance: Of cones and optimality, relative to the load.

    Returns:
        Points, shape (N, d); NaN where there is none.

    Source: Nocedal and Wright, Numerical Optimization, chapter 18 (sequential quadratic
    programming); each programme is solved by daqp (Arnström, Bemporad, Axehill 2022).
    """
    samples, feet, _, free = U.shape
    limits = Rows.join(limits, pyramid(force, U, friction, ROUND))
    x = np.zeros((samples, free))
    now = force.copy()
    # A foot without force keeps its last direction, which is otherwise round-off.
    direction = np.broadcast_to(np.array([1.0, 0.0]), (samples, feet, 2)).copy()
    pressure = np.zeros((samples, feet))
    kept = np.repeat(direction[:, :, None], KEPT, axis=2)
    fixed = limits.upper.shape[1] - FACES * feet
    found = np.zeros(samples, dtype=bool)
    todo = np.arange(samples)
    for round_ in range(MOST_PROGRAMMES):
        f, V, mu = force[todo], U[todo], friction[todo]
        along = np.hypot(now[todo, :, 1], now[todo, :, 2])
        loaded = along > 1e-9
        length = np.where(loaded, along, 1.0)
        d = np.where(loaded[..., None], now[todo, :, 1:] / length[..., None], direction[todo])
        swung = _apart(d, direction[todo], SWING)[..., None, None]
        shifted = np.concatenate([direction[todo][:, :, None], kept[todo][:, :, :-1]], axis=2)
        kept[todo] = np.where(swung, shifted, kept[todo])
        direction[todo] = d
        sideways = np.stack([-d[..., 1], d[..., 0]], axis=-1)
        bend = np.where(loaded, pressure[todo] / length, 0.0)

        side = (sideways[..., None, :] @ V[..., 1:, :])[..., 0, :]
        bent = bend[..., None] * side
        H = np.swapaxes(bent, -1, -2) @ side
        g = np.einsum("nkd,nk->nd", bent, np.sum(sideways * f[..., 1:], axis=-1))
        if slope is None:
            H += np.eye(free)
        else:
            H += PROXIMAL * np.eye(free)
            g += slope - PROXIMAL * x[todo]
        rows = limits.of(todo)
        # A face beside the touching plane is nearly redundant and makes the solver cycle.
        beside = loaded[..., None] & ~_apart(d[..., None, :], ROUND, ASIDE)
        rows.upper[:, fixed:][beside.reshape(len(todo), -1)] = UNBOUNDED
        rows = Rows.join(rows, _touching(d, f, V, mu))
        if round_ >= PATIENCE:
            # At the tip of a cone the direction may oscillate: keep the last planes.
            for i in range(KEPT):
                past = _touching(kept[todo, :, i], f, V, mu)
                counts = (along < TIP) & _apart(d, kept[todo, :, i], SWING)
                upper = np.where(counts, past.upper, UNBOUNDED)
                rows = Rows.join(rows, past._replace(upper=upper))
        new, multipliers, exists = _programmes(H, g, rows)

        reached = f + (V @ new[:, None, :, None])[..., 0]
        # The pyramids' faces come foot by foot, then touching planes, one for each foot at a time.
        cones = multipliers[:, fixed:]
        faces, planes = cones[:, : FACES * feet], cones[:, FACES * feet :]
        pressure[todo] = faces.reshape(-1, feet, FACES).sum(axis=-1)
        pressure[todo] += planes.reshape(len(todo), -1, feet).sum(axis=1)
        outside = np.hypot(reached[..., 1], reached[..., 2]) - mu * reached[..., 0]
        outside = outside.max(axis=-1)
        # A limit that was not active before has lent the cost no curvature yet.
        pressed = np.where(loaded, pressure[todo] / length, 0.0)
        slack = np.abs(pressed * np.sum(sideways * reached[..., 1:], axis=-1)).max(axis=-1)
        # Where limits leave little room their multipliers are huge, and so is their round-off.
        slack = np.maximum(slack - ROUND_OFF * pressed.max(axis=-1), 0.0)
        if slope is not None:
            change = new - x[todo]
            slack = np.maximum(slack, PROXIMAL * np.abs(change).max(axis=-1))
            # Where many points are nearly equally cheap they drift on at the same cost.
            slack = np.minimum(slack, np.abs(change @ slope) / SETTLED)
        error = np.maximum(outside, slack)
        x[todo] = new
        done = exists & (error <= tolerance)
        found[todo] = done
        now[todo] = reached
        todo = todo[exists & ~done]
        if not len(todo):
            break
    x[~found] = np.nan
    return x


def pyramid(force: np.ndarray, U: np.ndarray, friction: np.ndarray, faces: np.ndarray) -> Rows:
    """Return the half spaces of pyramids around the cones, foot by foot; see `cheapest_points`.

    Faces are given by `directions`.
    """
    face = np.empty((*friction.shape, len(faces), 3))
    face[..., 0], face[..., 1:] = -friction[..., None], faces
    samples, free = len(U), U.shape[-1]
    return Rows.below(
        (face @ U).reshape(samples, -1, free), -(face @ force[..., None]).reshape(samples, -1)
    )


def _touching(d: np.ndarray, f: np.ndarray, V: np.ndarray, friction: np.ndarray) -> Rows:
    """Return the half spaces that touch the cones along tangential directions, one per foot."""
    plane = np.concatenate([-friction[..., None], d], axis=-1)
    return Rows.below((plane[..., None, :] @ V)[..., 0, :], -np.sum(plane * f, axis=-1))


def _apart(a: np.ndarray, b: np.ndarray, angle: float) -> np.ndarray:
    """Return where two directions differ by more than an angle."""
    return np.asarray(np.sum(a * b, axis=-1) < np.cos(angle))


def _programmes(
    H: np.ndarray, g: np.ndarray, limits: Rows
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return minima of ½ xᵀ H x + gᵀ x within limits, their multipliers, and where they exist."""
    samples, rows = limits.upper.shape
    x, multipliers = np.zeros(g.shape), np.zeros((samples, rows))
    exists = np.zeros(samples, dtype=bool)
    kinds = np.zeros(rows, dtype=np.int32)
    A, lower, upper = (np.ascontiguousarray(part) for part in limits)
    solve = daqp.solve
    for i in range(samples):
        point, _, flag, info = solve(
            H[i], g[i], A[i], upper[i], lower[i], kinds, primal_tol=TOLERANCE / 10
        )
        if flag == 1:
            x[i], multipliers[i], exists[i] = point, info["lam"], True
    return x, multipliers, exists
