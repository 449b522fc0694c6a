"""Robots on balls: feet are the centres, and the trunk stands over the true ground."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from phasmid.experiment import Command
from phasmid.kinematics import body_height
from phasmid.motion import plan
from phasmid.reporting.numbers import contact_displacement
from phasmid.reporting.run import read_run
from phasmid.robot import load_robot
from phasmid.scenario import load_scenario
from phasmid.simulation import drive, simulate
from phasmid.simulation.contact import FootGround
from phasmid.simulation.model import build_model
from phasmid.simulation.start import standing

RADIUS = 0.015
BALLS = replace(load_robot("phantomx-ax"), foot_radius=RADIUS)
SCENARIO = load_scenario("paper").for_robot(BALLS).replace(duration=2.0)
SLOPE = {"terrain": "slope", "slope_deg": 12}


def still(**changes):
    """A run of the robot that stands still on all feet, without moving joints."""
    scenario = SCENARIO.replace(step_length_mm=0, step_height_mm=0.001, **changes)
    return scenario, simulate(scenario, plan(scenario))


def sink(scenario):
    """Depth of the springs of all feet under the weight [m]."""
    stiffness = 4 * len(BALLS.legs) * scenario.build().world.contact.stiffness
    return BALLS.mass * scenario.model.gravity / stiffness


@pytest.mark.parametrize("law", ["spring-damper", "simscape"])
def test_a_standing_trunk_is_its_height_over_the_balls_and_their_radius_up(law):
    """The springs give way by at most the weight on half of the feet, as legs lift in turn."""
    scenario, recording = still(contact_law=law)
    feet = recording["foot_position"].values[..., 2]
    trunk = recording["body_position"].values[:, 2]
    low = 3 * sink(scenario)
    assert body_height(BALLS) - low < trunk.min() <= trunk.max() < body_height(BALLS)
    assert RADIUS - low < feet.min()
    assert np.abs(trunk - feet.mean(axis=1) - body_height(BALLS) + RADIUS).max() < 1e-4


@pytest.mark.parametrize("ground", [SLOPE, {"terrain": "waves"}, {"terrain": "rough"}])
def test_the_plan_places_the_centres_a_radius_from_the_ground(ground):
    """Along the normal on a slope; on curved ground within its curvature over a ball."""
    scenario = SCENARIO.replace(step_length_mm=40, planned_on="terrain", **ground)
    walk, terrain = plan(scenario), scenario.load_terrain()
    feet = walk.foot_position[walk.stance]
    touching = feet - RADIUS * terrain.normal(feet[:, 0], feet[:, 1])
    off = np.abs(touching[:, 2] - terrain.height(touching[:, 0], touching[:, 1])).max()
    assert off < (1e-12 if ground is SLOPE else 5e-4)


def test_the_trunk_of_a_level_plan_is_that_of_points_a_radius_higher():
    ours = plan(SCENARIO)
    points = plan(SCENARIO.replace(robot=replace(BALLS, foot_radius=0.0)))
    np.testing.assert_allclose(ours.foot_position[ours.stance][:, 2], RADIUS, rtol=0, atol=1e-9)
    raised = ours.trunk.position - points.trunk.position
    np.testing.assert_allclose(raised, np.tile([0, 0, RADIUS], (len(raised), 1)), atol=1e-15)


def test_contact_planes_lie_beneath_the_balls_on_curved_ground():
    """The engine's distance from ball to plane is that from the centre to the ground, less the
    radius; curvature changes it by less than 0.1 mm."""
    scenario = SCENARIO.replace(terrain="waves")
    model = build_model(scenario)
    data = mujoco.MjData(model)
    ground = scenario.load_terrain()
    data.qpos[:3] = 0.5, 0.1, body_height(BALLS)
    data.qpos[7:] = plan(SCENARIO).q[0].ravel()
    FootGround(model, data, BALLS, ground).update()
    for leg in BALLS.legs:
        centre = data.site(f"{leg.name}.foot").xpos
        around = centre[:2] + 0.02 * np.random.default_rng(1).uniform(-1, 1, (20_000, 2))
        points = np.column_stack([around, ground.height(*around.T)])
        nearest = np.linalg.norm(points - centre, axis=1).min()
        plane = model.geom(f"{leg.name}.ground")
        normal = np.empty(9)
        mujoco.mju_quat2Mat(normal, plane.quat)
        distance = abs((centre - plane.pos) @ normal.reshape(3, 3)[:, 2])
        assert distance == pytest.approx(nearest, abs=1e-4)


def test_a_robot_starts_with_its_balls_on_a_slope():
    scenario = SCENARIO.replace(**SLOPE)
    pose = standing(scenario.build())
    start = pose.sample(np.zeros(1))
    feet, ground = start.foot_position[0], scenario.load_terrain()
    over = feet @ ground.normal(np.zeros(1), np.zeros(1))[0]
    np.testing.assert_allclose(over, RADIUS, rtol=0, atol=1e-9)


@pytest.mark.parametrize("ground", [{}, SLOPE])
def test_a_driven_robot_on_balls_stands_and_walks_at_its_height(ground):
    """The controller knows of no radius but that of the ground points; the trunk stays over it."""
    scenario = SCENARIO.replace(drive="ideal-servo", duration=3.0, **ground)
    recording = drive(scenario, commands=Command(velocity=(0.03, 0.0, 0.0)))
    assert recording.attrs["ending"] == "COMPLETED"
    position = recording["body_position"].values
    terrain = scenario.load_terrain()
    n = terrain.normal(np.zeros(1), np.zeros(1))[0]
    points = replace(BALLS, foot_radius=0.0)
    same = drive(scenario.replace(robot=points), commands=Command(velocity=(0.03, 0.0, 0.0)))
    higher = (position - same["body_position"].values) @ n
    # Servos give way alike; the start on a slope differs by less than a millimetre.
    assert np.abs(higher - RADIUS).max() < 1.5e-3


def test_friction_opposes_the_points_that_touch_and_not_the_centres():
    """Below the friction limit the contact is a damper: its force is against the slip."""
    recording = simulate(SCENARIO, plan(SCENARIO))
    run = read_run(recording)
    feet, force = recording["foot_position"].values, recording["foot_force"].values
    both = np.logical_and.reduce(
        [recording["contact"].values[k : len(feet) - 1 + k] for k in (0, 1)]
    )
    both &= recording["stance"].values[1:] & recording["stance"].values[:-1]
    pull = -force[1:][both][:, :2]

    def agreement(moved):
        moved = moved[both][:, :2]
        return np.sum(moved * pull) / (np.linalg.norm(moved) * np.linalg.norm(pull))

    assert agreement(contact_displacement(run, feet)) > 0.95
    assert agreement(np.diff(feet, axis=0)) < 0.6


def test_a_robot_on_balls_gets_up_from_its_belly():
    """The trunk rises from the ground, and ends a neutral height over the centres of its balls."""
    scenario = SCENARIO.replace(drive="ideal-servo", start_posture="packed", duration=12.0)
    recording = drive(scenario, commands=Command())
    assert recording.attrs["ending"] == "COMPLETED"
    height = recording["body_position"].values[:, 2]
    lying = BALLS.body.size[2] / 2
    assert height[0] == pytest.approx(lying, abs=1e-3)
    assert height[-1] == pytest.approx(body_height(BALLS), abs=3e-3)
