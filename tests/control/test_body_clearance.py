"""A pose does not lay the trunk on the ground."""

import math

import numpy as np
import pytest

from phasmid.control import Command, Observation
from phasmid.control.body_clearance import LEAST, BodyClearance
from phasmid.control.engine import LocomotionEngine
from phasmid.robot import load_robot

ROBOT = load_robot("phantomx-ax")
LENGTH, WIDTH, HEIGHT = ROBOT.body.size
HIGH = 0.15


def test_the_lowest_corner_of_a_pose():
    """By the geometry of a box that is turned about one axis, and lowered."""
    trunk = BodyClearance(ROBOT, HIGH)
    assert trunk.clearance(np.zeros(6)) == pytest.approx(HIGH - HEIGHT / 2)
    pitched = HIGH - 0.01 - HEIGHT / 2 * math.cos(0.3) - LENGTH / 2 * math.sin(0.3)
    assert trunk.clearance(np.array([0.0, 0.0, -0.01, 0.0, 0.3, 0.5])) == pytest.approx(pitched)
    rolled = HIGH - HEIGHT / 2 * math.cos(0.2) - WIDTH / 2 * math.sin(0.2)
    assert trunk.clearance(np.array([0.1, 0.0, 0.0, -0.2, 0.0, 0.0])) == pytest.approx(rolled)


def test_as_much_of_a_pose_as_keeps_the_trunk_above_the_ground():
    """Straight down it is (clearance now - least) over the way, to within 2^-12 of it."""
    trunk, down = BodyClearance(ROBOT, HIGH), np.array([0.0, 0.0, -0.2, 0.0, 0.0, 0.0])
    share = (HIGH - HEIGHT / 2 - LEAST) / 0.2
    assert share - 2**-12 <= trunk.feasible_pose_scale(np.zeros(6), down)[0] <= share
    assert trunk.feasible_pose_scale(np.zeros(6), down / 4)[0] == 1.0
    # Where it is too low without the pose, it may not be lower.
    low = BodyClearance(ROBOT, HEIGHT / 2 + LEAST / 2)
    assert low.feasible_pose_scale(np.zeros(6), down)[0] == 0.0
    assert low.feasible_pose_scale(np.zeros(6), -down)[0] == 1.0


def test_the_engine_lowers_the_body_no_farther_than_to_its_clearance():
    """Low and tilted, each of which alone the legs and the ground allow."""
    engine = LocomotionEngine(ROBOT, ground_sensing=False, dynamics="none")
    q = engine.state.q.copy()
    command = Command(pose=(0.0, 0.0, -0.0568, -0.311, 0.3745, -0.4686))
    for k in range(600):
        engine.update(Observation(time=0.005 * k, joint_position=q), command)
    assert any("too near to the ground" in sentence for _, sentence in engine.events)
    trunk = BodyClearance(ROBOT, engine.model.height)
    assert trunk.clearance(np.array(command.pose)) < 0.0
    assert trunk.clearance(engine.state.pose_filter[3]) >= LEAST - 1e-6
    assert trunk.clearance(engine.state.pose_filter[3]) < LEAST + 0.002
