"""What the time step costs."""

import numpy as np
import pytest

from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate, time_step_refinement

PAPER = load_scenario("paper").replace(duration=1.0)


def test_the_difference_is_that_of_two_runs():
    # By hand: rms difference over rms of the run at half the step, at common instants.
    found = time_step_refinement(PAPER, plan(PAPER))
    coarse = simulate(PAPER, plan(PAPER))
    halved = PAPER.replace(dt=0.0005, record_interval=0.0005)
    fine = simulate(halved, plan(halved)).isel(time=slice(None, None, 2))
    assert fine.time.values == pytest.approx(coarse.time.values, abs=1e-12)
    for name, value in (
        ("foot_normal_force", found.normal_force),
        ("joint_torque", found.joint_torque),
    ):
        square = ((coarse[name].values - fine[name].values) ** 2).sum()
        assert value == pytest.approx(np.sqrt(square / (fine[name].values ** 2).sum()), rel=1e-12)
    apart = coarse.body_position.values - fine.body_position.values
    assert found.way == pytest.approx(np.sqrt((apart**2).sum(axis=1)).max(), rel=1e-12)
    assert (found.time_step, found.duration) == (0.001, 1.0)
