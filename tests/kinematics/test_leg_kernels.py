"""Compiled kernels of the leg's kinematics over arrays."""

import subprocess
import sys

import numpy as np
import pytest

from phasmid.errors import Unreachable
from phasmid.kinematics import foot_position, jacobian, joint_angles, joint_motion
from phasmid.robot import load_robot


def test_any_number_and_layout_of_samples_will_do():
    robot = load_robot("phantomx-paper")
    leg = robot.legs[0]
    q = np.random.default_rng(5).uniform(-1, 1, (7, 40, 6, 3))
    whole = foot_position(robot.arrays, q)
    for part in (np.asfortranarray(q)[::2, ::-1], q[:0], q[2, 3]):
        np.testing.assert_array_equal(
            foot_position(robot.arrays, part)[..., 1, :],
            foot_position(robot.legs[1], part[..., 1, :]),
        )
    np.testing.assert_array_equal(foot_position(robot.arrays, np.asfortranarray(q)), whole)
    assert jacobian(leg, q[0, 0, 0]).shape == (3, 3)
    assert joint_motion(leg, q[0], q[1], q[2])[1].shape == (40, 6, 3)


@pytest.mark.parametrize("wrong", [[0.5, 0.0, 0.0], [np.nan, 0.0, 0.0], [0.06, 0.0, 0.0]])
def test_the_first_unreachable_point_of_many_is_named(wrong):
    robot = load_robot("phantomx-paper")
    p = np.tile(robot.arrays.neutral_foot, (2, 500, 1, 1))
    for place in ((1, 200, 4), (1, 200, 5), (1, 300, 0)):
        p[place] = wrong
    with pytest.raises(Unreachable) as error:
        joint_angles(robot.arrays, p)
    assert error.value.what.startswith("leg 5, point 1, 200, 4: ")


def test_numba_is_imported_when_a_kernel_is_first_called():
    # It takes 0.6 s, which commands without kernels do not wait for.
    code = (
        "import sys, phasmid\n"
        "from phasmid import dynamics, kinematics\n"
        "robot = phasmid.load_robot('phantomx-paper')\n"
        "assert 'numba' not in sys.modules\n"
        "kinematics.foot_position(robot.legs[0], [0.0, 0.0, 0.0])\n"
        "assert 'numba' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
