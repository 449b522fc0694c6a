"""A robot that is not told to turn keeps its heading."""

import numpy as np
import pytest

from phasmid.experiment import Command
from phasmid.gait import GAITS
from phasmid.kinematics import quaternion_yaw
from phasmid.motion import plan
from phasmid.robot import load_robot, preset_names
from phasmid.scenario import load_scenario
from phasmid.simulation import drive, simulate

DRIFT = 0.5 / 20.0
"""Largest mean yaw rate that is allowed [deg/s]: half a degree in 20 s."""


def drift(recording, period):
    """Mean yaw rate of the last cycle [deg/s]; within a cycle soft servos let the trunk rock."""
    yaw = np.degrees(np.unwrap(quaternion_yaw(recording["body_orientation"].values)))
    time = recording["time"].values
    before = np.interp(time[-1] - period, time, yaw)
    return (yaw[-1] - before) / period


def scenario_of(robot, **changes):
    """A walk of some 4 s by the usual gait: the first cycle starts it, the second is steady."""
    gait = next(iter(GAITS[len(load_robot(robot).legs)]))
    scenario = load_scenario("paper").for_robot(robot)
    return scenario.replace(gait=gait, record_interval=0.005, **changes)


JOINTS = ["prescribed", "ideal-servo", pytest.param("torque", marks=pytest.mark.slow)]


@pytest.mark.parametrize("joints", JOINTS)
@pytest.mark.parametrize("robot", [name for name in preset_names() if name != "phantomx-paper"])
def test_a_planned_walk_goes_straight(robot, joints):
    scenario = scenario_of(robot, drive=joints)
    scenario = scenario.replace(duration=2 * scenario.build().course.stride.period)
    recording = simulate(scenario, plan(scenario))
    assert abs(drift(recording, scenario.build().course.stride.period)) < DRIFT


@pytest.mark.parametrize("joints", JOINTS)
@pytest.mark.parametrize("robot", ["phantomx-ax", "quadruped", "octopod"])
def test_a_driven_robot_goes_straight(robot, joints):
    scenario = scenario_of(robot, drive=joints)
    scenario = scenario.replace(duration=3 * scenario.build().course.stride.period)
    recording = drive(scenario, commands=Command(velocity=(0.03, 0.0, 0.0)))
    assert abs(drift(recording, scenario.build().course.stride.period)) < DRIFT
