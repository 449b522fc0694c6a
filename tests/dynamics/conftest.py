"""Robots to test on, and the same robots in MuJoCo."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from general_robot import general_robot
from phasmid.robot import Robot, load_robot, preset_names


def beside_its_plane() -> Robot:
    """The robot without any symmetry, each link with a lateral offset of its own."""
    robot, legs = general_robot(), []
    for leg in robot.legs:
        offsets = zip(leg.links, (0.04, -0.07, 0.02), strict=True)
        links = {link.name: replace(link, lateral_offset=left) for link, left in offsets}
        legs.append(replace(leg, **links))
    return replace(robot, legs=tuple(legs))


@pytest.fixture(params=[*preset_names(), "general", "offsets"])
def robot(request: pytest.FixtureRequest) -> Robot:
    """Every preset, and robots without any symmetry."""
    own = {"general": general_robot, "offsets": beside_its_plane}
    return own[request.param]() if request.param in own else load_robot(request.param)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(10)


@pytest.fixture
def derivative() -> Callable[..., np.ndarray]:
    """d f / d t by the central difference of eighth order.

    Its truncation error is (w h)^8 w / 630 times the size of a component of frequency w, and
    its round-off about 2e-16 / h times the size of f.
    """
    weights = (4 / 5, -1 / 5, 4 / 105, -1 / 280)

    def differentiate(f: Callable[..., np.ndarray], t: float, h: float = 0.01) -> np.ndarray:
        steps = enumerate(weights, start=1)
        return sum(c * (f(t + k * h) - f(t - k * h)) for k, c in steps) / h

    return differentiate


# Pinocchio has no wheels for Windows.
collect_ignore = (
    ["test_dynamics_agreement.py", "test_dynamics_floating_base.py"]
    if sys.platform == "win32"
    else []
)
