"""Closed-form leg kinematics against themselves, the DH chain and a complex step."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phasmid.errors import Unreachable
from phasmid.kinematics import foot_position, jacobian, joint_angles, joint_motion, leg_frames
from phasmid.robot import load_robot, preset_names

PRESETS = preset_names()


def random_angles(count: int, seed: int = 0) -> np.ndarray:
    """Knee-up angles over the whole range, shape (count, 3)."""
    rng = np.random.default_rng(seed)
    low, high = [-3.0, -1.5, -math.pi], [3.0, 1.5, 0.0]
    return rng.uniform(low, high, (count, 3))


def outward(leg, q):
    """Those angles whose foot is at least 1 mm outside the coxa axis."""
    coxa, femur, tibia = leg.lengths
    r = coxa + femur * np.cos(q[:, 1]) + tibia * np.cos(q[:, 1] + q[:, 2])
    return q[r > 1e-3]


@pytest.mark.parametrize("preset", PRESETS)
def test_a_foot_put_where_the_inverse_says_is_where_it_was_asked(preset):
    # FK(IK(p)) = p. Positions are sums of a few terms below 0.3 m, each of relative round-off
    # 1.1e-16, so 1e-12 leaves four orders. The workspace is that of a leg that reaches outwards:
    # a foot folded back past its own coxa axis is left out.
    leg = load_robot(preset).legs[0]
    p = foot_position(leg, outward(leg, random_angles(100_000)))
    assert len(p) > 50_000
    assert np.abs(foot_position(leg, joint_angles(leg, p)) - p).max() < 1e-12


@pytest.mark.parametrize("preset", PRESETS)
def test_angles_come_back_from_the_foot_that_they_make(preset):
    # IK(FK(q)) = q for the knee-up branch with the foot outside the coxa axis. The knee angle is
    # ill-conditioned by 1/sin(q3) near full stretch and full fold: keep 0.05 rad away.
    leg = load_robot(preset).legs[0]
    q = outward(leg, random_angles(100_000, seed=1))
    q = q[np.abs(np.sin(q[:, 2])) > 0.05]
    back = joint_angles(leg, foot_position(leg, q))
    # At r = 1 mm the coxa angle amplifies 1e-16 m of round-off to 1e-13 rad.
    assert np.abs(back - q).max() < 1e-11


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("short", [0.0, 1e-15, 1e-12, 1e-9, 1e-6])
def test_the_round_trip_holds_up_to_full_stretch(preset, short):
    leg = load_robot(preset).legs[0]
    coxa, femur, tibia = leg.lengths
    elevation = np.linspace(-1.5, 1.5, 301)
    length = (femur + tibia) * (1 - short)
    p = np.stack(
        [coxa + length * np.cos(elevation), 0 * elevation, length * np.sin(elevation)], axis=-1
    )
    assert np.abs(foot_position(leg, joint_angles(leg, p)) - p).max() < 1e-12


@pytest.mark.parametrize("preset", PRESETS)
def test_the_denavit_hartenberg_chain_is_the_closed_form(preset):
    # Products of four transforms: fewer than 20 operations on terms below 0.3 m.
    leg = load_robot(preset).legs[0]
    q = random_angles(10_000, seed=2)
    assert np.abs(leg_frames(leg, q)[:, 3, :3, 3] - foot_position(leg, q)).max() < 1e-14


def test_a_level_leg_reaches_out_and_a_bent_knee_goes_down():
    # By hand: all angles 0 stretches the leg along x; q3 = -90 degrees hangs the tibia down.
    leg = load_robot("phantomx-paper").legs[0]
    straight, hanging = foot_position(leg, np.array([[0.0, 0, 0], [0, 0, -math.pi / 2]]))
    assert straight == pytest.approx([0.274, 0, 0], abs=1e-15)
    assert hanging == pytest.approx([0.134, 0, -0.140], abs=1e-15)


@pytest.mark.parametrize("preset", PRESETS)
def test_the_jacobian_is_the_derivative_of_the_foot(preset):
    # Central differences of step h err by h^2/6 |f'''| + eps |f| / h; at h = 1e-5 and |f| < 0.3
    # that is 5e-12 + 3e-12. Richardson's extrapolation with 2h removes the h^2 term.
    leg = load_robot(preset).legs[0]
    q, h = random_angles(1000, seed=3), 1e-3
    J = jacobian(leg, q)
    for joint in range(3):
        e = np.eye(3)[joint]

        def slope(k, e=e):
            return (foot_position(leg, q + k * h * e) - foot_position(leg, q - k * h * e)) / (
                2 * k * h
            )

        # Weights of an eighth-order difference; error h^8 |f| / 630 + eps |f| / h = 3e-13.
        d = (56 * slope(1) - 28 * slope(2) + 8 * slope(3) - slope(4)) / 35
        assert np.abs(J[..., joint] - d).max() < 1e-12


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
        assert error.leg == "left_rear"
        assert error.target == (x, y, z)
        near, far = error.reach
        assert not near - 1e-12 <= error.distance <= far + 1e-12
    else:
        assert np.abs(foot_position(leg, q) - p).max() < 1e-12


def test_the_first_unreachable_point_is_named():
    leg = load_robot("phantomx-paper").legs[0]
    p = np.tile(leg.neutral_foot, (4, 5, 1))
    p[2, 3] = [0.4, 0.0, -0.1]
    with pytest.raises(Unreachable) as caught:
        joint_angles(leg, p)
    assert caught.value.index == (2, 3)
    assert str(caught.value) == (
        "leg right_front, point 2, 3: foot target (400.0, 0.0, -100.0) mm is 362.1 mm from the "
        "femur axis; the leg reaches 58.0 to 222.0 mm."
    )


def test_a_target_that_is_not_a_number_is_unreachable():
    leg = load_robot("phantomx-paper").legs[0]
    with pytest.raises(Unreachable):
        joint_angles(leg, np.array([np.nan, 0.0, -0.1]))


@pytest.mark.parametrize("function", [foot_position, joint_angles, jacobian])
def test_an_array_of_another_width_is_refused(function):
    with pytest.raises(ValueError, match="size 2 is different from 3"):
        function(load_robot("phantomx-paper").legs[0], np.zeros((4, 2)))
