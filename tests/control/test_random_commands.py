"""Random commands are followed within all limits and without an abrupt stop."""

import numpy as np
import pytest

from kinematic_world import drive, random_commands
from phasmid.control import Command, LocomotionEngine
from phasmid.robot import load_robot

SETTLING = 8.0


@pytest.fixture(scope="module")
def engine():
    return LocomotionEngine(load_robot("phantomx-ax"))


# Without the reference governor a leg cannot follow, or never comes to rest: poses that change
# during a swing (3, 36), turns during swings that can hardly rise (5, 38), and stance feet that
# are left behind (25).
@pytest.mark.parametrize("seed", [3, 5, 25, 36, 38, 155, 160, 482, 832])
def test_random_commands_are_followed_within_reach_speed_and_balance(engine, seed):
    robot = engine.robot
    commands = random_commands(robot, np.random.default_rng(seed), 22.0)
    commands.append((22.0, Command(gait=commands[-1][1].gait)))
    engine._start()
    seen = drive(engine, commands, 22.0 + SETTLING)
    limits = robot.arrays.joint_limits
    assert (seen.q >= limits[..., 0]).all()
    assert (seen.q <= limits[..., 1]).all()
    assert seen.joint_speed.max() <= robot.servo.no_load_speed
    assert seen.slip < 1e-9
    assert seen.margin.min() > 0
    assert engine.is_standing
    events = " ".join(sentence for _, sentence in seen.events)
    assert "held all" not in events
    assert "braked" not in events
    # The path's velocity is a mean of a reference that changes by the acceleration at most.
    feet = np.array([1.0, 1.0, engine.model.radius])
    change = np.linalg.norm(np.diff(seen.velocity, axis=0) * feet, axis=1)
    assert change.max() <= engine.settings.acceleration * seen.dt * (1 + 1e-9)
