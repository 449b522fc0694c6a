"""Explanation of infeasible loads: the feet, the limit, and the excess."""

from __future__ import annotations

from typing import NamedTuple

import daqp
import numpy as np
from jaxtyping import Float

from phasmid.errors import InfeasibleLoad
from phasmid.forces.cones import UNBOUNDED, Rows, directions, pyramid
from phasmid.forces.load import Load, grasp_matrix, push_limits, torque_limits
from phasmid.robot import JOINTS

NOTHING = 1e-6
"""Excess that counts as zero, relative to the load."""

LINE = 1e-12
"""Relative distance from a line below which feet stand on it."""

FACES = directions(64)
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
    # The unknowns are all forces in contact axes, in units of the load.
    none = np.zeros((1, len(names), 3))
    U = np.eye(none.size).reshape(*none.shape, -1)
    # Limit, its rows and sizes, subjects, noun, sentence, hint.
    limits = (
        (
            *("pull", push_limits(load, none, U, least, scale), np.zeros(len(names)), names),
            *(("foot", "feet"), pull),
            "the centre of mass further inside the standing feet, or more of them",
        ),
        (
            *("friction", pyramid(none, U, load.friction, FACES), load.friction[0], names),
            *(("foot", "feet"), "would slip; friction of {limit} falls short by {excess} N"),
            "more friction, a flatter ground, or a slower motion",
        ),
        (
            *("torque", torque_limits(load, none, load.axes @ U, scale), load.limit[0].ravel()),
            *(joints, ("joint", "joints"), "would need {need} N·m; the limit is {limit} N·m"),
            "stronger servos, a lighter robot, or more standing feet",
        ),
    )
    hard: list[Rows] = []
    for limit, soft, sizes, subjects, nouns, sentence, hint in limits:
        excess = _least_excess(load, hard, soft, len(subjects), scale)
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
        what = f"{nouns[len(who) > 1]} {_listed(who)} {words}"
        return _Reason(limit, who, excess[bad], f"with {_listed(names)} standing, {what}.", hint)
    return _Reason(
        "friction",
        names,
        np.zeros(0),
        f"the feet {_listed(names)} can give the load only at the very edge of their limits.",
        "a little more friction, or a slightly different stance",
    )


def _least_excess(
    load: Load, hard: list[Rows], soft: Rows, count: int, scale: float
) -> np.ndarray | None:
    """Return the excesses of least sum over soft limits, per foot or joint [N, N·m].

    None where the hard limits cannot be kept. Consecutive rows of a foot share one excess.
    """
    k = load.share.shape[1]
    A = np.einsum("eki,kij->ekj", load.grasp[0].reshape(6, k, 3), load.axes[0]).reshape(6, -1)
    U, sizes, Vh = np.linalg.svd(A, full_matrices=False)
    independent = sizes > DEPENDENT * sizes[0]
    wrench = (U.T @ load.wrench[0])[independent] / scale
    limits = [(sizes[independent, None] * Vh[independent], wrench, wrench)]
    limits += [(rows.A[0], rows.lower[0], rows.upper[0]) for rows in (*hard, soft)]
    A, lower, upper = (np.concatenate(parts) for parts in zip(*limits, strict=True))
    n, m = 3 * k, len(soft.upper[0])
    give = np.zeros((len(A), count))
    give[-m:] = np.repeat(np.eye(count), m // count, axis=0)
    # A x - excess <= upper, A x + excess >= lower, excess >= 0.
    none = np.full(m, UNBOUNDED)
    below = np.concatenate([lower[:-m], -none, lower[-m:], np.zeros(count)])
    above = np.concatenate([upper, none, np.full(count, UNBOUNDED)])
    rows = np.concatenate(
        [
            np.hstack([A, -give]),
            np.hstack([soft.A[0], give[-m:]]),
            np.hstack([np.zeros((count, n)), np.eye(count)]),
        ]
    )
    kinds = np.where(np.arange(len(rows)) < len(wrench), EQUALITY, 0).astype(np.int32)
    cost = np.concatenate([np.zeros(n), np.ones(count)])
    x, _, flag, _ = daqp.solve(SMALL * np.eye(n + count), cost, rows, above, below, kinds)
    return np.asarray(x[n:] * scale) if flag > 0 else None


def _listed(words: list[str]) -> str:
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last
