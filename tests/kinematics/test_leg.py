"""Closed-form leg kinematics against themselves, the DH chain and a complex step; their reach."""

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phasmid.errors import Unreachable
from phasmid.kinematics import (
    foot_position,
    jacobian,
    joint_angles,
    joint_motion,
    reach,
    within_reach,
)
from phasmid.robot import load_robot


def test_a_level_leg_reaches_out_and_a_bent_knee_goes_down():
    # By hand: all angles 0 stretches the leg along x; q3 = -90 degrees hangs the tibia down.
    leg = load_robot("phantomx-paper").legs[0]
    straight, hanging = foot_position(leg, np.array([[0.0, 0, 0], [0, 0, -math.pi / 2]]))
    assert straight == pytest.approx([0.274, 0, 0], abs=1e-15)
    assert hanging == pytest.approx([0.134, 0, -0.140], abs=1e-15)


def test_joint_motion_is_the_foots_motion_through_the_jacobian():
    # v = J q' exactly, and a = J q'' + J' q' with J' by a central difference along q'.
    leg = load_robot("phantomx-mk4").legs[2]
    rng = np.random.default_rng(4)
    q = rng.uniform([-1, -1, -2.5], [1, 1, -0.5], (200, 3))
    q = q[np.hypot(*foot_position(leg, q)[:, :2].T) > 0.05]
    qd, qdd = rng.normal(size=q.shape), rng.normal(size=q.shape)
    J, h = jacobian(leg, q), 1e-3

    def slope(k):
        return (jacobian(leg, q + k * h * qd) - jacobian(leg, q - k * h * qd)) / (2 * k * h)

    Jd = (56 * slope(1) - 28 * slope(2) + 8 * slope(3) - slope(4)) / 35
    v = np.einsum("nij,nj->ni", J, qd)
    a = np.einsum("nij,nj->ni", J, qdd) + np.einsum("nij,nj->ni", Jd, qd)
    back, back2 = joint_motion(leg, q, v, a)
    assert np.abs(back - qd).max() < 1e-12
    # The difference errs by eps |J| / h < 1e-13, amplified by at most 1/(0.05 m) and |q'| < 4.
    assert np.abs(back2 - qdd).max() < 1e-10


@given(x=st.floats(-1, 1), y=st.floats(-1, 1), z=st.floats(-1, 1))
def test_any_target_is_reached_exactly_or_refused_by_name(x, y, z):
    leg = load_robot("phantomx-ax").legs[3]
    p = np.array([x, y, z])
    try:
        q = joint_angles(leg, p)
    except Unreachable as error:
        assert error.what.startswith("leg left_rear: foot target (")
        coxa, femur, tibia = leg.lengths
        distance = np.hypot(np.hypot(x, y) - coxa, z)
        assert not abs(femur - tibia) - 1e-12 <= distance <= femur + tibia + 1e-12
    else:
        assert np.abs(foot_position(leg, q) - p).max() < 1e-12


def test_the_first_unreachable_point_is_named():
    robot = load_robot("phantomx-paper")
    p = np.tile(robot.arrays.neutral_foot, (2, 500, 1, 1))
    for place in ((1, 200, 4), (1, 200, 5), (1, 300, 0)):
        p[place] = [np.nan, 0.0, 0.0] if place == (1, 300, 0) else [0.4, 0.0, -0.1]
    with pytest.raises(Unreachable, match=r"leg 5, point 1, 200, 4: .* is 362\.1 mm from the fem"):
        joint_angles(robot.arrays, p)
    with pytest.raises(Unreachable, match=r"leg right_front: foot target \(nan, 0.0, 0.0\) mm"):
        joint_angles(robot.legs[0], p[1, 300, 0])


def test_any_number_and_layout_of_samples_will_do():
    robot = load_robot("phantomx-paper")
    q = np.random.default_rng(5).uniform(-1, 1, (7, 40, 6, 3))
    for part in (np.asfortranarray(q)[::2, ::-1], q[:0], q[2, 3]):
        np.testing.assert_array_equal(
            foot_position(robot.arrays, part)[..., 1, :],
            foot_position(robot.legs[1], part[..., 1, :]),
        )


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
