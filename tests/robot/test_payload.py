"""A load on the robot's back."""

import math

import numpy as np
import pytest

from general_robot import general_robot
from phasmid import load_robot
from phasmid.errors import InvalidInput
from phasmid.robot import with_payload


@pytest.mark.parametrize("robot", [load_robot("phantomx-ax"), general_robot()])
def test_a_load_moves_the_trunks_centre_and_adds_to_its_inertia(robot):
    loaded = with_payload(robot, 0.8)
    assert loaded.mass == pytest.approx(robot.mass + 0.8, rel=1e-14)
    # First and second moments about the body's origin are sums over both parts.
    load = np.array([0.0, 0.0, robot.body.size[2] / 2])

    def moments(body):
        m, c = body.mass, body.com
        return m * c, body.inertia + m * ((c @ c) * np.eye(3) - np.outer(c, c))

    first, second = moments(robot.body)
    assert moments(loaded.body)[0] == pytest.approx(first + 0.8 * load, abs=1e-14)
    own = 0.8 * ((load @ load) * np.eye(3) - np.outer(load, load))
    assert moments(loaded.body)[1] == pytest.approx(second + own, abs=1e-14)
    assert loaded.legs is robot.legs
    assert with_payload(robot, 0.0) is robot


@pytest.mark.parametrize("mass", [-0.1, math.nan, math.inf])
def test_what_is_no_load_is_refused(mass):
    with pytest.raises(InvalidInput, match=r"payload is .* kg; it must be a finite number"):
        with_payload(load_robot("phantomx-ax"), mass)
