"""How far the legs go, against geometry done by hand and by search."""

import numpy as np

from phasmid.errors import Unreachable
from phasmid.kinematics import (
    joint_angles,
    within_reach,
)
from phasmid.robot import load_robot


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
