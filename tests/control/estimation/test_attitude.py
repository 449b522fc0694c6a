"""The direction of up, by whichever inertial sensor tells the truth."""

import math

import numpy as np
import pytest

from phasmid.control.estimation import attitude
from phasmid.control.estimation.attitude import estimate_attitude
from phasmid.kinematics import quaternion_rotation, rpy_quaternion

G = 9.80665
DT = 0.005
SETTINGS = np.array([0.02, 1.0, 3.0, 0.0, math.radians(20), 0.5])
NONE4, NONE3 = np.full(4, np.nan), np.full(3, np.nan)


class Body:
    """A body that rolls and pitches as it is told, its sensors, and the filter."""

    def __init__(self, settings=SETTINGS):
        self.memory, self.up, self.settings = np.zeros(attitude.MEMORY), np.zeros(3), settings
        self.true = np.zeros(3)

    def update(self, roll, pitch, *, gyro=(0, 0, 0), hear=("q", "w", "a"), still=False, lie=0.0):
        q = rpy_quaternion(*map(np.array, (roll, pitch + lie, 0.7)))
        R = quaternion_rotation(rpy_quaternion(*(np.array(v) for v in (roll, pitch, 0.7))))
        self.true = R[2]
        return estimate_attitude(
            DT,
            G,
            q if "q" in hear else NONE4,
            np.array(gyro, dtype=float) if "w" in hear else NONE3,
            G * R[2] if "a" in hear else NONE3,
            still,
            self.settings,
            self.memory,
            self.up,
        )

    @property
    def error(self):
        return float(np.arccos(np.clip(self.up @ self.true, -1, 1)))


def test_the_first_word_is_taken_as_it_is():
    body = Body()
    assert body.update(0.2, -0.1) == attitude.ORIENTATION
    assert body.error < 1e-7


@pytest.mark.parametrize(
    ("hear", "source", "time"),
    [("q", attitude.ORIENTATION, 0.02), ("a", attitude.ACCELEROMETER, 1.0)],
)
def test_a_turn_is_followed_within_the_time_constant(hear, source, time):
    """To 1/e after one; the accelerometer's passes two filters: (1 + 1) e^-1."""
    body = Body()
    body.update(0.0, 0.0, hear=hear)
    for _ in range(round(time / DT)):
        assert body.update(0.0, 0.1, hear=hear) == source
    left = body.error / 0.1
    # Steps of a quarter of the time constant are exact, the sphere is flat to 0.1²/2.
    expected = math.exp(-1) if hear == "q" else 2 * math.exp(-1)
    assert left == pytest.approx(expected, abs=0.02)


def test_the_gyro_carries_the_attitude_through_turns_without_an_orientation():
    """Pitch at 1 rad/s: the lag of an accelerometer alone would be 2 s, that of both is none."""
    body, rate = Body(), 1.0
    for k in range(101):
        body.update(0.0, rate * k * DT, gyro=(0, rate if k else 0, 0), hear=("w", "a"))
    # Euler's steps err by rate² dt/2 a second.
    assert body.error < 0.5 * rate**2 * DT * 0.5 + 1e-6


def test_the_gyros_bias_is_learnt_at_rest():
    body, bias = Body(), 0.05
    for _ in range(6000):
        body.update(0.0, 0.0, gyro=(bias, -bias, 0), hear=("w", "a"), still=True)
    # exp(-30 s/3 s) is left of it, and makes an error of that times 2 s, a little more by its past.
    left = math.exp(-10) * bias
    np.testing.assert_allclose(body.memory[attitude.BIAS], [bias, -bias, 0], atol=1.01 * left)
    assert body.error < 10 * left


def test_a_dead_orientation_hands_over_without_a_jump():
    body = Body()
    for _ in range(200):
        body.update(0.05, 0.1)
    before = body.up.copy()
    assert body.update(0.05, 0.1, hear=("w", "a")) == attitude.ACCELEROMETER
    assert np.abs(body.up - before).max() < 1e-6
    assert body.update(0.05, 0.1) == attitude.ORIENTATION


def test_an_orientation_that_leaps_is_not_heard():
    body = Body()
    for _ in range(200):
        body.update(0.0, 0.1)
    for _ in range(100):
        assert body.update(0.0, 0.1, lie=0.8) == attitude.ACCELEROMETER
        assert body.error < 1e-3


def test_an_orientation_that_creeps_away_is_a_quarrel():
    """Which of the two sensors lies nobody knows: nothing is believed once they are 20° apart."""
    body = Body()
    sources = [body.update(0.0, 0.0, lie=0.1 * k * DT) for k in range(1600)]
    assert sources[0] == attitude.ORIENTATION
    assert sources[-1] != attitude.ORIENTATION
    assert attitude.NONE in sources


def test_an_orientation_that_stands_still_in_a_walk_is_not_heard():
    body = Body()
    told = [body.update(0.0, 0.0) for _ in range(120)]
    assert told[0] == attitude.ORIENTATION
    assert told[-1] == attitude.ACCELEROMETER
    # At rest it may.
    assert body.update(0.0, 0.0, still=True) == attitude.ORIENTATION


def test_a_gyro_alone_is_not_believed_for_long():
    body = Body()
    for _ in range(10):
        body.update(0.0, 0.1)
    sources = [body.update(0.0, 0.1, hear="w") for _ in range(500)]
    assert sources[0] == attitude.ACCELEROMETER
    assert sources[-1] == attitude.NONE


def test_no_sensor_at_all_is_no_attitude():
    body = Body()
    assert body.update(0.3, 0.3, hear="") == attitude.NONE
    np.testing.assert_array_equal(body.up, [0, 0, 1])
    assert np.isfinite(body.memory[:9]).all()
