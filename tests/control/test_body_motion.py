"""Centre of mass, rotations and support margin of the engine, against the package's arrays."""

import numpy as np
import pytest

from phasmid.control.body_motion import leg_moment
from phasmid.control.engine import LocomotionEngine
from phasmid.control.records import record_behind
from phasmid.control.vectors import rotation
from phasmid.gait import support_margin
from phasmid.gait.support_kernels import line_margin
from phasmid.kinematics import centre_of_mass, rotation_rpy
from phasmid.robot import load_robot
from support.general_robot import general_robot

ROUND_OFF = 1e-12


@pytest.mark.parametrize("robot", [load_robot("quadruped"), general_robot()], ids=lambda r: r.name)
def test_the_centre_of_mass_is_that_of_kinematics(robot):
    low, high = np.moveaxis(robot.arrays.joint_limits, -1, 0)
    q = np.random.default_rng(3).uniform(low, high, size=(20, *low.shape))
    model = LocomotionEngine(robot, dynamics="none").model
    for angles, want in zip(q, centre_of_mass(robot, q), strict=True):
        moment = sum(leg_moment(record_behind(model), i, each) for i, each in enumerate(angles))
        com = (model.body_moment + moment) / model.mass
        np.testing.assert_allclose(com, want, atol=ROUND_OFF)


def test_rotations_are_those_of_kinematics():
    for rpy in np.random.default_rng(4).normal(size=(20, 3)).tolist():
        want = rotation_rpy(*np.array(rpy)[:, None])[0]
        np.testing.assert_allclose(rotation(*rpy), want, atol=ROUND_OFF)


def test_the_support_margin_is_that_of_gaits_inside_and_of_its_sign_outside():
    rng = np.random.default_rng(5)
    for _ in range(200):
        feet, point = rng.normal(size=(6, 2)), rng.normal(size=2)
        stance = rng.random(6) < 0.7
        found, want = line_margin(feet, stance, *point), support_margin(feet, stance, point)
        if want > 0 or not np.isfinite(want):
            assert found == pytest.approx(want, abs=ROUND_OFF)
        else:
            assert found < ROUND_OFF
