"""Robots to test on, and the same robots in MuJoCo."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from phasmid.robot import load_robot
from support.general_robot import general_robot


def beside_its_plane():
    """The robot without any symmetry, each link with a lateral offset of its own."""
    robot, legs = general_robot(), []
    for leg in robot.legs:
        offsets = zip(leg.links, (0.04, -0.07, 0.02), strict=True)
        links = {link.name: replace(link, lateral_offset=left) for link, left in offsets}
        legs.append(replace(leg, **links))
    return replace(robot, legs=tuple(legs))


@pytest.fixture(params=["phantomx-paper", "quadruped", "general", "offsets"])
def robot(request):
    own = {"general": general_robot, "offsets": beside_its_plane}
    return own[request.param]() if request.param in own else load_robot(request.param)


@pytest.fixture
def rng():
    return np.random.default_rng(10)


# Pinocchio has no wheels for Windows.
collect_ignore = ["test_dynamics_matrix_form.py"] if sys.platform == "win32" else []
