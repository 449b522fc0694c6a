"""Robots with tilted hips and with legs of different lengths, in both simulators."""

import numpy as np
import pytest

from phasmid.kinematics import quaternion_yaw
from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate
from phasmid.verification.equations import agreement
from phasmid.verification.laboratory import Laboratory
from walks import tilted_robot, uneven_robot

PAPER = load_scenario("paper")
ROBOTS = {"tilted": tilted_robot(), "uneven": uneven_robot()}


@pytest.mark.parametrize("robot", ROBOTS)
def test_closed_form_recursion_and_the_simulated_model_give_odd_robots_one_torque(robot):
    # Row 10 of `phasmid verify`, on other robots: within 1e-10 N·m and N.
    for reading in agreement(Laboratory(PAPER.replace(robot=ROBOTS[robot]))):
        assert reading.got < 1e-10


def test_both_simulators_walk_a_tilted_robot_alike():
    # One plan, two simulators and two laws of contact: creep and touchdown differ by less than a
    # millimetre in 80, and mean loads, which equilibrium alone nearly tells, by a fiftieth.
    scenario = PAPER.replace(robot=ROBOTS["tilted"], duration=2.0)
    walk = plan(scenario)
    engine = simulate(scenario, walk)
    ours = simulate(scenario.replace(contact_law="simscape"), walk)
    assert ours.attrs["simulator"] != engine.attrs["simulator"]
    apart = engine.body_position.values[-1] - ours.body_position.values[-1]
    assert np.abs(apart).max() < 1e-3
    loads = [run.foot_normal_force.values.mean(axis=0) for run in (engine, ours)]
    np.testing.assert_allclose(*loads, rtol=0.02)


@pytest.mark.parametrize("turn", [12, -12])
def test_a_crawl_turns_either_way(turn):
    scenario = PAPER.replace(
        robot="quadruped", gait="crawl", duration=4.0, step_length=0, step_turn_deg=turn
    )
    walk = plan(scenario)
    run = simulate(scenario, walk)
    assert run.attrs["ending"] == "COMPLETED"
    turned = float(np.unwrap(quaternion_yaw(run.body_orientation.values))[-1])
    assert turned == pytest.approx(float(walk.trunk.yaw[-1]), rel=0.05)
    assert walk.support_margin.min() > 0.01


def test_a_quadruped_does_not_fall_on_its_own_servos():
    scenario = PAPER.replace(robot="quadruped", gait="crawl", duration=4.0, drive="servo", period=4)
    walk = plan(scenario)
    run = simulate(scenario, walk)
    assert run.attrs["ending"] == "COMPLETED"
    way = run.body_position.values[-1, 0] - run.body_position.values[0, 0]
    assert way > 0.8 * (walk.trunk.position[-1, 0] - walk.trunk.position[0, 0])
