"""Explanation of infeasible loads: the feet, the limit, and the excess."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.errors import InfeasibleLoad
from phasmid.forces.equilibrium import grasp_matrix
from phasmid.forces.models import MinimumTorque, Unlimited, WeightedMinimumNorm
from phasmid.forces.problem import Problem
from phasmid.forces.relaxation import StandingFeet
from phasmid.robot import JOINTS

NOTHING = 1e-6
"""Excess that counts as zero, relative to the load."""

LINE = 1e-12
"""Relative distance from a line below which feet stand on it."""

MOST_FRICTION = 1e3
"""Largest ratio of required to present friction in a hint."""


def explain(
    problem: Problem,
    sample: int,
    missing: Float[np.ndarray, "6"],
    least: float,
    cost: Unlimited,
    batch: tuple[int, ...],
    time: Float[np.ndarray, "*batch"] | None,
) -> InfeasibleLoad:
    """Return the error of an infeasible sample.

    Limits are added one after another: pull, friction, torque. The first that cannot be kept is
    named, with the excesses of least sum.

    Args:
        problem: The load.
        sample: Index of the sample.
        missing: Part of the wrench that the feet cannot give, shape (6,).
        least: Least normal force of a foot with full share [N].
        cost: The cost.
        batch: Leading axes of the caller's arrays.
        time: Times of the samples [s].
    """
    if missing.any():
        error = _too_few(problem, sample) or _ill_conditioned(problem, sample, missing, cost)
    else:
        error = _passed(problem, sample, least)
    index = tuple(int(i) for i in np.unravel_index(sample, batch)) if batch else ()
    words = [f"sample {', '.join(map(str, index))}"] if index else []
    if time is not None:
        words.append(f"at {float(time[index]):.4g} s")
    return InfeasibleLoad(
        f"{' '.join(words)}: {error.what}" if words else error.what,
        limit=error.limit,
        culprits=error.culprits,
        excess=error.excess,
        index=index,
        hint=error.hint,
    )


def _too_few(problem: Problem, sample: int) -> InfeasibleLoad | None:
    """Return the error of fewer than three feet or feet on a line; None for others.

    Any foot can give the force; the missing part of the moment is reported.
    """
    carrying = problem.carrying[sample]
    names = tuple(name for name, stands in zip(problem.names, carrying, strict=True) if stands)
    feet, force, moment = (
        problem.feet[sample][carrying],
        problem.wrench[sample, :3],
        problem.wrench[sample, 3:],
    )
    if len(names):
        # Forces that sum to zero give the moments Σ (p - centre) × F.
        centre = feet.mean(axis=0)
        spread = np.linalg.svd(feet - centre)[1]
        if len(names) > 2 and spread[1] > LINE * spread[0]:
            return None
        arms = grasp_matrix(feet - centre)[3:]
        moment = moment - np.cross(centre, force)
        moment = moment - arms @ (np.linalg.pinv(arms, rcond=LINE) @ moment)
        force = np.zeros(3)
    if not names:
        who = "no foot stands to give the load"
    elif len(names) < 3:
        who = f"{_subject('foot', 'feet', names)} alone cannot give the load"
    else:
        who = f"the feet {_listed(names)} stand on one line and cannot give the load"
    lacks, excess = _lacks(force, moment)
    return InfeasibleLoad(
        f"{who}; {lacks} of it would be missing.",
        limit="feet",
        culprits=names,
        excess=excess,
        hint="three standing feet or more, not on one line",
    )


def _ill_conditioned(
    problem: Problem, sample: int, missing: np.ndarray, cost: Unlimited
) -> InfeasibleLoad:
    """Return the error of feet whose equations are singular to round-off."""
    carrying = problem.carrying[sample]
    names = tuple(name for name, stands in zip(problem.names, carrying, strict=True) if stands)
    hint = "feet further from one line, or shares nearer to 1"
    if isinstance(cost, MinimumTorque):
        hint = f"a lever longer than {cost.lever:g} m, {hint}"
    if isinstance(cost, WeightedMinimumNorm):
        hint = f"a tangential_weight nearer to 1 than {cost.tangential_weight:g}, {hint}"
    lacks, excess = _lacks(missing[:3], missing[3:])
    return InfeasibleLoad(
        f"the equations of {_subject('foot', 'feet', names)} are ill-conditioned; their forces "
        f"would miss the load by {lacks}.",
        limit="feet",
        culprits=names,
        excess=excess,
        hint=hint,
    )


def _lacks(force: np.ndarray, moment: np.ndarray) -> tuple[str, tuple[float, float]]:
    """Return missing force and moment in words and as numbers [N, N·m]."""
    sizes = float(np.linalg.norm(force)), float(np.linalg.norm(moment))
    units = zip(sizes, ("N", "N·m"), strict=True)
    return (
        " and ".join(f"{size:.3g} {unit}" for size, unit in units if size > NOTHING * max(sizes)),
        sizes,
    )


def _passed(problem: Problem, sample: int, least: float) -> InfeasibleLoad:
    """Return the error of the first limit that cannot be kept."""
    feet = StandingFeet(problem, sample)
    enough = NOTHING * feet.scale
    pushes, cones = feet.pushes(least), feet.cones()
    excess = feet.least_excess([], pushes)
    if excess is not None and excess.max() > enough:
        return _pull(feet, excess, least, enough)
    excess = feet.least_excess([pushes], cones)
    if excess is not None and excess.max() > enough:
        return _slip(feet, excess, least, enough)
    if problem.limited:
        excess = feet.least_excess([pushes, cones], feet.torques())
        if excess is not None and excess.max() > enough:
            return _overload(feet, excess, enough)
    return InfeasibleLoad(
        f"the feet {_listed(feet.names)} can give the load only at the very edge of their limits.",
        limit="friction",
        culprits=tuple(feet.names),
        hint="a little more friction, or a slightly different stance",
    )


def _pull(feet: StandingFeet, excess: np.ndarray, least: float, enough: float) -> InfeasibleLoad:
    bad = np.flatnonzero(excess > enough)
    names = tuple(feet.names[i] for i in bad)
    what = f"would have to pull with {_numbers(excess[bad])} N, and the ground only pushes"
    if least > 0:
        what = f"would carry {_numbers(excess[bad])} N less than their least normal force"
    return InfeasibleLoad(
        f"with {_listed(feet.names)} standing, {_subject('foot', 'feet', names)} {what}.",
        limit="pull",
        culprits=names,
        excess=tuple(excess[bad].tolist()),
        hint="the centre of mass further inside the standing feet, or more of them",
    )


def _slip(feet: StandingFeet, excess: np.ndarray, least: float, enough: float) -> InfeasibleLoad:
    bad = np.flatnonzero(excess > enough)
    names = tuple(feet.names[i] for i in bad)
    frictions = sorted({f"{friction:.3g}" for friction in feet.friction[bad]})
    factor = _needed_friction(feet, least, enough)
    hint = "a flatter ground, or a slower motion"
    if factor is not None and np.ptp(feet.friction) == 0:
        hint = f"friction of {factor * feet.friction[0]:.3g} or more at this sample, {hint}"
    elif factor is not None:
        hint = f"friction of {factor:.3g} times as much or more at this sample, {hint}"
    return InfeasibleLoad(
        f"with {_listed(feet.names)} standing, {_subject('foot', 'feet', names)} would slip; "
        f"friction of {_listed(frictions)} falls short by {_numbers(excess[bad])} N.",
        limit="friction",
        culprits=names,
        excess=tuple(excess[bad].tolist()),
        hint=hint,
    )


def _needed_friction(feet: StandingFeet, least: float, enough: float) -> float | None:
    """Return the sufficient ratio of friction, rounded up; None where no friction is enough."""

    def holds(factor: float) -> bool:
        excess = feet.least_excess([feet.pushes(least)], feet.cones(factor))
        return excess is not None and bool(excess.max() <= enough)

    low, high = 1.0, 2.0
    while not holds(high):
        low, high = high, 2 * high
        if high > MOST_FRICTION:
            return None
    for _ in range(20):
        middle = (low + high) / 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    # The edges of the pyramid are outside the cone, and the number is rounded.
    return 1.01 * high


def _overload(feet: StandingFeet, excess: np.ndarray, enough: float) -> InfeasibleLoad:
    bad = np.flatnonzero(excess > enough)
    names = tuple(f"{feet.names[i // len(JOINTS)]}.{JOINTS[i % len(JOINTS)]}" for i in bad)
    limit = feet.torque_limit.ravel()[bad]
    limits = sorted({f"{one:.3g}" for one in limit})
    return InfeasibleLoad(
        f"with {_listed(feet.names)} standing, {_subject('joint', 'joints', names)} would need "
        f"{_numbers(limit + excess[bad])} N·m; the limit is {_listed(limits)} N·m.",
        limit="torque",
        culprits=names,
        excess=tuple(excess[bad].tolist()),
        hint="stronger servos, a lighter robot, or more standing feet",
    )


def _subject(one: str, many: str, names: tuple[str, ...]) -> str:
    return f"{one if len(names) == 1 else many} {_listed(names)}"


def _numbers(values: np.ndarray) -> str:
    return _listed([f"{value:.3g}" for value in values])


def _listed(words: list[str] | tuple[str, ...]) -> str:
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else str(last)
