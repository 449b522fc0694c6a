"""The body kept level, or along the ground, and its mass over its feet."""

import math

import numpy as np
import pytest

from phasmid.control.estimation import EstimatorSettings
from phasmid.control.estimation.body_levelling import (
    EASE_TIME,
    LEVEL_LIMIT,
    LEVEL_RATE,
    SHIFT_LIMIT,
    SHIFT_RATE,
    level_body,
)
from phasmid.control.estimation.state import AttitudeSource
from phasmid.kinematics import rotation_rpy
from support.estimation_records import new_parameters, new_state

DT = 0.005
HEIGHT = 0.1
FLAT = (0.0, 0.0)


def rotation(roll, pitch, yaw=0.0):
    return rotation_rpy(*map(np.array, (roll, pitch, yaw)))


class Body:
    """A body on ground that lies by a rotation, whose attitude follows its command at once."""

    def __init__(self, ground, yaw=0.0, level=1.0):
        self.ground, self.yaw = ground, yaw
        self.state = new_state()
        self.parameters = new_parameters(EstimatorSettings(level=level), DT)
        self.track = []

    def update(self, times=1, *, slopes=FLAT, trusted=True):
        for _ in range(times):
            R = rotation(*self.correction[3:], self.yaw)
            up = (self.ground @ R)[2]
            self.level(up, R, slopes, trusted=trusted)
            self.track.append(self.correction.copy())
        return self.correction

    def level(self, up, R, slopes=FLAT, *, trusted=True):
        state = self.state
        state.attitude.up = up
        state.attitude.source = AttitudeSource.ORIENTATION if trusted else AttitudeSource.NONE
        state.ground_plane.slope_x, state.ground_plane.slope_y = slopes
        level_body(R, self.yaw, HEIGHT, state, self.parameters)

    @property
    def correction(self):
        levelling = self.state.levelling
        return np.array([*levelling.shift, levelling.rise, *levelling.lean])

    @property
    def tilt(self):
        return math.acos((self.ground @ rotation(*self.correction[3:], self.yaw))[2, 2])


@pytest.mark.parametrize(
    ("ground", "yaw", "level", "left"),
    [
        ((0.1, -0.15), 1.1, 1.0, 0.0),
        # Half-way between two directions in space is half the angle.
        ((0.0, -0.2), 0.0, 0.5, 0.1),
    ],
)
def test_levelling_takes_away_its_share_of_a_tilt(ground, yaw, level, left):
    body = Body(rotation(*ground), yaw, level)
    body.update(2000)
    assert body.tilt == pytest.approx(left, abs=1e-6)


def test_along_the_ground_the_body_follows_the_plane_of_its_feet():
    """z = a x + b y: its normal is the body's z."""
    body = Body(np.eye(3), level=0.0)
    body.update(2000, slopes=(0.2, -0.1))
    z = rotation(*body.correction[3:])[:, 2]
    np.testing.assert_allclose(z, np.array([-0.2, 0.1, 1.0]) / math.hypot(0.2, 0.1, 1.0), atol=1e-9)


def test_turn_and_shift_are_bounded_in_speed_and_size():
    body = Body(rotation(0.4, -0.5))
    body.update(2000)
    track = np.diff(np.array(body.track), axis=0) / DT
    assert np.hypot(track[:, 3], track[:, 4]).max() <= LEVEL_RATE * (1 + 1e-9)
    assert np.hypot(track[:, 0], track[:, 1]).max() <= SHIFT_RATE * (1 + 1e-9)
    np.testing.assert_allclose(np.hypot(*body.correction[3:]), LEVEL_LIMIT, rtol=1e-6)
    np.testing.assert_allclose(np.hypot(*body.correction[:2]), SHIFT_LIMIT, rtol=1e-6)


def test_the_vertical_through_the_mass_meets_the_middle_of_the_feet():
    """On a slope that the path takes for level ground up is (sin s, 0, cos s): h tan s uphill."""
    slope = math.radians(10)
    body = Body(rotation(0.0, -slope))
    body.update(3000)
    np.testing.assert_allclose(body.correction[:2], [HEIGHT * math.tan(slope), 0.0], atol=1e-7)


def test_without_a_sensor_the_corrections_ease_out():
    body = Body(rotation(0.0, -0.15))
    body.update(2000)
    before = body.correction.copy()
    body.update(1, trusted=False)
    first = np.abs(body.correction - before)
    assert first.max() < 0.15 * 2 * DT / EASE_TIME
    body.update(4000, trusted=False)
    # 20 s: below e^-9 of it.
    assert np.abs(body.correction).max() < 1e-4


def test_the_tilt_is_the_angle_from_the_commanded_attitude_and_0_without_a_sensor():
    """By its sine, to rounding."""
    body = Body(np.eye(3))
    commanded = rotation(0.05, 0.1)
    body.level((rotation(0.0, 0.2) @ commanded).T @ [0.0, 0.0, 1.0], commanded)
    assert body.state.levelling.tilt == pytest.approx(math.sin(0.2), abs=1e-12)
    body.level((0.0, 0.0, 1.0), commanded, trusted=False)
    assert body.state.levelling.tilt == 0.0
