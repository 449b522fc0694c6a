"""Explanation of infeasible loads: the feet, the limit, and the excess."""

from __future__ import annotations

import daqp
import numpy as np
from jaxtyping import Float

from phasmid.errors import InfeasibleLoad
from phasmid.forces.cones import Rows, directions, half_spaces
from phasmid.forces.load import Load, grasp_matrix, push_limits
from phasmid.robot import JOINTS

NOTHING = 1e-6
"""Excess that counts as zero, relative to the load."""

LINE = 1e-12
"""Relative distance from a line below which feet stand on it."""

FACES = directions(2 * np.pi * np.arange(64) / 64)
"""Faces of the pyramid around each cone; its edges are 0.12 % outside."""


def explain(
    load: Load,
    names: list[str],
    missing: Float[np.ndarray, "6"],
    index: tuple[int, ...],
    time: float | None,
) -> InfeasibleLoad:
    """Return the error of one infeasible sample.

    Args:
        load: The sample.
        names: Names of its legs.
        missing: Part of the wrench that the feet cannot give [N, N·m].
        index: Of the sample over the caller's leading axes.
        time: Of the sample [s].
    """
    found = _too_few(load, names, missing) if missing.any() else _beyond_limits(load, names)
    limit, sentence, hint = found
    words = [f"sample {', '.join(map(str, index))}"] if index else []
    if time is not None:
        words.append(f"at {time:.4g} s")
    what = f"{' '.join(words)}: {sentence}" if words else sentence
    return InfeasibleLoad(what, limit=limit, index=index, hint=hint)


def _too_few(load: Load, names: list[str], missing: np.ndarray) -> tuple[str, str, str]:
    """Return limit, sentence and hint of too few feet, feet on a line, or feet nearly on one."""
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
    return "feet", f"{who}; {_listed(lacks)} of it would be missing.", hint


def _beyond_limits(load: Load, names: list[str]) -> tuple[str, str, str]:
    """Return limit, sentence and hint of the first limit that cannot be kept.

    A hierarchical programme gives the wrench first, and then keeps the limits of pull, friction and
    torque, each as far as the ones before it allow: with the least sum of squares of the excesses.
    """
    k, scale = len(names), max(float(np.abs(load.wrench[0, :3]).max()), 1e-9)
    # The unknowns are all forces in contact axes, in units of the load.
    none, U = np.zeros((1, k, 3)), np.eye(3 * k).reshape(1, k, 3, -1)
    grasp = grasp_matrix(load.feet) @ (load.axes @ U).reshape(1, 3 * k, -1)
    levels = (
        Rows(grasp, load.wrench / scale, load.wrench / scale),
        push_limits(none, U),
        half_spaces(FACES, none, U, load.friction),
        load.torque_limits(none, load.axes @ U, scale),
    )
    A, lower, upper = (part[0] for part in Rows.join(*levels))
    ends = np.cumsum([rows.upper.size for rows in levels], dtype=np.int32)
    kinds = np.zeros(ends[-1], dtype=np.int32)
    x = daqp.solve(None, None, A, upper, lower, kinds, break_points=ends)[0]
    f = scale * x.reshape(1, k, 3)
    normal, friction = f[0, :, 0], load.friction[0]
    torque = load.torque_with((load.axes @ f[..., None])[..., 0]).ravel()
    limit = load.limit.ravel()
    joints = [f"{name}.{joint}" for name in names for joint in JOINTS]

    slips = (f[0, :, 1:] @ FACES.T).max(axis=1) - friction * normal
    overload = np.abs(torque) - limit
    standing, nothing = f"with {_listed(names)} standing", NOTHING * scale
    if (bad := -normal > nothing).any():
        what = f"would have to pull with {_numbers(-normal[bad])} N, and the ground only pushes"
        hint = "the centre of mass further inside the standing feet, or more of them"
        return "pull", f"{standing}, {_subject('foot', 'feet', names, bad)} {what}.", hint
    if (bad := slips > nothing).any():
        what = f"friction of {_numbers(np.unique(friction[bad]))} falls short by "
        what = f"would slip; {what}{_numbers(slips[bad])} N"
        hint = "more friction, a flatter ground, or a slower motion"
        return "friction", f"{standing}, {_subject('foot', 'feet', names, bad)} {what}.", hint
    if (bad := overload > nothing).any():
        what = f"would need {_numbers(np.abs(torque[bad]))} N·m; "
        what += f"the limit is {_numbers(np.unique(limit[bad]))} N·m"
        hint = "stronger servos, a lighter robot, or more standing feet"
        return "torque", f"{standing}, {_subject('joint', 'joints', joints, bad)} {what}.", hint
    return (
        "friction",
        f"the feet {_listed(names)} can give the load only at the very edge of their limits.",
        "a little more friction, or a slightly different stance",
    )


def _subject(one: str, several: str, names: list[str], which: np.ndarray) -> str:
    chosen = [name for name, is_chosen in zip(names, which, strict=True) if is_chosen]
    return f"{one if len(chosen) == 1 else several} {_listed(chosen)}"


def _numbers(values: np.ndarray) -> str:
    return _listed([f"{value:.3g}" for value in values])


def _listed(words: list[str]) -> str:
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last
