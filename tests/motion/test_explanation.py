"""Explanations of postures and walks, against the plan and the controller."""

import math

import numpy as np
import pytest

from phasmid import load_scenario, plan
from phasmid.control import LocomotionEngine
from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.motion import explain_posture, explain_walk, longest_stride
from phasmid.robot import load_robot

ROBOT = load_robot("phantomx-paper")
PAPER = load_scenario("paper")


def test_a_raised_body_goes_as_high_as_its_legs_are_long():
    # The feet stay 150 - 52 mm outwards of the femur axis, 100 mm below it, and the straightest
    # leg, with its tibia at -23°, is this long by the law of cosines.
    longest = math.sqrt(82**2 + 140**2 + 2 * 82 * 140 * math.cos(math.radians(23)))
    highest = math.sqrt(longest**2 - 98**2) - 100
    found = explain_posture(ROBOT, np.array([0, 0, 0.2, 0, 0, 0]))
    assert not found.is_possible
    # 20 bisections of a step of 1/200.
    assert found.share == pytest.approx(highest / 200, abs=1e-8)
    assert len(found.obstacles) == 6
    assert math.isnan(found.support_margin)
    assert "too far" in found.sentence


def test_a_lowered_trunk_meets_the_ground():
    # The body's origin is 100 mm over the feet, the trunk 50 mm high.
    found = explain_posture(ROBOT, np.array([0, 0, -0.09, 0, 0, 0]))
    assert "the trunk would be 15.0 mm in the ground" in found.sentence
    assert found.share == pytest.approx(75 / 90, abs=1e-8)


def test_a_quadruped_that_leans_too_far_is_not_stable():
    robot = load_robot("quadruped")
    found = explain_posture(robot, np.array([0, 0.12, 0, 0, 0, 0]))
    assert not found.is_possible
    at_share = explain_posture(robot, found.share * found.pose)
    beyond = explain_posture(robot, (found.share + 1e-6) * found.pose)
    assert at_share.is_possible
    assert not beyond.is_possible


def test_a_possible_posture_has_its_tightest_leg():
    found = explain_posture(ROBOT, np.radians([0, 0, 0, 0, 0, 40.0]))
    assert found.is_possible
    assert found.share == 1.0
    rooms = [foot.margin[1] for foot in found.feet]
    assert found.tightest.margin[1] == pytest.approx(min(rooms))
    assert f"{found.tightest.leg.name}." in found.sentence


@pytest.mark.usefixtures("compiled_engine")
def test_the_controller_takes_less_than_what_is_possible_and_says_why():
    pose = np.array([0.0, 0.0, 0.05, 0.0, math.radians(20), 0.0])
    found = explain_posture(ROBOT, pose)
    share, reason = LocomotionEngine(ROBOT).largest_pose_share(pose)
    assert 0.0 < share < found.share
    assert reason.startswith(
        f"{found.obstacles[0].leg.name}: {found.obstacles[0].violations[0].reason}"
    )
    assert LocomotionEngine(ROBOT).largest_pose_share(pose / 10)[0] == 1.0


def test_a_long_stride_names_each_leg_and_the_longest_stride():
    found = explain_walk(PAPER.replace(step_length_mm=400))
    with pytest.raises(InfeasibleWalk) as refused:
        plan(PAPER.replace(step_length_mm=400))
    assert found.sentence == refused.value.what
    assert not found.is_possible
    assert {foot.leg.name for foot in found.feet} == {leg.name for leg in ROBOT.legs}
    # The distance from the coxa axis in the message.
    worst = found.feet[0]
    assert math.hypot(*worst.wanted[:2]) == pytest.approx(0.324, abs=5e-4)
    # Bisections give the share of 400 mm within a millionth.
    assert found.stride.step_length == pytest.approx(
        longest_stride(ROBOT, PAPER.load_gait()), abs=1e-5
    )
    plan(PAPER.replace(stride=found.stride))
    with pytest.raises(InfeasibleWalk):
        plan(PAPER.replace(stride=found.stride.scaled(1.0 + 1e-5)))


def test_the_longest_stride_also_counts_the_servos():
    found = explain_walk(PAPER.replace(gait="wave", step_length_mm=400))
    assert found.stride.step_length < 0.9 * longest_stride(ROBOT, PAPER.load_gait())
    assert "rad/s" in found.limit


def test_a_walk_that_fails_at_any_stride_has_no_longest_one():
    found = explain_walk(PAPER.replace(period=0.1))
    assert found.stride is None
    assert found.feet == ()
    assert "would turn at" in found.sentence


def test_a_possible_walk_has_the_joint_nearest_to_a_limit():
    found = explain_walk(PAPER)
    walk = plan(PAPER)
    low, high = np.moveaxis(ROBOT.arrays.joint_limits, -1, 0)
    room = np.minimum(walk.q - low, high - walk.q).min()
    assert found.feet[0].margin[1] == pytest.approx(room, abs=1e-9)
    assert f"{math.degrees(room):.1f}° from its limit of" in found.sentence


@pytest.mark.parametrize("pose", [(0, 0, 0), (0, 0, math.inf, 0, 0, 0)])
def test_a_pose_is_six_finite_numbers(pose):
    with pytest.raises(InvalidInput, match="pose is"):
        explain_posture(ROBOT, pose)
