"""The direction of up, by whichever inertial sensor tells the truth."""

import math

import numpy as np
import pytest

from phasmid.control.estimation import EstimatorSettings
from phasmid.control.estimation.attitude import estimate_attitude
from phasmid.control.estimation.state import AttitudeSource
from phasmid.kinematics import quaternion_rotation, rpy_quaternion
from support.estimation_records import new_measurements, new_parameters, new_state

G = 9.80665
DT = 0.005
PARAMETERS = new_parameters(EstimatorSettings(imu_delay=0.0), DT)


class Body:
    """A body at a commanded roll and pitch, its sensors, and the filter."""

    def __init__(self):
        self.attitude, self.measured = new_state().attitude, new_measurements()
        self.true = np.zeros(3)

    def update(
        self, roll, pitch, *, gyro=(0, 0, 0), sensors=("q", "w", "a"), still=False, error=0.0
    ):
        q = rpy_quaternion(*map(np.array, (roll, pitch + error, 0.7)))
        R = quaternion_rotation(rpy_quaternion(*(np.array(v) for v in (roll, pitch, 0.7))))
        self.true = R[2]
        measured = self.measured
        measured.orientation = q if "q" in sensors else np.nan
        measured.angular_velocity = gyro if "w" in sensors else np.nan
        measured.acceleration = G * R[2] if "a" in sensors else np.nan
        estimate_attitude(measured, still, self.attitude, PARAMETERS)
        return self.attitude.source

    @property
    def up(self):
        return self.attitude.up

    @property
    def error(self):
        return float(np.arccos(np.clip(self.up @ self.true, -1, 1)))


@pytest.mark.parametrize(
    ("sensors", "source", "time"),
    [("q", AttitudeSource.ORIENTATION, 0.02), ("a", AttitudeSource.ACCELEROMETER, 1.0)],
)
def test_a_turn_is_followed_within_the_time_constant(sensors, source, time):
    """To 1/e after one; the accelerometer's passes two filters: (1 + 1) e^-1."""
    body = Body()
    body.update(0.0, 0.0, sensors=sensors)
    for _ in range(round(time / DT)):
        assert body.update(0.0, 0.1, sensors=sensors) == source
    left = body.error / 0.1
    # Steps of a quarter of the time constant are exact, the sphere is flat to 0.1²/2.
    expected = math.exp(-1) if sensors == "q" else 2 * math.exp(-1)
    assert left == pytest.approx(expected, abs=0.02)


def test_the_gyro_carries_the_attitude_through_turns_without_an_orientation():
    """Pitch at 1 rad/s: the lag of an accelerometer alone would be 2 s, that of both is none."""
    body, rate = Body(), 1.0
    for k in range(101):
        body.update(0.0, rate * k * DT, gyro=(0, rate if k else 0, 0), sensors=("w", "a"))
    # Euler's steps err by rate² dt/2 a second.
    assert body.error < 0.5 * rate**2 * DT * 0.5 + 1e-6


def test_the_gyros_bias_is_learnt_at_rest():
    body, bias = Body(), 0.05
    for _ in range(3000):
        body.update(0.0, 0.0, gyro=(bias, -bias, 0), sensors=("w", "a"), still=True)
    # exp(-15 s/3 s) is left of it, and makes an error of that times 2 s, a little more by its past.
    left = math.exp(-5) * bias
    np.testing.assert_allclose(body.attitude.gyro_bias, [bias, -bias, 0], atol=1.01 * left)
    assert body.error < 10 * left


@pytest.mark.parametrize(
    ("fault", "count", "last"),
    [
        ({"sensors": ("w", "a")}, 1, AttitudeSource.ACCELEROMETER),
        ({"error": 0.8}, 100, AttitudeSource.ACCELEROMETER),
        ({"sensors": "w"}, 500, AttitudeSource.NONE),
        ({"sensors": ""}, 500, AttitudeSource.NONE),
    ],
    ids=["dead", "jumps", "gyro-alone", "nothing"],
)
def test_sensors_that_fail_hand_over_without_a_jump(fault, count, last):
    body = Body()
    for _ in range(100):
        assert body.update(0.05, 0.1) == AttitudeSource.ORIENTATION
    assert body.error < 1e-7
    for _ in range(count):
        source = body.update(0.05, 0.1, **fault)
        assert body.error < 1e-3
    assert source == last
    assert body.update(0.05, 0.1, still=True) == AttitudeSource.ORIENTATION


def test_an_orientation_that_drifts_is_distrusted_and_a_frozen_one_ignored():
    """Either sensor may be wrong: none is trusted once they are 20° apart."""
    body = Body()
    sources = [body.update(0.0, 0.0, error=0.1 * k * DT) for k in range(1600)]
    assert sources[0] == AttitudeSource.ORIENTATION
    assert AttitudeSource.NONE in sources
    body = Body()
    sources = [body.update(0.0, 0.0) for _ in range(120)]
    assert sources[0] == AttitudeSource.ORIENTATION
    assert sources[-1] == AttitudeSource.ACCELEROMETER
    # At rest it may.
    assert body.update(0.0, 0.0, still=True) == AttitudeSource.ORIENTATION
