"""A driven controller is told what the scenario's sensors tell, with their faults."""

import math

import numpy as np
import pytest

from phasmid import drive, load_scenario, plan
from phasmid.control import Player
from phasmid.errors import InvalidInput

PAPER = load_scenario("paper").replace(duration=1.0, measured="everything")
WALK = plan(PAPER)
TOLD = {
    "joint_position_measured": "joint_position",
    "joint_load_measured": "joint_load",
    "imu_angular_velocity": "angular_velocity",
    "imu_acceleration": "acceleration",
    "imu_orientation": "orientation",
    "foot_normal_force_measured": "foot_normal_force",
    "contact_measured": "contact",
}


class Listening(Player):
    def __init__(self, motion):
        super().__init__(motion)
        self.seen = []

    def update(self, observation, command):
        self.seen.append(observation)
        return super().update(observation, command)


FAULTS = [
    "left_front.tibia encoder stuck at 0.5031 s",
    "right_middle foot off by 2 N at 0.3 s",
    "gyro off by 0,0,5 deg/s at 0.2 s",
    "accelerometer dead at 0.7 s",
    "orientation off by 5,0,0 deg at 0.4 s",
]


@pytest.mark.parametrize("faults", [[], FAULTS], ids=["sound", "faulty"])
def test_sensors_tell_while_it_runs_what_the_recording_says_they_told(faults):
    listening = Listening(WALK)
    run = drive(PAPER.replace(drive="servo"), listening, faults=faults)
    # At the beginning the robot has stood still, and a load or force is one of the step before.
    for name, field in TOLD.items():
        told = np.stack([getattr(o, field) for o in listening.seen[1:]])
        assert np.array_equal(told, run[name].values[5::5], equal_nan=told.dtype != bool), name
    assert all(o.joint_velocity is None for o in listening.seen)


def test_each_fault_does_what_it_says():
    sound = drive(PAPER, Player(WALK))
    faulty = drive(PAPER, Player(WALK), faults=FAULTS)
    # The player looks at nothing: the same walk, told otherwise.
    assert np.array_equal(sound.body_position, faulty.body_position)
    legs = list(WALK.robot.leg_names)
    front, middle = legs.index("left_front"), legs.index("right_middle")
    angle = faulty.joint_position_measured.values[:, front, 2]
    assert (angle[503:] == angle[503]).all()
    assert np.array_equal(angle[:503], sound.joint_position_measured.values[:503, front, 2])
    more = (faulty.foot_normal_force_measured - sound.foot_normal_force_measured).values[:, middle]
    assert more[300:] == pytest.approx(2.0, abs=1e-12)
    assert not more[:300].any()
    assert faulty.contact_measured.values[300:, middle].all()
    turn = (faulty.imu_angular_velocity - sound.imu_angular_velocity).values[200:]
    assert turn == pytest.approx(np.tile([0, 0, math.radians(5)], (801, 1)), abs=1e-12)
    assert np.isnan(faulty.imu_acceleration.values[700:]).all()
    assert np.isfinite(faulty.imu_acceleration.values[:700]).all()
    dot = np.sum(faulty.imu_orientation.values * sound.imu_orientation.values, axis=1)
    assert 2 * np.arccos(dot[400:]) == pytest.approx(math.radians(5), abs=1e-6)


@pytest.mark.parametrize("kind", ["prescribed", "ideal-servo", "servo"])
def test_a_dead_servos_joint_is_limp(kind):
    listening = Listening(WALK)
    scenario = PAPER.replace(drive=kind, measured="nothing", duration=0.8)
    run = drive(scenario, listening, faults=["right_middle.tibia dead at 0.4 s"])
    leg = list(WALK.robot.leg_names).index("right_middle")
    torque = run.joint_torque.values[:, leg, 2]
    assert np.abs(torque[:400]).max() > 0.1
    # What is left is the servo's own drag, of rotor and gears.
    drag = {"prescribed": 0.0, "ideal-servo": 0.1, "servo": 0.4}[kind]
    assert np.abs(torque[410:]).max() <= drag
    if kind != "prescribed":
        assert not run.servo_motor_torque.values[410:, leg, 2].any()
    running = np.stack([o.servo_running for o in listening.seen])
    assert running[:80].all()
    assert not running[80:, leg, 2].any()
    assert running.sum(axis=(1, 2)).min() == 17


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("right_middle.tibia ded at 5 s", 'a fault is "right_middle.tibia ded at 5 s"; it must be'),
        ("gyroscope dead at 5 s", "it must be what fails, how"),
        ("right_middle.tibia stuck at 5 s", "a servo dead; a sensor dead, stuck or off"),
        ("imu dead at -1 s", "and when"),
        ("imu off by 0,0,1 deg at 1 s", "imu is off by 3 in deg; it must be no amount"),
        ("gyro off by 5 deg/s at 1 s", "gyro is off by 1 in deg/s; it must be 3 in deg/s or rad/s"),
        ("left_front foot off by 2 kg at 1 s", "foot is off by 1 in kg; it must be 1 in N"),
        ("gyro off by 0,0,1.2.3 deg/s at 1 s", "an amount or time is no number"),
        ("right_midle.tibia dead at 1 s", 'phantomx-paper has no "right_midle"'),
        ("right_middle.tibbia dead at 1 s", 'phantomx-paper has no "tibbia"'),
    ],
)
def test_what_is_no_fault_is_refused_before_the_run(text, words):
    with pytest.raises(InvalidInput) as caught:
        drive(PAPER, Player(WALK), faults=[text])
    assert words in caught.value.what
