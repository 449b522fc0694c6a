"""Explanations of foot positions, against the whole joint space and geometry done by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from phasmid.errors import InvalidInput
from phasmid.kinematics import explain_foot, foot_position, within_reach
from phasmid.robot import load_robot
from support.general_robot import general_robot

LEG = load_robot("phantomx-paper").legs[0]
"""Links of 52, 82 and 140 mm; limits of ±75°, ±100° and -180° to -23°."""

COUNT = 61
"""Angles of each joint in the sampled joint space."""


def joint_space(leg):
    """Foot positions over the usable joint space, knee down and outwards, and their spacing."""
    low, high = leg.joint_limits.T
    low, high = np.maximum(low, -np.pi), np.minimum(high, [np.pi, np.pi, 0.0])
    axes = [np.linspace(*ends, COUNT) for ends in zip(low, high, strict=True)]
    q = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    out = foot_position(leg, q * [0.0, 1.0, 1.0])[:, 0]
    # Half a step of a joint moves the foot by at most its distance from the axis.
    coxa, femur, tibia = leg.lengths
    offset = abs(leg.lateral_offsets.sum())
    levers = np.array([coxa + femur + tibia + offset, femur + tibia, tibia])
    return foot_position(leg, q[out >= 0]), float(levers @ (high - low)) / (COUNT - 1) / 2


@pytest.mark.parametrize(
    "robot",
    [*map(load_robot, ("phantomx-paper", "phantomx-mk4", "quadruped")), general_robot()],
    ids=lambda robot: robot.name,
)
def test_no_position_of_the_joint_space_is_nearer_than_the_nearest(robot):
    rng = np.random.default_rng(3)
    leg = robot.legs[0]
    feet, spacing = joint_space(leg)
    tree, size = cKDTree(feet), 1.2 * leg.lengths.sum()
    impossible = 0
    for wanted in rng.uniform(-size, size, (60, 3)):
        found = explain_foot(leg, wanted)
        every = np.tile(wanted, (len(robot.legs), 1))
        assert found.is_possible == bool(within_reach(robot, every)[0])
        if found.is_possible:
            np.testing.assert_array_equal(found.nearest, wanted)
            continue
        impossible += 1
        sampled, _ = tree.query(wanted)
        # The search stays a millionth of the leg off the coxa axis, which its corners magnify.
        assert found.distance <= sampled + 5e-5
        # Beside the coxa axis the samples end up to a step before the edge of the space.
        assert found.distance >= sampled - 2 * spacing
        # The nearest position is possible itself, up to the round-off of angles at full stretch.
        assert all(
            violation.excess < 1e-6 for violation in explain_foot(leg, found.nearest).violations
        )
        np.testing.assert_allclose(foot_position(leg, found.nearest_q), found.nearest, atol=1e-12)
    assert impossible > 30


def test_too_far_ahead_is_nearest_at_the_straightest_permitted_leg():
    # Ahead of the leg the nearest foot is on the circle about the femur axis on which the tibia
    # stands at its limit of -23°; its radius follows from the law of cosines.
    radius = math.sqrt(82**2 + 140**2 + 2 * 82 * 140 * math.cos(math.radians(23))) / 1000
    found = explain_foot(LEG, np.array([0.4, 0.0, 0.0]))
    (violation,) = found.violations
    assert violation.what == "reach"
    assert violation.needed == pytest.approx(0.348)
    assert violation.excess == pytest.approx(0.348 - radius)
    # The squared distance, near 0.02 m², is least within 1e-15 of the leg's squared length.
    np.testing.assert_allclose(found.nearest, [0.052 + radius, 0, 0], atol=1e-7)
    limit = "the limit is 217.9 mm, with the tibia at its limit of -23°"
    assert f"130.1 mm too far: {limit}" in found.sentence
    assert found.binding == ("the tibia at its limit of -23°",)
    assert f"is {1000 * (0.348 - radius):.1f} mm away" in found.sentence


def test_a_foot_too_near_is_measured_against_the_most_bent_knee():
    # Table 2 with the tibia bent by 140° at most: sqrt(82² + 140² + 2·82·140 cos 140°) mm.
    leg = replace(LEG, joint_limits=np.radians([[-75, 75], [-90, 90], [-140, 0]]))
    nearest = math.sqrt(82**2 + 140**2 + 2 * 82 * 140 * math.cos(math.radians(140))) / 1000
    (violation,) = explain_foot(leg, np.array([0.06, 0.0, -0.03])).violations
    assert violation.lowest == pytest.approx(nearest)
    assert violation.excess == pytest.approx(nearest - math.hypot(0.008, 0.03))


def test_a_turned_coxa_is_nearest_at_its_limit():
    # The plane at 75° is the nearest one; the foot's shadow on it is possible.
    turn = math.radians(90)
    wanted = np.array([0.2 * math.cos(turn), 0.2 * math.sin(turn), -0.08])
    found = explain_foot(LEG, wanted)
    (violation,) = found.violations
    assert (violation.what, violation.is_angle) == ("coxa", True)
    assert math.degrees(violation.excess) == pytest.approx(15)
    assert found.distance == pytest.approx(0.2 * math.sin(math.radians(15)), abs=1e-7)
    assert "its coxa would turn to 90.0°, 15.0° beyond 75°" in found.sentence


def test_a_possible_foot_has_the_margin_of_its_joints():
    q = np.radians([10.0, 90.0, -100.0])
    found = explain_foot(LEG, foot_position(LEG, q))
    assert found.is_possible
    joint, room = found.margin
    assert (joint, math.degrees(room)) == ("femur", pytest.approx(10))
    assert found.sentence.endswith("is its femur at 90.0°, 10.0° from its limit of 100°.")


@pytest.mark.parametrize(
    ("limits", "wanted", "binding"),
    [
        # Stretched: 52 + 82 + 140 mm ahead.
        ([[-75, 75], [-100, 100], [-180, 90]], [0.4, 0.0, 0.0], ["the tibia at the stretched leg"]),
        # Folded flat with the femur up: the foot is 140 - 82 mm below the femur's axis.
        ([[-75, 75], [-100, 100], [-400, 0]], [0.052, 0, -0.03], ["the tibia at half a turn"]),
        # The femur turns up only, the coxa to the left only.
        ([[-75, 75], [0, 100], [-180, -23]], [0.2, 0.0, -0.19], ["the femur at its limit of 0°"]),
        ([[0, 75], [-100, 100], [-180, -23]], [0.1, -0.1, -0.1], ["the coxa at its limit of 0°"]),
    ],
)
def test_the_limit_that_binds_is_named(limits, wanted, binding):
    """Also at the straight and the folded leg, and with limits on one side of 0 only."""
    leg = replace(LEG, joint_limits=np.radians(limits))
    found = explain_foot(leg, np.array(wanted))
    assert list(found.binding) == binding
    for words in binding:
        assert words in found.sentence


def test_a_leg_of_an_offset_does_not_reach_within_it():
    coxa = replace(LEG.coxa, lateral_offset=0.04)
    found = explain_foot(replace(LEG, coxa=coxa), np.array([0.01, 0.0, -0.1]))
    assert "10.0 mm from the coxa axis, 30.0 mm too near: the limit is 40.0 mm" in found.sentence


def test_limits_without_any_foot_position_have_no_nearest_one():
    limits = np.array([LEG.joint_limits[0], LEG.joint_limits[1], [0.5, 1.0]])
    found = explain_foot(replace(LEG, joint_limits=limits), LEG.neutral_foot)
    assert not found.is_possible
    assert np.isnan(found.nearest).all()
    assert "cannot place its foot anywhere within its joint limits" in found.sentence


@pytest.mark.parametrize("foot", [[0.1, 0.2], [0.1, math.nan, 0.0], "abc"])
def test_a_foot_is_three_finite_numbers(foot):
    with pytest.raises(InvalidInput, match="foot is"):
        explain_foot(LEG, foot)
