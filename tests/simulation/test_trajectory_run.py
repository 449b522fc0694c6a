"""A trajectory of joint angles is simulated, kept, replayed and told honestly."""

import numpy as np
import pytest

from phasmid import (
    JointTrajectory,
    load_recording,
    load_robot,
    load_scenario,
    plan,
    replay,
    save_recording,
    simulate,
)
from phasmid.errors import InvalidInput

PAPER = load_scenario("paper").replace(duration=2.0)
WALK = plan(PAPER)


@pytest.fixture(scope="module")
def trajectory():
    """The plan's own angles, every 5 ms."""
    time = np.arange(401) * 5e-3
    return JointTrajectory(WALK.robot, time, WALK.sample(time).q)


def test_the_plans_own_angles_walk_as_the_plan_does(trajectory):
    # The spline misses the plan by 5/384 q'''' h^4 inside; the plan's fourth derivative jumps at
    # the switches, by some 1e4 rad/s^4, so by about 1e-7 rad, and 0.2 um of leg: the two runs
    # differ by less than their contact's own sinkage of 65 um.
    told = simulate(PAPER, trajectory)
    walked = simulate(PAPER, WALK)
    assert told.attrs["ending"] == "COMPLETED"
    assert np.array_equal(told.time, walked.time)
    apart = np.abs(told.body_position.values - walked.body_position.values).max()
    assert apart < 65e-6
    assert abs(float(told.foot_normal_force.sum("leg").mean()) - 26.0) < 0.002 * 26


@pytest.mark.parametrize("changes", [{}, {"drive": "servo"}, {"contact_law": "simscape"}])
def test_its_recording_is_enough_to_run_it_again_to_the_bit(tmp_path, trajectory, changes):
    run = simulate(PAPER.replace(duration=0.3, **changes), trajectory)
    save_recording(run, tmp_path / "run.nc")
    again = replay(load_recording(tmp_path / "run.nc"))
    assert again.equal, str(again)


def test_a_long_trajectory_fits_into_a_recording(tmp_path):
    # 5 000 rows of 19 numbers are 760 kB before they are packed, HDF5 allows attributes of 64 kB.
    rng = np.random.default_rng(0)
    time = np.arange(5_000) * 1e-3
    q = WALK.q[0] + 1e-4 * rng.standard_normal((len(time), 6, 3))
    long = JointTrajectory(WALK.robot, time, q)
    run = simulate(PAPER.replace(duration=0.05), long, log=tmp_path / "run.mcap")
    save_recording(run, tmp_path / "run.nc")
    for name in ("run.nc", "run.mcap"):
        assert replay(tmp_path / name).equal


def test_another_robots_trajectory_is_refused(trajectory):
    with pytest.raises(InvalidInput, match="another robot"):
        simulate(PAPER.replace(robot=load_robot("phantomx-mk4")), trajectory)
