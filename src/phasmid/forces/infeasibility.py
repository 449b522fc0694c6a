"""Explanation of infeasible loads: the feet, the limit, and the excess."""

from __future__ import annotations

from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float

from phasmid.errors import InfeasibleLoad
from phasmid.forces.load import Load, grasp_matrix
from phasmid.robot import JOINTS

NOTHING = 1e-6
"""Excess that counts as zero, relative to the load."""

LINE = 1e-12
"""Relative distance from a line below which feet stand on it."""

FACES = 64
"""Faces of the pyramid around each cone; its edges are 0.12 % outside."""

SMALL = 1e-6
"""Cost of the forces relative to the excess; it makes the solution unique."""

DEPENDENT = 1e-7
"""Relative size of a singular value that counts as zero."""

EQUALITY = 5
"""The solver's code of an equation."""


def explain(
    load: Load,
    missing: Float[np.ndarray, "6"],
    least: float,
    index: tuple[int, ...],
    time: float | None,
) -> InfeasibleLoad:
    """Return the error of an infeasible sample.

    Args:
        load: One sample.
        missing: Part of the wrench that the feet cannot give, shape (6,).
        least: Least normal force of a foot with full share [N].
        index: Index of the sample over the caller's leading axes.
        time: Time of the sample [s].
    """
    names = [load.names[i] for i in load.legs[0]]
    limit, culprits, excess, what, hint = (
        _too_few(load, names, missing) if missing.any() else _beyond_limits(load, names, least)
    )
    words = [f"sample {', '.join(map(str, index))}"] if index else []
    if time is not None:
        words.append(f"at {time:.4g} s")
    return InfeasibleLoad(
        f"{' '.join(words)}: {what}" if words else what,
        limit=limit,
        culprits=tuple(culprits),
        excess=tuple(float(value) for value in excess),
        index=index,
        hint=hint,
    )


class _Reason(NamedTuple):
    limit: str
    culprits: list[str]
    excess: np.ndarray
    what: str
    hint: str


def _too_few(load: Load, names: list[str], missing: np.ndarray) -> _Reason:
    """Return the reason of too few feet, feet on a line, or feet nearly on one."""
    feet, force, moment = load.feet[0], load.wrench[0, :3], load.wrench[0, 3:]
    hint = "three standing feet or more, not on one line"
    who = "no foot stands to give the load"
    if names:
        # Any foot gives the force. Forces that sum to zero give the moments Σ (p - centre) × F.
        centre = feet.mean(axis=0)
        arms = grasp_matrix(feet - centre)[3:]
        spread = np.linalg.svd(feet - centre)[1]
        moment = moment - np.cross(centre, force)
        moment = moment - arms @ (np.linalg.pinv(arms, rcond=LINE) @ moment)
        force = np.zeros(3)
        who = f"{'foot' if len(names) == 1 else 'feet'} {_listed(names)}"
        if len(names) < 3:
            who = f"{who} alone cannot give the load"
        elif spread[1] <= LINE * spread[0]:
            who = f"the {who} stand on one line and cannot give the load"
        else:
            who = f"the {who} stand nearly on one line and cannot give the load to round-off"
            force, moment = missing[:3], missing[3:]
            hint = "feet further from one line, shares nearer to 1, or a less extreme cost"
    sizes = np.array([np.linalg.norm(force), np.linalg.norm(moment)])
    units = zip(sizes, ("N", "N·m"), strict=True)
    lacks = [f"{size:.3g} {unit}" for size, unit in units if size > NOTHING * sizes.max()]
    return _Reason("feet", names, sizes, f"{who}; {_listed(lacks)} of it would be missing.", hint)


def _beyond_limits(load: Load, names: list[str], least: float) -> _Reason:
    """Return the first limit that cannot be kept, with the excesses of least sum.

    Limits are added one after another: pull, friction, torque.
    """
    scale = max(float(np.abs(load.wrench[0, :3]).max()), 1e-9)
    joints = [f"{name}.{joint}" for name in names for joint in JOINTS]
    pull = "would have to pull with {excess} N, and the ground only pushes"
    if least > 0:
        pull = "would carry {excess} N less than their least normal force"
    # Limit, its rows and sizes, subjects, noun and its plural, sentence, hint.
    limits = (
        (
            *("pull", _pushes(load, least / scale), np.zeros(len(names)), names, "foot", "feet"),
            pull,
            "the centre of mass further inside the standing feet, or more of them",
        ),
        (
            *("friction", _cones(load), load.friction[0], names, "foot", "feet"),
            "would slip; friction of {limit} falls short by {excess} N",
            "more friction, a flatter ground, or a slower motion",
        ),
        (
            *("torque", _torques(load, scale), load.limit[0].ravel(), joints, "joint", "joints"),
            "would need {need} N·m; the limit is {limit} N·m",
            "stronger servos, a lighter robot, or more standing feet",
        ),
    )
    hard: list[_Limits] = []
    for limit, soft, sizes, subjects, one, many, sentence, hint in limits:
        excess = _least_excess(load, hard, soft, scale)
        hard.append(soft)
        if excess is None or not (bad := excess > NOTHING * scale).any():
            continue
        who = [subject for subject, is_bad in zip(subjects, bad, strict=True) if is_bad]
        numbers = {
            "excess": excess[bad],
            "limit": np.unique(sizes[bad]),
            "need": (sizes + excess)[bad],
        }
        words = sentence.format(
            **{key: _listed([f"{value:.3g}" for value in some]) for key, some in numbers.items()}
        )
        what = f"{one if len(who) == 1 else many} {_listed(who)} {words}"
        return _Reason(limit, who, excess[bad], f"with {_listed(names)} standing, {what}.", hint)
    return _Reason(
        "friction",
        names,
        np.zeros(0),
        f"the feet {_listed(names)} can give the load only at the very edge of their limits.",
        "a little more friction, or a slightly different stance",
    )


class _Limits(NamedTuple):
    """Limits A F <= upper on the forces of all feet in contact axes, in units of the load.

    Attributes:
        A: Shape (m, 3 k).
        upper: Shape (m,).
        per: Number of rows of one foot or joint, which share one excess.
    """

    A: np.ndarray
    upper: np.ndarray
    per: int


def _pushes(load: Load, least: float) -> _Limits:
    A = -np.kron(np.eye(load.share.shape[1]), [[1.0, 0.0, 0.0]])
    return _Limits(A, -least * load.share[0], 1)


def _cones(load: Load) -> _Limits:
    k = load.share.shape[1]
    angle = 2 * np.pi * np.arange(FACES) / FACES
    A = np.zeros((k, FACES, k, 3))
    for i, friction in enumerate(load.friction[0]):
        A[i, :, i, 0] = -friction
        A[i, :, i, 1], A[i, :, i, 2] = np.cos(angle), np.sin(angle)
    return _Limits(A.reshape(-1, 3 * k), np.zeros(FACES * k), FACES)


def _torques(load: Load, scale: float) -> _Limits:
    k = load.share.shape[1]
    change = -np.swapaxes(load.jacobian[0], -1, -2) @ load.axes[0]
    A = np.zeros((k, 3, 2, k, 3))
    for i in range(k):
        A[i, :, 0, i], A[i, :, 1, i] = change[i], -change[i]
    limit, torque = np.minimum(load.limit[0], 1e30), load.torque[0]
    upper = np.stack([limit - torque, limit + torque], axis=-1) / scale
    return _Limits(A.reshape(-1, 3 * k), upper.ravel(), 2)


def _least_excess(
    load: Load, hard: list[_Limits], soft: _Limits, scale: float
) -> np.ndarray | None:
    """Return the excesses of least sum over soft limits, per foot or joint [N, N·m].

    None where the hard limits cannot be kept.
    """
    k = load.share.shape[1]
    A = np.einsum("eki,kij->ekj", load.grasp[0].reshape(6, k, 3), load.axes[0]).reshape(6, -1)
    U, sizes, Vh = np.linalg.svd(A, full_matrices=False)
    independent = sizes > DEPENDENT * sizes[0]
    equations = sizes[independent, None] * Vh[independent]
    wrench = (U.T @ load.wrench[0])[independent] / scale
    n, m = 3 * k, len(soft.upper) // soft.per
    give = -np.kron(np.eye(m), np.ones((soft.per, 1)))
    rows = [np.hstack([A, np.zeros((len(A), m))]) for A in (equations, *(h.A for h in hard))]
    rows += [np.hstack([soft.A, give]), np.hstack([np.zeros((m, n)), -np.eye(m)])]
    upper = np.concatenate([wrench, *(h.upper for h in hard), soft.upper, np.zeros(m)])
    equal = np.arange(len(upper)) < len(wrench)
    lower = np.where(equal, upper, -1e30)
    kinds = np.where(equal, EQUALITY, 0).astype(np.int32)
    cost = np.concatenate([np.zeros(n), np.ones(m)])
    x, _, flag, _ = daqp.solve(
        SMALL * np.eye(n + m), cost, np.concatenate(rows), upper, lower, kinds
    )
    return np.asarray(x[n:] * scale) if flag > 0 else None


def _listed(words: list[str]) -> str:
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last
