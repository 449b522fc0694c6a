"""Foothold regions: their edge along a ray, and their half-planes."""

import math

import numpy as np
import pytest

from phasmid.control.engine import LocomotionEngine
from phasmid.control.foothold_region import (
    DIRECTIONS,
    NEAR,
    bound_region,
    region_edge,
)
from phasmid.control.reach import joint_limit_margin
from phasmid.control.records import record_behind
from phasmid.kinematics import hip_from_body, quaternion_rotation, rpy_quaternion
from phasmid.robot import load_robot, preset_names

POSES = [
    np.zeros(6),
    np.array([0.01, -0.015, 0.01, 0.05, -0.04, 0.06]),
    np.array([-0.02, 0.01, -0.02, -0.08, 0.07, -0.1]),
]

ROUND_OFF = 1e-10
"""Of a margin; see test_reach."""


def engine_of(name):
    return LocomotionEngine(load_robot(name), ground_sensing=False, dynamics="none")


@pytest.mark.parametrize("name", preset_names())
def test_the_edge_along_a_ray_is_the_first_place_that_is_too_far(name):
    """Equals the first unreachable millimetre of the ray, or the leg's full length.

    Rays that leave the reach and enter it again are few, and left out: a step of the search may
    pass over such a spot.
    """
    engine = engine_of(name)
    model = engine.model
    q, found = np.empty(3), 0
    margins = np.vectorize(
        lambda leg, r: joint_limit_margin(model, leg, starts[leg] + r * way, q),
        otypes=[float],
    )
    starts = hip_from_body(engine.robot, model.neutral)
    rng = np.random.default_rng(1)
    for leg, start in enumerate(starts):
        far = model.lengths[leg, 1:3].sum()
        for _ in range(12):
            way = rng.normal(size=3) * [1.0, 1.0, 0.1]
            way /= np.linalg.norm(way)
            edge = region_edge(model, leg, start, way)
            at = np.arange(0.0, far, 1e-3)
            too_far = margins(leg, at) < 1
            if np.abs(np.diff(too_far)).sum() > 1:
                continue
            found += 1
            first = at[np.argmax(too_far)] if too_far.any() else far
            assert edge == pytest.approx(first, abs=1e-3 + NEAR)
            assert edge == 0.0 or margins(leg, edge) >= 1 - ROUND_OFF
            assert margins(leg, edge + 1.01 * NEAR) < 1 or edge == pytest.approx(far)
    assert found > 8 * len(starts)


@pytest.mark.parametrize("pose", POSES, ids=["neutral", "leaning", "the other way"])
@pytest.mark.parametrize("name", preset_names())
def test_a_foot_reaches_all_of_its_region(name, pose):
    """The region is inscribed in a polygon of reachable points; between these the reach may bulge.

    Close to the edge a foot still keeps the planned margins.
    """
    engine = engine_of(name)
    model = engine.model
    region, q = np.zeros((DIRECTIONS, 3)), np.empty(3)
    R = quaternion_rotation(rpy_quaternion(*(np.array(angle) for angle in pose[3:])))
    for leg in range(len(engine.robot.legs)):
        bound_region(record_behind(engine.model), leg, pose, np.zeros(3), region)
        assert (region[:, 2] >= 0).all()
        np.testing.assert_allclose(np.hypot(region[:, 0], region[:, 1]), 1.0, atol=1e-12)
        for k in range(DIRECTIONS):
            angle = 2 * math.pi * (k + 0.3) / DIRECTIONS
            way = np.array([math.cos(angle), math.sin(angle)])
            along = region[:, :2] @ way
            reach = np.min(region[along > 1e-9, 2] / along[along > 1e-9])
            foot = np.append(model.neutral[leg, :2] + 0.95 * reach * way, -model.height)
            body = np.tile(R.T @ (foot - pose[:3]), (len(engine.robot.legs), 1))
            p_hip = hip_from_body(engine.robot, body)[leg]
            assert reach < 1e-6 or joint_limit_margin(model, leg, p_hip, q) > 0.9
