"""Reach of the legs, and foothold regions inside it."""

import math

import numpy as np
import pytest

from phasmid.control.engine import LocomotionEngine
from phasmid.control.reach import DIRECTIONS, NEAR, bound_region, joints_at, region_edge
from phasmid.control.records import record_behind
from phasmid.kinematics import foot_position, hip_from_body, quaternion_rotation, rpy_quaternion
from phasmid.robot import load_robot
from support.general_robot import general_robot

ROBOTS = [load_robot("phantomx-ax"), load_robot("quadruped"), general_robot()]

POSES = [
    np.zeros(6),
    np.array([0.01, -0.015, 0.01, 0.05, -0.04, 0.06]),
    np.array([-0.02, 0.01, -0.02, -0.08, 0.07, -0.1]),
]

ROUND_OFF = 1e-10
"""Of margins, which are angles over 0.02 rad, or less where joints hardly turn. Angles have a
round-off of 1e-15 times the leg's conditioning, which is below 1e3 at the margin of stretch."""


def model_of(robot):
    return LocomotionEngine(robot, ground_sensing=False, dynamics="none").model


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda r: r.name)
def test_the_margin_of_a_foot_is_the_least_of_stretch_and_joint_limits(robot):
    """Shares of 0.02 of the leg's length, and of 0.02 rad or an eighth of a joint's range."""
    model, rng = model_of(robot), np.random.default_rng(1)
    model.limits[0, 0] = -0.05, 0.03
    width = np.minimum(0.02, (model.limits[..., 1] - model.limits[..., 0]) / 8)
    femur, tibia = model.lengths[:, 1], model.lengths[:, 2]
    for _ in range(200):
        q = rng.uniform([-0.9, -1.2, -2.2], [0.9, 1.2, -0.05], (len(femur), 3))
        feet = foot_position(robot.arrays, q)
        length = np.sqrt(femur**2 + tibia**2 + 2 * femur * tibia * np.cos(q[:, 2]))
        stretch = (1 - length / (femur + tibia)) / 0.02
        limits = np.minimum(q - model.limits[..., 0], model.limits[..., 1] - q) / width
        for leg, foot in enumerate(feet):
            *angles, margin = joints_at(record_behind(model), leg, *foot)
            out = model.lengths[leg, 0] + femur[leg] * np.cos(q[leg, 1])
            # The inverse returns legs outwards.
            if out + tibia[leg] * np.cos(q[leg, 1] + q[leg, 2]) > 0.01:
                np.testing.assert_allclose(angles, q[leg], atol=1e-9)
                assert margin == pytest.approx(min(stretch[leg], *limits[leg]), abs=1e-7)
        # Out of reach, beyond the full length.
        assert (
            joints_at(record_behind(model), 0, *(feet[0] * 1.01 * model.lengths.sum() / 0.01))[3]
            == -math.inf
        )


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda r: r.name)
def test_the_edge_along_a_ray_is_the_first_place_that_is_too_far(robot):
    """Equals the first unreachable millimetre of the ray, or the leg's full length.

    Rays that leave the reach and enter it again are few, and left out: a step of the search may
    pass over such a spot.
    """
    model, rng, found = model_of(robot), np.random.default_rng(1), 0
    for leg, start in enumerate(hip_from_body(robot, model.neutral)):
        far = model.lengths[leg, 1:3].sum()
        for _ in range(6):
            way = rng.normal(size=3) * [1.0, 1.0, 0.1]
            way /= np.linalg.norm(way)

            def margin(r, leg=leg, start=start, way=way):
                return joints_at(record_behind(model), leg, *(start + r * way))[3]

            edge = region_edge(record_behind(model), leg, start, way)
            at = np.arange(0.0, far, 1e-3)
            too_far = np.array([margin(r) < 1 for r in at])
            if np.abs(np.diff(too_far)).sum() > 1:
                continue
            found += 1
            first = at[np.argmax(too_far)] if too_far.any() else far
            assert edge == pytest.approx(first, abs=1e-3 + NEAR)
            assert edge == 0.0 or margin(edge) >= 1 - ROUND_OFF
            assert margin(edge + 1.01 * NEAR) < 1 or edge == pytest.approx(far)
    assert found > 4 * len(robot.legs)


@pytest.mark.parametrize("pose", POSES, ids=["neutral", "leaning", "the other way"])
@pytest.mark.parametrize("robot", ROBOTS[:2], ids=lambda r: r.name)
def test_a_foot_reaches_all_of_its_region(robot, pose):
    """The region is inscribed in a polygon of reachable points; between these the reach may bulge.

    Close to the edge a foot still keeps the planned margins.
    """
    model, region = model_of(robot), np.zeros((DIRECTIONS, 3))
    R = quaternion_rotation(rpy_quaternion(*(np.array(angle) for angle in pose[3:])))
    for leg in range(len(robot.legs)):
        bound_region(record_behind(model), leg, pose, np.zeros(3), region)
        assert (region[:, 2] >= 0).all()
        np.testing.assert_allclose(np.hypot(region[:, 0], region[:, 1]), 1.0, atol=1e-12)
        for k in range(DIRECTIONS):
            angle = 2 * math.pi * (k + 0.3) / DIRECTIONS
            way = np.array([math.cos(angle), math.sin(angle)])
            along = region[:, :2] @ way
            reach = np.min(region[along > 1e-9, 2] / along[along > 1e-9])
            foot = np.append(model.neutral[leg, :2] + 0.95 * reach * way, -model.height)
            body = np.tile(R.T @ (foot - pose[:3]), (len(robot.legs), 1))
            p_hip = hip_from_body(robot, body)[leg]
            assert reach < 1e-6 or joints_at(record_behind(model), leg, *p_hip)[3] > 0.9
