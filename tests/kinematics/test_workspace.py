"""How far the legs go, against geometry done by hand and by search."""

import math

import numpy as np
import pytest

from phasmid.errors import Unreachable
from phasmid.kinematics import joint_angles, reach, within_reach
from phasmid.robot import load_robot


def test_reach_at_a_height_is_pythagoras():
    # Lc + sqrt((Lf + Lt)^2 - h^2) = 52 + sqrt(222^2 - 100^2) mm; the hole of |Lf - Lt| = 58 mm
    # does not come up to 100 mm, so the nearest is under the coxa axis.
    near, far = reach(load_robot("phantomx-paper").legs[0], -0.1)
    assert far == pytest.approx(0.052 + math.sqrt(0.222**2 - 0.1**2), abs=1e-15)
    assert near == 0.0
    near, _ = reach(load_robot("phantomx-paper").legs[0], -0.03)
    assert near == pytest.approx(0.052 + math.sqrt(0.058**2 - 0.03**2), abs=1e-15)
    assert math.isnan(reach(load_robot("phantomx-paper").legs[0], -0.3)[1])


def test_within_reach_agrees_with_the_inverse_and_the_limits():
    robot = load_robot("phantomx-mk4")
    p = np.random.default_rng(0).uniform([-0.05, -0.2, -0.2], [0.25, 0.2, 0.1], (200, 6, 3))
    reachable = within_reach(robot, p).astype(bool)
    assert 0.1 < reachable.mean() < 0.9
    for k, i in np.ndindex(200, 6):
        try:
            q = joint_angles(robot.legs[i], p[k, i])
        except Unreachable:
            assert not reachable[k, i]
            continue
        lower, upper = robot.legs[i].joint_limits.T
        assert reachable[k, i] == ((q >= lower) & (q <= upper)).all()
