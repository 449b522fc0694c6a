"""A policy of command corrections: the locomotion controller walks, its commands are changed."""

import numpy as np
import pytest

from phasmid.control import LocomotionEngine
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, JointTargets
from phasmid.learning import PolicyController, WalkEnv, WalkVectorEnv, export_task, load_task
from phasmid.learning.corrections import corrected, motor_goals
from phasmid.learning.task import CORRECTIONS
from phasmid.scenario import Scenario
from phasmid.simulation.drive import drive

TASK = load_task("corrections")


def constant(*action):
    """A policy that returns one action."""
    return lambda observations: np.array([action])


def test_each_correction_changes_one_field_by_its_scale():
    command = Command(velocity=(0.05, -0.02, 0.1), pose=(0, 0, 0.01, 0, 0.02, 0))
    scale = TASK.corrections
    x, y, z, roll, pitch, yaw = command.pose
    expected = {
        "speed": {"velocity": tuple((1 - scale.speed / 2) * v for v in command.velocity)},
        "step_height": {"step_height": TASK.gait.step_height - scale.step_height / 2},
        "forward": {"pose": (x - scale.forward / 2, y, z, roll, pitch, yaw)},
        "height": {"pose": (x, y, z - scale.height / 2, roll, pitch, yaw)},
        "roll": {"pose": (x, y, z, roll - scale.roll / 2, pitch, yaw)},
        "pitch": {"pose": (x, y, z, roll, pitch - scale.pitch / 2, yaw)},
    }
    same = corrected(command, np.zeros(6), TASK)
    assert (same.velocity, same.pose, same.step_height) == (command.velocity, command.pose, 0.03)
    assert set(expected) == set(CORRECTIONS)
    for i, name in enumerate(CORRECTIONS):
        result = corrected(command, -0.5 * np.eye(6)[i], TASK)
        for field in ("velocity", "pose", "step_height"):
            wanted = expected[name].get(field, getattr(same, field))
            assert getattr(result, field) == pytest.approx(wanted, abs=1e-12), (name, field)


def test_without_corrections_the_locomotion_controller_walks_bit_for_bit():
    scenario = Scenario().replace(robot="phantomx-ax", drive="servo", duration=1.5)
    command = Command((0.05, 0.0, 0.0))
    gait = TASK.gait
    engine = LocomotionEngine(
        scenario.load_robot(), period=gait.period, step_height=gait.step_height
    )
    alone = drive(scenario, engine, command)
    policy = PolicyController(constant(0, 0, 0, 0, 0, 0), scenario.load_robot(), TASK)
    same = drive(scenario, policy, command)
    for name in ("joint_position", "joint_torque", "gait_phase"):
        np.testing.assert_array_equal(alone[name], same[name])
    raised = PolicyController(constant(0, 1, 0, 0, 0, 0), scenario.load_robot(), TASK)
    other = drive(scenario, raised, command)
    # Feet lift 25 mm higher than by the gait, less what soft servos give away.
    lift = [float(run["foot_position"].values[..., 2].max()) for run in (alone, other)]
    assert 0.015 < lift[1] - lift[0] < 0.03


def test_goals_of_a_fast_motor_give_the_torque_at_its_target():
    """At its target the motor's torque less friction and damping is the feed-forward torque."""
    motor = WalkVectorEnv(1, task=TASK).physics.motor
    speed, torque = np.full((6, 3), 0.5), np.full((6, 3), -0.2)
    q = np.zeros((6, 3))
    push = motor.gain * (motor_goals(JointTargets(q, speed, torque), motor) - q)
    wanted = torque + motor.damping * speed
    loss = motor.friction + motor.load_loss * np.abs(wanted)
    np.testing.assert_allclose(push - motor.damping * speed - loss, torque, atol=1e-12)


@pytest.mark.parametrize("fidelity", ["fast", "full"])
def test_a_batch_equals_single_robots_and_walks_as_commanded(fidelity):
    """Robot i has the seed s + i. Uncorrected robots walk at 90 to 110 % of the command."""
    changes = {"task": TASK, "fidelity": fidelity, "terrain": {"kinds": ()}}
    batch = WalkVectorEnv(2, threads=2, autoreset_mode="Disabled", **changes)
    command = np.array([[0.06, 0.0, 0.0], [0.0, 0.04, 0.1]])
    rows = []
    batch.reset(seed=7, options={"command": command})
    for _ in range(30):
        observation, *_ = batch.step(np.zeros((2, 6)))
        rows.append(observation)
    e = batch.physics.episodes
    assert (np.abs(e.progress / e.wanted - 1) < 0.1).all()
    # After a reset no state of the walk before is left.
    alone = WalkEnv(**changes)
    for _ in range(2):
        alone.reset(seed=8, options={"command": command[1]})
        for k in range(8):
            np.testing.assert_array_equal(alone.step(np.zeros(6))[0], rows[k][1])


def test_what_does_not_fit_is_refused_in_one_sentence(tmp_path):
    with pytest.raises(InvalidInput, match=r"rate is 50; .* a multiple of 8 ms"):
        WalkVectorEnv(1, task=TASK, rate=50.0)
    with pytest.raises(InvalidInput, match="only tasks with joint offsets are exported"):
        export_task(TASK, tmp_path)
