"""The ground estimator as a whole: sensors that fail, lie and return, and never a jump."""

import dataclasses

import numpy as np
import pytest

from phasmid.control.estimation import EstimatorSettings
from phasmid.control.estimation.body_levelling import LEVEL_RATE, SHIFT_RATE
from phasmid.control.estimation.estimator import SAG_LIMIT, GroundEstimator, update_estimates
from phasmid.control.estimation.state import AttitudeSource
from phasmid.control.memory import MEMORY
from phasmid.control.types import STATE, LegPhase
from phasmid.dynamics import leg_torque
from phasmid.errors import InvalidInput
from phasmid.experiment import Observation
from phasmid.kinematics import (
    hip_from_body,
    joint_angles,
    neutral_feet,
    quaternion_rotation,
    rpy_quaternion,
)
from phasmid.robot import load_robot
from phasmid.units import STANDARD_GRAVITY

ROBOT = load_robot("phantomx-mk4")
DT = 0.005
NEUTRAL = neutral_feet(ROBOT)
HEIGHT = -NEUTRAL[:, 2].mean()
Q = joint_angles(ROBOT.arrays, hip_from_body(ROBOT, NEUTRAL))
ALL = np.ones(6, dtype=bool)
TRIPOD = np.array([True, False, True, False, True, False])


class World:
    """A robot that steps on the spot in a tripod, on ground that lies by roll and pitch."""

    def __init__(self, roll=0.0, pitch=0.0):
        self.memory = np.zeros(1, MEMORY)
        self.estimator = GroundEstimator(
            ROBOT, EstimatorSettings(level=1.0), DT, self.memory, STANDARD_GRAVITY
        )
        self.engine = np.zeros(1, STATE)[0]
        self.engine["leg_count"], self.engine["clock"]["gait_running"] = 6, 1
        self.engine["foot"][:6] = NEUTRAL + np.array([0.0, 0.0, HEIGHT])
        self.engine["body_position"][2] = HEIGHT
        self.engine["R_odom_body"], self.engine["q"][:6] = np.eye(3), Q
        self.engine["swing_duration"] = 1.0
        self.slope = roll, pitch
        self.time = 0.0
        self.events, self.track = [], []
        self.estimator.reset(self.observation(ALL))

    def observation(self, down, **changed):
        # A sensor that lives is never quite still.
        tremor = 1e-6 * (self.time / DT % 7)
        q = rpy_quaternion(*(np.array(v) for v in (self.slope[0] + tremor, self.slope[1], 0.0)))
        o = Observation(
            time=self.time,
            joint_position=Q,
            orientation=q,
            angular_velocity=np.zeros(3),
            acceleration=STANDARD_GRAVITY * quaternion_rotation(q)[2],
            contact=down,
            foot_normal_force=np.where(down, 2 * ROBOT.mass * STANDARD_GRAVITY / 6, 0.0),
        )
        return dataclasses.replace(o, **changed)

    def walk(self, steps, change=lambda down: {}):
        """Steps of 0.3 s; a function tells what of the observation is another."""
        for n in range(steps):
            standing = TRIPOD if n % 2 else ~TRIPOD
            for k in range(60):
                self.time += DT
                share = k / 60
                down = standing | (share < 0.03)
                self.engine["leg_phase"][:6] = np.where(standing, LegPhase.STANCE, LegPhase.SWING)
                self.engine["swing_elapsed"] = share
                self.estimator.measure(self.observation(down, **change(down)))
                m = self.memory[0]
                events = update_estimates(
                    self.engine, m["estimator"], m["estimator_parameters"], m["measurements"]
                )
                self.events += self.estimator.describe(events)
                self.track.append(self.correction)

    @property
    def contact(self):
        return self.memory["estimator"]["feet"]["contact"][0, :6]

    @property
    def correction(self):
        """Forward, lateral, rise [m], roll and pitch [rad]."""
        levelling = self.estimator.state.levelling
        return np.array([*levelling.shift, levelling.rise, *levelling.lean])


def test_healthy_sensors_cause_no_event():
    world = World()
    world.walk(6)
    assert world.events == []
    assert set(world.contact) == {0, 1}
    # The tremor of 7e-6 rad at most, and by it no more than the height times it.
    np.testing.assert_allclose(world.correction, 0.0, atol=7e-6)


def leg_torques(down):
    """Static torques of feet that carry twice their share, or nothing."""
    force = np.zeros((6, 3))
    force[:, 2] = np.where(down, 2 * ROBOT.mass * STANDARD_GRAVITY / 6, 0.0)
    still = np.zeros((6, 3))
    return leg_torque(ROBOT.arrays, Q, still, still, foot_force=force, gravity=STANDARD_GRAVITY)


@pytest.mark.parametrize(
    "seen",
    [
        lambda down: {"joint_load": leg_torques(down) / ROBOT.servo.stall_torque},
        # A load of tau turns a servo of stiffness k by tau / k off its target.
        lambda down: {"joint_position": Q - leg_torques(down) / ROBOT.servo.stiffness},
    ],
    ids=["load", "deflection"],
)
def test_contact_without_switches_and_forces_is_detected_by_the_joints(seen):
    world = World()
    none = {"contact": None, "foot_normal_force": None}
    world.estimator.reset(world.observation(ALL, **none, **seen(ALL)))
    world.walk(5, lambda down: none | seen(down))
    np.testing.assert_array_equal(world.contact, np.where(TRIPOD, 0, 1))
    assert world.events == []
    # What compliant legs give way is made up for by raising the body.
    assert 0 <= world.estimator.state.body_sag <= SAG_LIMIT
    assert (world.estimator.state.body_sag > 0) == ("joint_position" in seen(ALL))


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        (lambda down: {"contact": None}, "contact switch of leg right_front sends no readings"),
        (
            lambda down: {"contact": np.ones(6, dtype=bool)},
            "contact switch of leg right_front indicates contact all through swings",
        ),
        (
            lambda down: {"contact": np.zeros(6, dtype=bool)},
            "contact switch of leg right_front never indicates contact",
        ),
    ],
)
def test_switches_that_fail_are_reported_once_and_forces_are_used(fault, sentence):
    world = World()
    world.walk(3)
    world.walk(9, fault)
    assert sum(event.startswith(sentence) for event in world.events) == 1
    # The walk ends in the stance of every second foot.
    np.testing.assert_array_equal(world.contact, np.where(~TRIPOD, 1, 0))


def test_without_any_sensor_the_plan_is_trusted():
    blind = dict.fromkeys(
        ("contact", "foot_normal_force", "orientation", "angular_velocity", "acceleration")
    )
    world = World()
    world.walk(4, lambda down: blind | {"joint_position": np.full((6, 3), np.nan)})
    assert set(world.contact) == {-1}
    assert world.estimator.state.attitude.source == AttitudeSource.NONE
    np.testing.assert_allclose(world.correction, 0.0, atol=1e-15)


def test_no_failure_makes_the_correction_jump():
    """Bounded by its largest speeds, whatever dies, fails or recovers."""
    world = World(0.1, -0.15)
    nothing = np.full(4, np.nan)
    upside_down = np.array([0.0, 1.0, 0.0, 0.0])
    world.walk(8)
    for wrong in (
        {"orientation": None},
        {"orientation": nothing, "acceleration": np.full(3, np.nan)},
        {"orientation": upside_down},
        {"orientation": nothing, "angular_velocity": np.full(3, 1e9)},
        {"orientation": None, "angular_velocity": None, "acceleration": None},
        {},
    ):
        world.walk(4, lambda down, wrong=wrong: wrong)
    assert "no inertial sensor can be trusted; levelling eases out" in world.events
    assert world.events[-1] == "the inertial sensor's orientation is used"
    speed = np.diff(np.array(world.track), axis=0) / DT
    assert np.isfinite(speed).all()
    assert np.hypot(speed[:, 3], speed[:, 4]).max() <= LEVEL_RATE * (1 + 1e-9)
    assert np.hypot(speed[:, 0], speed[:, 1]).max() <= SHIFT_RATE * (1 + 1e-9)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"level": float("nan")}, "level is nan; it must be from 0 to 1."),
        ({"motion_lag": 0.7}, "motion_lag is 0.7 s; it must be at most 127 update periods, 0.635"),
    ],
)
def test_settings_that_cannot_be_are_refused(settings, said):
    with pytest.raises(InvalidInput) as error:
        GroundEstimator(
            ROBOT, EstimatorSettings(**settings), DT, np.zeros(1, MEMORY), STANDARD_GRAVITY
        )
    assert error.value.what.startswith(said)
