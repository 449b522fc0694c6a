"""The body's estimated state: exact motion, a foot that slips, sensors that fail, whole walks."""

import dataclasses

import numpy as np
import pytest

import phasmid
from phasmid.control import CommandScript
from phasmid.control.estimation import BodyStateEstimator, BodyStateSettings
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, Observation
from phasmid.kinematics import (
    hip_from_body,
    joint_angles,
    neutral_feet,
    quaternion_rotation,
    quaternion_yaw,
    rpy_quaternion,
)
from phasmid.robot import load_robot
from phasmid.scenario import replay
from phasmid.units import STANDARD_GRAVITY

ROBOT = load_robot("phantomx-mk4")
DT, STEP = 0.005, 0.5
NEUTRAL = neutral_feet(ROBOT)
HEIGHT = -NEUTRAL[:, 2].mean()
TRIPOD = np.array([True, False, True, False, True, False])
SPEED, RISE, TURN = 0.08, 0.5, 0.2
"""Velocity [m/s], reached after a time [s] without a jump of the acceleration; yaw rate [rad/s]."""


def walk(duration=5.0, turn=TURN, slide=lambda time: np.zeros((6, 3)), change=lambda k: {}):
    """Observations without error of a tripod on level ground, and the true motion.

    Yields observation, position, velocity and yaw. `slide` moves feet on the ground, `change`
    replaces fields of the observation of an update.
    """
    feet = NEUTRAL + np.array([0.0, 0.0, HEIGHT])
    place, yaw, before = np.array([0.0, 0.0, HEIGHT]), 0.0, np.zeros(3)
    for k in range(round(duration / DT) + 1):
        time = k * DT
        share = min(time / RISE, 1.0)
        speed, rate = (most * share**2 * (3 - 2 * share) for most in (SPEED, turn))
        # The middle of the last period: place and velocity fit one another to second order.
        middle = yaw + 0.5 * rate * DT
        v = speed * np.array([np.cos(middle), np.sin(middle), 0.0])
        if k:
            place, yaw = place + DT * v, yaw + DT * rate
        q = rpy_quaternion(*map(np.array, (0.0, 0.0, yaw)))
        R = quaternion_rotation(q)
        standing = TRIPOD if (time // STEP) % 2 else ~TRIPOD
        phase = time % STEP / STEP
        if time < RISE:
            standing = np.ones(6, dtype=bool)
        lift = np.where(standing, 0.0, 0.03 * np.sin(np.pi * phase))
        goal = place + (NEUTRAL + np.array([0.02, 0.0, 0.0])) @ R.T
        swing = feet + phase**2 * (goal - feet)
        feet = np.where(standing[:, None], feet, swing)
        feet[:, 2] = lift
        on_ground = feet + slide(time)
        force = (v - before) / DT if k else np.zeros(3)
        before = v
        observation = Observation(
            time=time,
            joint_position=joint_angles(
                ROBOT.arrays, hip_from_body(ROBOT, (on_ground - place) @ R)
            ),
            orientation=q,
            angular_velocity=np.array([0.0, 0.0, rate]),
            acceleration=R.T @ (force + np.array([0.0, 0.0, STANDARD_GRAVITY])),
            contact=lift <= 0.0,
            foot_normal_force=np.where(lift <= 0.0, ROBOT.mass * STANDARD_GRAVITY / 6, 0.0),
        )
        yield dataclasses.replace(observation, **change(k)), place, v, yaw


def estimate(motion, **settings):
    """Estimates of a motion: errors of position [m], velocity [m/s] and yaw [rad], slipping."""
    estimator, rows = BodyStateEstimator(ROBOT, BodyStateSettings(**settings), DT), []
    for observation, place, velocity, yaw in motion:
        body = estimator.update(observation)
        turned = float(quaternion_yaw(body.orientation)) - yaw
        rows.append(
            (body.position - place, body.velocity - velocity, turned, body.slipping, body.position)
        )
    return (np.array(column) for column in zip(*rows, strict=True))


def test_exact_sensors_give_the_exact_motion():
    """Only the rule of integration is inexact: one period sees the acceleration of its end.

    Its velocity is off by at most the change of acceleration in a period, v'' dt² with
    |v''| <= 6 v / T² + v w² in the rise, so that the position is off by v'' dt³ a period before the
    feet correct it. The feet of 10 steps add no more than that each.
    """
    position, velocity, yaw, slipping, _ = estimate(walk())
    jerk = 6 * SPEED / RISE**2 + SPEED * TURN**2
    assert np.abs(velocity).max() < 10 * jerk * DT
    assert np.linalg.norm(position, axis=1).max() < 10 * jerk * DT**2
    assert np.abs(yaw).max() < TURN * DT
    assert not slipping.any()


SLIDES, SLID = 0, 0.04
"""A foot that stands in steps of even number, and how far it slides from 2.1 s to 2.4 s [m]."""


def sliding(time):
    moved = np.zeros((6, 3))
    leg = int(np.flatnonzero(~TRIPOD)[SLIDES])
    moved[leg, 0] = -SLID * np.clip((time - 2.1) / 0.3, 0.0, 1.0)
    return moved


def test_a_foot_that_slips_is_left_out():
    """The two others keep the body; as one of three the foot would move it by a third of its slip.

    It is used until it has moved against the others by sqrt(2) times the gate of 4 deviations of
    1 mm, a third of which shifts the body.
    """
    position, _, _, slipping, _ = estimate(walk(3.0, slide=sliding))
    ungated, _, _, never, _ = estimate(walk(3.0, slide=sliding), gate=np.inf)
    leg = np.flatnonzero(~TRIPOD)[SLIDES]
    assert slipping[:, leg].any()
    assert not np.delete(slipping, leg, axis=1).any()
    assert np.linalg.norm(position[-1]) < np.sqrt(2) * 0.004 / 3
    assert np.linalg.norm(ungated[-1]) > SLID / 4
    assert not never.any()


NAN3, NAN4 = np.full(3, np.nan), np.full(4, np.nan)
LOST = {
    "orientation": {"orientation": None},
    "orientation not finite": {"orientation": NAN4},
    "gyro": {"angular_velocity": NAN3},
    "accelerometer": {"acceleration": NAN3},
    "imu": {"orientation": NAN4, "angular_velocity": NAN3, "acceleration": NAN3},
    "switches": {"contact": None},
}


@pytest.mark.parametrize("lost", LOST)
def test_sensors_that_fail_and_return_cause_no_jump(lost):
    """Without one kind of sensor for 2 s the others go on; bounds are twice the measured.

    Of the inertial sensors' loss, which is the worst: 2.1 mm and 0.021 rad at most, and a change of
    position of 1.6 mm in one period beyond the body's own.
    """
    motion = walk(5.0, change=lambda k: LOST[lost] if 300 <= k < 700 else {})
    position, _, yaw, _, estimated = estimate(motion)
    assert np.isfinite(estimated).all()
    assert np.linalg.norm(np.diff(position, axis=0), axis=1).max() < 3.2e-3
    assert np.linalg.norm(position, axis=1).max() < 4.2e-3
    assert np.abs(yaw).max() < 0.042


def test_joint_readings_that_are_not_finite_leave_their_leg_out():
    def change(k):
        return {"joint_position": joints} if 300 <= k < 700 else {}

    plain = list(walk(5.0))
    broken = []
    for k, (observation, *true) in enumerate(plain):
        joints = observation.joint_position.copy()
        joints[1, 2] = np.nan
        broken.append((dataclasses.replace(observation, **change(k)), *true))
    position, _, _, _, estimated = estimate(iter(broken))
    assert np.isfinite(estimated).all()
    assert np.linalg.norm(position, axis=1).max() < 1e-3


def test_a_reset_begins_at_the_origin_of_odom():
    estimator = BodyStateEstimator(ROBOT, update_period=DT)
    observations = [row[0] for row in walk(2.0)]
    for observation in observations:
        estimator.update(observation)
    assert estimator.estimate.position[0] > 0.05
    estimator.reset(observations[0])
    fresh = BodyStateEstimator(ROBOT, update_period=DT).update(observations[0])
    again = estimator.estimate
    for field in dataclasses.fields(fresh):
        assert np.array_equal(getattr(fresh, field.name), getattr(again, field.name)), field.name


def test_settings_are_checked():
    with pytest.raises(InvalidInput, match="foot_noise is -1; it must be greater than 0"):
        BodyStateSettings(foot_noise=-1)


# Simulated walks ----------------------------------------------------------------------------------


def driven(commands, duration, **fields):
    scenario = phasmid.load_scenario("paper").replace(
        robot="phantomx-ax",
        drive="servo",
        measured="everything",
        body_state="estimated",
        duration=duration,
        record_interval_ms=5,
        **fields,
    )
    return phasmid.drive(scenario, None, commands)


def test_a_walk_with_noisy_sensors_drifts_little_and_replays_bit_by_bit():
    """Level ground: walks of 3 m drift by 0.3 % at most, with a velocity error of 6 mm/s."""
    run = driven(Command(velocity=(0.08, 0.0, 0.05)), 6.0)
    found = phasmid.summarise(run)["state_estimate"]
    assert found["position_drift"] < 0.02
    assert found["velocity_error"] < 0.02
    assert run["body_position_estimated"].attrs["units"] == "m"
    assert replay(run).equal


def test_waypoints_are_followed_by_the_estimated_pose():
    """The robot stands where its estimate has reached the place, off by the estimate's error."""
    script = CommandScript(waypoint=[{"x": 0.2, "y": 0.0}])
    run = driven(script, 10.0)
    assert run.attrs["ending"] == "COMPLETED"
    true = run["body_position"].values[:, :2]
    assert np.linalg.norm(true[-1] - true[0] - [0.2, 0.0]) < script.follow.reached + 0.01
