"""Balls of a planned walk on level ground roll: what touches the ground stands still."""

from dataclasses import replace

import numpy as np
import pytest

from phasmid import load_robot, load_scenario, plan
from phasmid.kinematics import leg_frames

RADIUS = 0.012


def tibia_poses(walk):
    """Poses of all tibiae in the world, shape (N, L, 4, 4)."""
    X_world_body = np.zeros((len(walk.time), 4, 4))
    X_world_body[:, :3, :3], X_world_body[:, :3, 3] = walk.trunk.rotation, walk.trunk.position
    X_world_body[:, 3, 3] = 1
    legs = enumerate(walk.robot.legs)
    return np.stack(
        [X_world_body @ leg.X_body_hip @ leg_frames(leg, walk.q[:, n])[:, 2] for n, leg in legs], 1
    )


@pytest.mark.parametrize(
    ("robot", "changes"),
    [
        ("phantomx-mk4", {}),
        ("phantomx-mk4", {"step_turn_deg": 12, "step_sideways_mm": 10}),
        ("phantomx-mk4", {"gait": "wave", "stance_timing": "constant-speed", "period": 4}),
        ("quadruped", {"gait": "crawl", "period": 6}),
        ("octopod", {"gait": "tetrapod"}),
    ],
)
def test_the_lowest_point_of_each_standing_ball_is_at_rest(robot, changes):
    """Its velocity is that of a point of the tibia, here by differences over 20 µs."""
    robot = replace(load_robot(robot), foot_radius=RADIUS)
    walk = plan(load_scenario("paper").for_robot(robot).replace(**changes))
    rng, half = np.random.default_rng(1), 1e-5
    time = np.sort(rng.uniform(0.01, 2 * walk.experiment.course.stride.period, 200))
    before, now, after = (tibia_poses(walk.sample(time + dt)) for dt in (-half, 0.0, half))
    ends = np.array([[*leg.tibia.end, 1.0] for leg in robot.legs])
    centre = np.einsum("nlij,lj->nli", now, ends)
    touching = centre - [0, 0, RADIUS, 0]
    local = np.linalg.solve(now, touching[..., None])
    moved = ((after - before) @ local)[..., :3, 0] / (2 * half)
    stance = [walk.sample(time + dt).stance for dt in (-half, half)]
    standing = stance[0] & stance[1]
    speed = np.linalg.norm(moved, axis=-1)[standing]
    # A ball that did not roll would slide by its radius times the turn of the tibia, millimetres
    # per second. The spline and the passes leave some hundredths of that.
    sliding = np.linalg.norm((after - before)[..., :3, 0], axis=-1)[standing] / (2 * half) * RADIUS
    assert sliding.max() > 5e-4
    assert speed.max() < 0.03 * sliding.max()
    np.testing.assert_allclose(centre[..., 2][standing], RADIUS, atol=1e-9)


def test_points_do_not_roll():
    robot = load_robot("phantomx-mk4")
    scenario = load_scenario("paper").for_robot(robot)
    tiny = scenario.replace(robot=replace(robot, foot_radius=1e-9))
    np.testing.assert_allclose(plan(tiny).q, plan(scenario).q, atol=1e-6)
