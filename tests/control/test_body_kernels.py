"""Centre of mass, rotations and support margin of the engine, against the package's arrays."""

import numpy as np
import pytest

from general_robot import general_robot
from phasmid.control import body_kernels
from phasmid.control.records import fill, view_of
from phasmid.control.settings import EngineSettings
from phasmid.control.types import MODEL, Model, model_of
from phasmid.gait import support_margin
from phasmid.kinematics import centre_of_mass, rotation_rpy
from phasmid.robot import load_robot, preset_names

ROUND_OFF = 1e-12


@pytest.fixture(scope="module", params=[*preset_names(), "general"])
def robot(request):
    return general_robot() if request.param == "general" else load_robot(request.param)


def angles(robot, rng, count=50):
    low, high = np.moveaxis(robot.arrays.joint_limits, -1, 0)
    q = rng.uniform(low, high, size=(count, *low.shape))
    # Knee up, and neither stretched nor folded flat: what the inverse gives back.
    q[..., 2] = rng.uniform(-1.6, -0.5, size=q.shape[:-1])
    q[..., 1] = rng.uniform(-0.5, 0.9, size=q.shape[:-1])
    return q


def test_the_centre_of_mass_is_that_of_kinematics(robot):
    q = angles(robot, np.random.default_rng(3), 20)
    model = model_of(robot, EngineSettings())
    records = np.zeros(1, MODEL)
    fill(view_of(records, Model, len(robot.legs)), model)
    record = records[0]
    for angle, want in zip(q, centre_of_mass(robot, q), strict=True):
        moment = model.body_moment.copy()
        for leg in range(len(angle)):
            body_kernels.moment_of(record, leg, angle[leg], moment)
        np.testing.assert_allclose(moment / model.mass, want, atol=ROUND_OFF)


def test_rotations_are_those_of_kinematics():
    for rpy in np.random.default_rng(4).normal(size=(20, 3)).tolist():
        R = np.empty((3, 3))
        body_kernels.rotation(*rpy, R)
        np.testing.assert_allclose(R, rotation_rpy(*np.array(rpy)[:, None])[0], atol=ROUND_OFF)


def test_the_support_margin_is_that_of_gaits_inside_and_of_its_sign_outside():
    rng = np.random.default_rng(5)
    for _ in range(200):
        feet, point = rng.normal(size=(6, 2)), rng.normal(size=2)
        standing = rng.random(6) < 0.7
        found = body_kernels.support_margin(feet, standing.astype(np.int64), *point)
        want = support_margin(feet, standing, point)
        if want > 0 or not np.isfinite(want):
            assert found == pytest.approx(want, abs=ROUND_OFF)
        else:
            assert found < ROUND_OFF
