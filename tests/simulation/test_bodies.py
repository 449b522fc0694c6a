"""Robots with tilted hips and with legs of different lengths, in both simulators."""

import math

import numpy as np
import pytest

from phasmid.forces import analyse
from phasmid.kinematics import quaternion_yaw
from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate
from phasmid.verification.equations import agreement
from phasmid.verification.laboratory import Laboratory
from walks import tilted_robot, uneven_robot

PAPER = load_scenario("paper")
ROBOTS = {"tilted": tilted_robot(), "uneven": uneven_robot()}
STRIDES = {
    "forward": {"step_length_mm": 40},
    "backward": {"step_length_mm": -40},
    "sideways": {"step_length": 0, "step_sideways_mm": 40},
    "turning": {"step_length": 0, "step_turn_deg": 12},
}
WAYS = [("tripod", stride) for stride in STRIDES] + [("wave", "forward"), ("wave", "turning")]


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize(("gait", "stride"), WAYS)
def test_odd_robots_walk_as_far_as_they_were_told(robot, gait, stride):
    # Two cycles; within 5 % of the commanded displacement, and straight to 5 % of it.
    scenario = PAPER.replace(robot=ROBOTS[robot], gait=gait, duration=4.0, **STRIDES[stride])
    walk = plan(scenario)
    run = simulate(scenario, walk)
    assert run.attrs["ending"] == "COMPLETED"
    start, end = run.body_position.values[0], run.body_position.values[-1]
    asked, turn = walk.trunk.position[-1], float(walk.trunk.yaw[-1])
    assert np.hypot(*(end - start - asked)[:2]) <= 0.05 * max(math.hypot(*asked[:2]), 0.04)
    turned = float(np.unwrap(quaternion_yaw(run.body_orientation.values))[-1])
    assert abs(turned - turn) <= 0.05 * max(abs(turn), math.radians(4))


@pytest.mark.parametrize("robot", ROBOTS)
def test_closed_form_recursion_and_the_simulated_model_give_odd_robots_one_torque(robot):
    # Row 10 of `phasmid verify`, on other robots: within 1e-10 N·m and N.
    for reading in agreement(Laboratory(PAPER.replace(robot=ROBOTS[robot]))):
        assert reading.got < 1e-10


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_ground_carries_what_the_model_of_an_odd_robot_says(robot):
    # Over a cycle nothing rises or falls, so that the mean of all vertical forces is the weight:
    # the model's by 40 samples of a smooth motion, the simulated one's but for its settling.
    scenario = PAPER.replace(robot=ROBOTS[robot], gait="wave", duration=2.0)
    walk = plan(scenario)
    model, run = analyse(scenario, walk), simulate(scenario, walk)
    weight = walk.robot.mass * scenario.model.gravity
    total = model.foot_force_model.values[:-1, :, 2].sum(axis=1)
    assert total.mean() == pytest.approx(weight, rel=1e-3)
    assert run.foot_normal_force.values.sum(axis=1).mean() == pytest.approx(weight, rel=1e-3)


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


def test_left_and_right_of_a_tilted_robot_are_mirror_images():
    # As for the paper's robot in test_gaits: legs' numbers reversed and the turn the other way.
    offsets = (0.0, 0.5, 0.0, 0.5, 0.0, 0.5)
    runs = []
    for order, turn in ((1, 12), (-1, -12)):
        gait = {"name": "g", "duty_factor": 0.5, "offsets": offsets[::order]}
        scenario = PAPER.replace(
            robot=ROBOTS["tilted"], gait=gait, duration=2.0, step_length=0.02, step_turn_deg=turn
        )
        runs.append(simulate(scenario, plan(scenario)))
    mirrored = runs[1].body_position.values * [1, -1, 1]
    assert np.abs(runs[0].body_position.values - mirrored).max() < 1e-6
    loads = [run.foot_normal_force.values.mean(axis=0) for run in runs]
    np.testing.assert_allclose(loads[0], loads[1][::-1], rtol=0, atol=1e-3)


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
