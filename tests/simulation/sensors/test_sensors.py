"""Sensors tell what is true, at their own time, in their own steps, with their own noise."""

import math

import numpy as np
import pytest

from phasmid import load_scenario, plan, sense, simulate
from phasmid.errors import InvalidInput
from phasmid.experiment import Sensors
from phasmid.kinematics import quaternion_rotation, rotation_rpy, rpy_quaternion
from phasmid.recording import new_recording
from phasmid.simulation.sensors.measurement import measure
from phasmid.simulation.sensors.models import InertialSensor, Sampling

GRAVITY = 9.81
PERFECT = {
    "measured": "everything",
    "joint_rate": 1000,
    "joint_delay": 0,
    "encoder_step": 0,
    "load_step": 0,
    "imu_rate": 1000,
    "imu_delay": 0,
    "gyro_noise": 0,
    "gyro_bias": 0,
    "accelerometer_noise": 0,
    "accelerometer_bias": 0,
    "orientation_noise": 0,
    "foot_rate": 1000,
    "foot_delay": 0,
    "foot_force_noise": 0,
}


@pytest.fixture(scope="module")
def short():
    scenario = load_scenario("paper").replace(duration=1.0)
    return scenario, simulate(scenario, plan(scenario))


def test_perfect_sensors_tell_the_truth(short):
    scenario, run = short
    told = sense(scenario.replace(**PERFECT), run)
    # Without noise, step or delay, at the rate of the recording, every reading is its sample.
    assert np.array_equal(told.joint_position_measured, run.joint_position)
    assert np.array_equal(told.foot_normal_force_measured, run.foot_normal_force)
    assert np.array_equal(told.imu_orientation, run.body_orientation)
    stall = scenario.load_robot().servo.stall_torque
    assert np.array_equal(told.joint_load_measured, run.joint_torque / stall)
    # A motor's load includes what friction and rotor take of it.
    own = scenario.replace(drive="ideal-servo", duration=0.1, **PERFECT)
    motors = simulate(own, plan(own))
    assert np.array_equal(sense(own, motors).joint_load_measured, motors.servo_motor_torque / stall)
    # The gyro's range has 2^15 steps, so that half a step is 250 deg/s / 2^16.
    R = quaternion_rotation(run.body_orientation.values)
    own = np.einsum("tji,tj->ti", R, run.body_angular_velocity.values)
    half_step = math.radians(250) / 2**16
    assert np.abs(told.imu_angular_velocity.values - own).max() <= half_step * (1 + 1e-9)


def test_a_run_that_asks_for_sensors_has_what_sense_adds(short):
    scenario, run = short
    asked = scenario.replace(measured="everything")
    assert not any("measured" in str(name) for name in run.data_vars)
    both = simulate(asked, plan(asked)), sense(asked, run)
    assert set(both[0].data_vars) == set(both[1].data_vars)
    for name in both[0].data_vars:
        assert np.array_equal(both[0][name], both[1][name]), name


def test_a_reading_stands_until_the_next_one_arrives():
    # 50 readings a second that arrive 13 ms late, seen every millisecond: reading j is there from
    # 20 j + 13 ms on. The first stands from the beginning.
    time = np.arange(101) * 1e-3
    sampling = Sampling(50.0, 0.013)
    reading = sampling.latest(time)
    wanted = np.maximum((np.arange(101) - 13) // 20, 0)
    assert np.array_equal(reading, wanted)
    assert np.array_equal(sampling.row_of(time, reading), 20 * wanted)


def test_a_delay_shows_the_past(short):
    scenario, run = short
    late = sense(scenario.replace(**PERFECT | {"joint_delay": 0.037}), run)
    told, true = late.joint_position_measured.values, run.joint_position.values
    assert np.array_equal(told[37:], true[:-37])
    assert np.array_equal(told[:37], np.repeat(true[:1], 37, axis=0))


def test_an_encoder_tells_whole_ticks_half_a_tick_off_at_most(short):
    scenario, run = short
    tick = math.radians(300 / 1024)
    told = sense(scenario.replace(**PERFECT | {"encoder_step": tick}), run)
    ticks = told.joint_position_measured.values / tick
    # A number of some hundred ticks is divided and multiplied: 1e-12 covers its round-off.
    assert np.abs(ticks - np.round(ticks)).max() < 1e-12 * np.abs(ticks).max()
    off = np.abs(told.joint_position_measured - run.joint_position).max()
    assert tick / 4 < off <= tick / 2 * (1 + 1e-9)


def test_noise_and_bias_have_the_size_that_the_table_says():
    # 20 000 readings of a robot at rest. The standard deviation of n normal numbers is off by
    # sigma / sqrt(2 n) itself, their mean by sigma / sqrt(n): five of these are allowed, and half
    # a step of the 16 bits.
    n, sigma = 20_000, 0.04
    table = Sensors(accelerometer_noise=sigma, accelerometer_bias=0.0, imu_rate=1000)
    told = at_rest(table, n)["imu_acceleration"]
    fresh = told[np.flatnonzero(np.any(np.diff(told, axis=0) != 0, axis=1))]
    step = table.accelerometer_range / 2**15
    assert np.std(fresh, axis=0) == pytest.approx([sigma] * 3, abs=5 * sigma / math.sqrt(2 * n))
    assert np.mean(fresh, axis=0) == pytest.approx(
        [0, 0, GRAVITY], abs=5 * sigma / math.sqrt(n) + step
    )
    # A bias is one number for the whole run. Over 200 seeds its spread is known to 5 / sqrt(400).
    biases = []
    for seed in range(200):
        table = Sensors(
            gyro_noise=0, gyro_bias=0.02, gyro_range=1.0, sensor_seed=seed, imu_rate=1000
        )
        told = at_rest(table, 3)["imu_angular_velocity"]
        assert np.array_equal(told, np.repeat(told[:1], 3, axis=0))
        biases.append(told[0, 0])
    assert np.std(biases) == pytest.approx(0.02, rel=5 / math.sqrt(400))


def imu_channels(table, gravity, time, orientation, velocity, angular_velocity):
    """Readings of an inertial sensor that has not been used before."""
    acceleration = np.diff(velocity, axis=0, prepend=velocity[:1]) / 1e-3
    true = {
        "body_orientation": orientation,
        "body_acceleration": acceleration,
        "body_angular_velocity": angular_velocity,
    }
    return measure(InertialSensor(table, gravity), time, true)


def at_rest(table, samples):
    time = np.arange(samples) * 1e-3
    level = np.tile([1.0, 0.0, 0.0, 0.0], (samples, 1))
    zero = np.zeros((samples, 3))
    return imu_channels(table, GRAVITY, time, level, zero, zero)


def test_the_seed_alone_decides_and_a_longer_run_begins_like_a_shorter_one(short):
    scenario, run = short
    first, again = sense(scenario, run), sense(scenario, run)
    other = sense(scenario.replace(sensor_seed=1), run)
    beginning = sense(scenario, run.isel(time=slice(0, 400)))
    for name in ("imu_acceleration", "imu_orientation", "foot_normal_force_measured"):
        assert np.array_equal(first[name], again[name])
        assert not np.array_equal(first[name], other[name])
        assert np.array_equal(beginning[name], first[name][:400])


def test_the_accelerometer_feels_one_g_at_rest_nothing_in_free_fall_and_its_own_tilt():
    perfect = Sensors(
        accelerometer_noise=0, accelerometer_bias=0, imu_rate=1000, imu_delay=0, orientation_noise=0
    )
    step = perfect.accelerometer_range / 2**15
    time = np.arange(51) * 1e-3
    roll, pitch, zero = np.full(51, 0.3), np.full(51, -0.2), np.zeros(51)
    R, tilted = rotation_rpy(roll, pitch, zero)[0], rpy_quaternion(roll, pitch, zero)
    still = np.zeros((51, 3))
    falling = -GRAVITY * time[:, None] * np.array([0.0, 0.0, 1.0])
    at_rest = imu_channels(perfect, GRAVITY, time, tilted, still, still)["imu_acceleration"]
    fall = imu_channels(perfect, GRAVITY, time, tilted, falling, still)["imu_acceleration"]
    assert at_rest[-1] == pytest.approx(R.T @ [0, 0, GRAVITY], abs=step)
    assert np.linalg.norm(at_rest[-1]) == pytest.approx(GRAVITY, abs=2 * step)
    assert np.abs(fall[1:]).max() <= step


def test_the_orientation_is_wrong_by_a_turn_of_the_given_size(short):
    scenario, run = short
    noise = 0.02
    told = sense(scenario.replace(**PERFECT | {"orientation_noise": noise}), run)
    q, p = told.imu_orientation.values, run.body_orientation.values
    assert np.abs(np.linalg.norm(q, axis=1) - 1).max() < 1e-12
    angle = 2 * np.arccos(np.minimum(np.abs(np.sum(q * p, axis=1)), 1.0))
    # The angle of a turn with three normal components: its mean square is 3 sigma^2, known from
    # 1001 readings to 5 sqrt(2/(3 n)).
    assert np.mean(angle**2) == pytest.approx(3 * noise**2, rel=5 * math.sqrt(2 / 3003))


def test_a_foot_is_felt_from_the_threshold_on(short):
    scenario, run = short
    told = sense(scenario.replace(**PERFECT | {"contact_threshold": 2.0}), run)
    assert np.array_equal(told.contact_measured, run.foot_normal_force >= 2.0)


def test_a_recording_with_nothing_to_measure_is_refused():
    scenario = load_scenario("paper")
    stance = new_recording(np.zeros(1), {"stance": np.ones((1, 6), dtype=bool)}, {})
    with pytest.raises(InvalidInput, match="nothing that a sensor could measure"):
        sense(scenario, stance)


def test_samples_rarer_than_readings_are_refused_by_scenario_and_sense_alike(short):
    # A sensor at 100/s has a new reading every 10 ms; samples every 20 ms hold half of them.
    scenario, run = short
    what = (
        "imu_rate is 100 readings a second and a sample is recorded every 20 ms; old values would "
        "pass for new readings."
    )
    with pytest.raises(InvalidInput) as caught:
        scenario.replace(measured="everything", record_interval=0.02)
    assert caught.value.what == what
    assert caught.value.hint == "imu_rate = 50, foot_rate = 50"
    scenario.replace(record_interval=0.02)
    with pytest.raises(InvalidInput) as caught:
        sense(scenario, run.isel(time=slice(None, None, 20)))
    assert caught.value.what == what
    # What is not recorded is not read.
    joints = run[["joint_position"]].isel(time=slice(None, None, 20))
    assert "joint_position_measured" in sense(scenario, joints)
