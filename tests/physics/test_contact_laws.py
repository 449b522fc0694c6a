"""The three laws of contact carry a walk by the same normal forces, in two simulators."""

from functools import cache

import numpy as np
import pytest

from phasmid.motion import plan
from phasmid.reporting.steps import middle_halves
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate

LAWS = ("spring-damper", "mujoco", "simscape")


@cache
def walked(law):
    """Recording of two cycles of the paper's walk, and the middle halves of its stances."""
    scenario = load_scenario("paper").replace(duration=4.0, contact_law=law)
    run = simulate(scenario, plan(scenario))
    return run, middle_halves(run["stance"].values)


@pytest.mark.parametrize("law", LAWS)
def test_each_law_carries_weight_and_inertia_by_the_same_normal_forces(law):
    # Three feet of level ground leave statics no choice of the normal forces: sum N = W and two
    # moments. What differs is where on its square of 4 mm a foot stands, some 2 mm out of 250 mm,
    # and the sinkage: below 1 % of a foot's mean load.
    (run, middle), (default, _) = walked(law), walked(LAWS[0])
    assert run.attrs["contact_law"] == law
    normal, usual = (each["foot_normal_force"].values for each in (run, default))
    mean, usual_mean = (
        np.sum(n, axis=0, where=middle) / middle.sum(axis=0) for n in (normal, usual)
    )
    assert np.abs((normal - usual) / usual_mean)[middle].max() < 0.01
    assert mean == pytest.approx(usual_mean, rel=1e-3)
    # Sum N = m (g + z''), which inverse dynamics of the plan gives; legs in swing make z''. The
    # trunk's own rocking is left out: 1e-3 of the weight.
    whole = (middle == run["stance"].values).all(axis=1) & middle.any(axis=1)
    total, needed = (
        run[name].values[whole].sum(axis=1)
        for name in ("foot_normal_force", "foot_normal_force_model")
    )
    assert total == pytest.approx(needed, rel=1e-3)
