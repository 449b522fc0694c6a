"""Training grounds, the levels of difficulty, and servos that die."""

import mujoco
import numpy as np
import pytest

from phasmid.learning import WalkVectorEnv, load_task
from phasmid.learning.terrain import ground_height, training_terrain


def test_tiles_have_their_largest_sizes_on_the_last_level():
    """Sizes on a straight line from the middle of a tile: rise, steepness, depth and heights."""
    table = load_task("rough").terrain
    terrain = training_terrain(table)
    count = round(table.tile / table.cell)
    last = terrain.heights[-count:].reshape(count, len(table.kinds), count)
    profile = {kind: last[count // 2 :, i, count // 2] for i, kind in enumerate(table.kinds)}
    platform = int(table.platform / table.cell) - 1
    for kind, heights in profile.items():
        assert not heights[:platform].any(), kind
    rises = np.diff(profile["stairs"])
    np.testing.assert_allclose(rises[rises > 1e-9], table.stairs)
    slopes = np.diff(profile["slope"])[platform + 2 :] / table.cell
    np.testing.assert_allclose(slopes, np.tan(table.slope))
    assert np.ptp(profile["waves"]) == pytest.approx(table.waves, rel=0.02)
    width = np.count_nonzero(profile["gaps"] < 0) / np.count_nonzero(np.diff(profile["gaps"]) < 0)
    assert width * table.cell == pytest.approx(table.gaps, abs=table.cell)
    blocks = last[:, table.kinds.index("blocks")]
    assert 0.9 * table.blocks < np.ptp(blocks) <= table.blocks


def test_heights_are_those_of_the_height_field_in_physics():
    """Rays from above hit MuJoCo's triangles; a plane through three of a cell's corners differs
    from our bilinear surface by at most a quarter of the cell's own twist."""
    env = WalkVectorEnv(1, task="rough")
    p = env.physics
    model, data = p.model, mujoco.MjData(p.model)
    mujoco.mj_forward(model, data)
    terrain, rng = p.constants.terrain, np.random.default_rng(0)
    corners = terrain.heights
    twist = np.abs(corners[1:, 1:] + corners[:-1, :-1] - corners[1:, :-1] - corners[:-1, 1:])
    size = np.array(corners.shape) * terrain.cell / 2 - 0.1
    hit = np.zeros(1, np.int32)
    for x, y in rng.uniform(-size, size, (300, 2)):
        # The robot stands at the origin.
        if np.hypot(x, y) < 0.5:
            continue
        down = mujoco.mj_ray(model, data, [x, y, 2.0], [0.0, 0.0, -1.0], None, 1, -1, hit)
        i, j = (np.array([x, y]) / terrain.cell + (np.array(corners.shape) - 1) / 2).astype(int)
        assert ground_height(terrain, x, y) == pytest.approx(2.0 - down, abs=twist[i, j] / 4 + 1e-6)


def test_levels_follow_the_way_that_a_robot_came():
    env = WalkVectorEnv(4, task="rough", autoreset_mode="Disabled")
    env.reset(seed=0, options={"level": [3, 3, 3, 9]})
    e = env.physics.episodes
    e.wanted[:] = 1.0
    e.progress[:] = [0.9, 0.6, 0.4, 0.9]
    _, information = env.reset()
    assert information["level"][:3].tolist() == [4, 3, 2]
    assert 0 <= information["level"][3] <= 9
    e.wanted[:], e.progress[:], e.fell[:] = 1.0, 0.9, True
    _, information = env.reset()
    assert information["level"][:3].tolist() == [3, 2, 1]


@pytest.mark.parametrize("level", [0, 9])
def test_robots_stand_on_the_platform_of_their_tile(level):
    env = WalkVectorEnv(5, task="rough", autoreset_mode="Disabled")
    env.reset(seed=0, options={"level": [level] * 5, "kind": range(5)})
    p = env.physics
    for _ in range(25):
        _, _, fell, _, _ = env.step(np.zeros((5, 18)))
        assert not fell.any()
    np.testing.assert_allclose(p.qpos[:, :2], p.constants.terrain.origins[level], atol=0.02)
    np.testing.assert_allclose(p.qpos[:, 2], p.constants.height, atol=0.02)


@pytest.mark.parametrize("fidelity", ["fast", "full"])
def test_dead_servos_give_no_torque(fidelity):
    """The joints of one leg are limp from the chosen period on, and the foot carries nothing."""
    env = WalkVectorEnv(
        6,
        task="damaged",
        fidelity=fidelity,
        damage={"lost_leg": 1.0, "dead_servo": 0.0, "latest": 0.0},
        autoreset_mode="Disabled",
    )
    env.reset(seed=0, options={"command": np.zeros((6, 3))})
    for _ in range(50):
        _, _, _, _, information = env.step(np.zeros((6, 18)))
    e = env.physics.episodes
    dead = e.dies > 0
    assert (dead.sum(axis=1) == 3).all()
    limit = 0.1 * env.physics.constants.stall
    assert (np.abs(e.torque[dead]) < limit).all()
    leg = dead.reshape(6, 6, 3).all(axis=2)
    assert (leg.sum(axis=1) == 1).all()
    # What is left is the weight of the leg, and friction of 0.045 N·m at an arm of 30 mm or more.
    assert (e.force[leg] < 0.4 * env.physics.robot.mass * 9.81 / 6).all()
    np.testing.assert_array_equal(information["privileged_observation"][:, -18:] > 0, dead)
