"""A batch of engines moves each robot as an engine alone does."""

import numpy as np
import pytest

from phasmid import load_robot
from phasmid.control import Command, EngineBatch, LocomotionEngine, Observation
from phasmid.errors import InvalidInput

ROBOT = load_robot("phantomx-ax")
DT = 0.005


def observation(time, engine):
    """Observe feet that touch a level ground exactly as planned."""
    return Observation(
        time,
        engine.state.q.copy(),
        contact=engine.state.foot[:, 2] < 1e-4,
        orientation=np.array([1.0, 0.0, 0.0, 0.0]),
        angular_velocity=np.zeros(3),
        acceleration=np.array([0.0, 0.0, 9.81]),
    )


def test_robots_of_a_batch_move_as_alone():
    """Equal to the last bit: both run the same compiled update on records of their own."""
    batch = EngineBatch(ROBOT, 5, threads=2)
    alone = [LocomotionEngine(ROBOT) for _ in batch.engines]
    for engine in (*batch.engines, *alone):
        engine.reset(observation(0.0, engine))
    commands = [Command(velocity=(0.01 * i, 0.01, 0.05 * i)) for i in range(5)]
    for k in range(1, 300):
        seen = [observation(k * DT, engine) for engine in batch.engines]
        together = batch.update(seen, commands)
        for engine, command, targets in zip(alone, commands, together, strict=True):
            expected = engine.update(observation(k * DT, engine), command)
            assert np.array_equal(targets.position, expected.position)
            assert np.array_equal(targets.velocity, expected.velocity)
            assert np.array_equal(targets.torque, expected.torque)
    assert [engine.events for engine in batch.engines] == [engine.events for engine in alone]
    # They have walked, each at its own velocity.
    assert len({engine.state.path[2] for engine in alone}) == 5


def test_a_batch_of_nothing_is_refused_in_a_sentence():
    with pytest.raises(InvalidInput, match=r"count is 0; it must be 1 or more\."):
        EngineBatch(ROBOT, count=0)
