"""The environments keep Gymnasium's contract; robots of a batch do not influence one another."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from phasmid import load_robot, save_robot
from phasmid.errors import InvalidInput
from phasmid.learning import Task, WalkEnv, WalkVectorEnv, load_task, task_names
from phasmid.robot import robot_to_toml

NAMES = [f"Phasmid/{name.capitalize()}-v0" for name in task_names()]


def random_actions(count, steps, seed=0, joints=18):
    return np.random.default_rng(seed).uniform(-1, 1, (steps, count, joints)).astype(np.float32)


def history(env, actions, seed):
    observation, _ = env.reset(seed=seed)
    rows = [(observation, 0.0, False, False)]
    for action in actions:
        *row, information = env.step(action)
        rows.append((*row, information["command"], information["privileged_observation"]))
    return rows


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.filterwarnings("ignore:.*obs space.*infinity:UserWarning")
@pytest.mark.filterwarnings("ignore:.*A Box observation space:UserWarning")
def test_gymnasium_finds_nothing_wrong_with_one_robot_and_a_batch(name):
    check_env(gymnasium.make(name).unwrapped, skip_render_check=True)
    env = gymnasium.make_vec(name, num_envs=3)
    observations, _ = env.reset(seed=0)
    assert observations in env.observation_space
    env.action_space.seed(0)
    observations, rewards, fell, over, information = env.step(env.action_space.sample())
    assert observations in env.observation_space
    assert rewards.shape == fell.shape == over.shape == (3,)
    names = env.unwrapped.observation_names
    assert len(set(names)) == len(names) == env.single_observation_space.shape[0]
    privileged = env.unwrapped.privileged_observation_space
    assert information["privileged_observation"][0] in privileged
    assert len(env.unwrapped.privileged_names) == privileged.shape[0]


@pytest.mark.parametrize("fidelity", ["fast", "full"])
def test_a_batch_equals_single_robots_bit_for_bit_at_any_number_of_threads(fidelity):
    """Robot i has the seed s + i; all numbers are equal, with every kind of randomisation."""
    changes = {
        "fidelity": fidelity,
        "duration": 0.5,
        "randomisation": {
            "friction": (0.4, 1.2),
            "mass": 0.1,
            "payload": 0.2,
            "centre_of_mass": 0.01,
            "strength": 0.1,
            "gain": 0.1,
            "latency": 0.02,
            "joint_offset": 0.02,
            "joint_noise": 0.01,
            "gyro_noise": 0.1,
            "gravity_noise": 0.02,
            "push": 0.2,
            "push_interval": 0.1,
        },
    }
    count, actions = 5, random_actions(5, 20)
    batches = [
        history(
            WalkVectorEnv(count, threads=threads, autoreset_mode="Disabled", **changes), actions, 3
        )
        for threads in (1, 2)
    ]
    for first, second in zip(*batches, strict=True):
        for a, b in zip(first, second, strict=True):
            np.testing.assert_array_equal(a, b)
    for n in range(count):
        alone = history(WalkEnv(**changes), actions[:, n], 3 + n)
        for single, batch in zip(alone[1:], batches[0][1:], strict=True):
            for a, b in zip(single, batch, strict=True):
                np.testing.assert_array_equal(a, b[n])


def test_resets_follow_the_three_modes():
    """An episode of ten periods ends by time; the next one begins as the mode says."""
    actions, ended = np.zeros((15, 2, 18), np.float32), {}
    for mode in AutoresetMode:
        env = WalkVectorEnv(2, duration=0.2, autoreset_mode=mode)
        env.reset(seed=0)
        rows = [env.step(action) for action in actions]
        ended[mode] = [row[3][0] for row in rows]
        assert not any(row[2].any() for row in rows)
        if mode is AutoresetMode.SAME_STEP:
            # The step that ends an episode returns the first observation of the next.
            final = rows[9][4]["final_obs"]
            assert not np.array_equal(final, rows[9][0])
            assert rows[9][4]["_final_obs"].all()
            assert env.physics.episodes.step[0] == 5
        if mode is AutoresetMode.NEXT_STEP:
            assert rows[10][1].tolist() == [0, 0]
            assert env.physics.episodes.step[0] == 4
    assert np.flatnonzero(ended[AutoresetMode.SAME_STEP]).tolist() == [9]
    assert np.flatnonzero(ended[AutoresetMode.NEXT_STEP]).tolist() == [9]
    assert np.flatnonzero(ended[AutoresetMode.DISABLED]).tolist() == [9, 10, 11, 12, 13, 14]


def test_a_reset_after_the_end_of_an_episode_begins_one_episode():
    env = WalkVectorEnv(1, duration=0.1)
    env.reset(seed=0)
    for _ in range(5):
        over = env.step(np.zeros((1, 18)))[3]
    assert over.all()
    env.reset()
    env.step(np.zeros((1, 18)))
    # A second automatic reset would leave no period behind.
    assert env.physics.episodes.step.tolist() == [1]


def test_chosen_robots_begin_anew_with_chosen_commands():
    env = WalkVectorEnv(3, autoreset_mode="Disabled")
    env.reset(seed=0)
    for action in random_actions(3, 4):
        env.step(action)
    before = env.physics.qpos.copy()
    command = np.array([[0.1, 0.0, 0.0]] * 3)
    _, information = env.reset(options={"reset_mask": [False, True, False], "command": command})
    changed = (env.physics.qpos != before).any(axis=1)
    assert changed.tolist() == [False, True, False]
    assert information["command"][1].tolist() == [0.1, 0.0, 0.0]
    _, information = WalkEnv().reset(seed=0, options={"command": (0.0, 0.05, 0.0)})
    assert information["command"].tolist() == [0.0, 0.05, 0.0]


@pytest.mark.parametrize("robot", ["quadruped", "octopod"])
def test_robots_with_four_and_eight_legs_stand(robot):
    """At zero actions the joints hold the neutral stance, from which no robot falls."""
    env = WalkVectorEnv(2, robot=robot, duration=2.0)
    env.reset(seed=0)
    for _ in range(100):
        assert not env.step(np.zeros(env.action_space.shape))[2].any()


def test_latest_observations_come_first_in_a_history():
    plain = WalkVectorEnv(2, autoreset_mode="Disabled")
    long = WalkVectorEnv(2, observation={"history": 3}, autoreset_mode="Disabled")
    width = plain.single_observation_space.shape[0]
    first, _ = plain.reset(seed=0)
    stacked, _ = long.reset(seed=0)
    np.testing.assert_array_equal(stacked, np.tile(first, 3))
    seen = [first] * 3
    for action in random_actions(2, 4):
        seen.insert(0, plain.step(action)[0])
        np.testing.assert_array_equal(long.step(action)[0], np.hstack(seen[:3]))
    assert long.single_observation_space.shape == (3 * width,)


def test_a_tenth_of_the_commands_is_zero():
    """Binomial: of 4,000 commands 400 ± 19 are zero; the bound is five standard deviations."""
    env = WalkVectorEnv(4000)
    _, information = env.reset(seed=0)
    command, table = information["command"], load_task("walk").commands
    zero = (command == 0).all(axis=1).sum()
    assert abs(zero - 400) < 95
    assert (np.abs(command) <= [table.forward, table.left, table.yaw]).all()
    single = ((command != 0).sum(axis=1) == 1).sum()
    assert abs(single - 1600) < 155


def test_a_robot_is_a_file_of_any_format_or_an_object(tmp_path):
    """The environments of a file, and of the robot that is read from it, are one."""
    save_robot(load_robot("quadruped"), tmp_path / "mine.xml")
    by_file = WalkEnv(robot=str(tmp_path / "mine.xml"))
    by_object = WalkEnv(robot=load_robot(tmp_path / "mine.xml"))
    actions = random_actions(1, 3, joints=12)[:, 0]
    for ours, theirs in zip(
        *(history(env, actions, 0) for env in (by_file, by_object)), strict=True
    ):
        assert (ours[0] == theirs[0]).all()
    task = load_task().replace(robot=load_robot("quadruped"), rate=40.0)
    assert task.robot.name == "quadruped"
    again = Task.model_validate_json(task.model_dump_json()).robot
    assert robot_to_toml(again) == robot_to_toml(task.robot)


@pytest.mark.parametrize("action", [np.zeros(17), np.zeros((1, 18)), None, "x", 0.0])
def test_an_action_of_another_shape_is_refused_in_a_sentence(action):
    """In place of an error of a compiled function."""
    env = WalkEnv()
    env.reset(seed=0)
    with pytest.raises(InvalidInput, match=r"^action (is|has shape) .*; it must"):
        env.step(action)
