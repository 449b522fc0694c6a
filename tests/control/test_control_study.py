"""A few cases of the measurements of docs/control.md keep the limits of the page."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import ground
from pages.control import follow
from phasmid import drive, summarise
from phasmid.control import LocomotionEngine
from phasmid.experiment import Command
from phasmid.kinematics import quaternion_yaw
from phasmid.robot import load_robot
from phasmid.scenario import Scenario
from phasmid.servo import load_servo


@pytest.mark.parametrize(
    ("direction", "ratio"), [((1.0, 0.0, 0.0), 0.9), ((0.0, 0.0, 1.0), 0.5)], ids=["ahead", "turn"]
)
def test_ideal_servos_with_torque_keep_the_commanded_velocity(direction, ratio):
    """The limits of the page: mean velocity within 3 %, slip below 1 mm a step."""
    robot, cycles = load_robot("phantomx-ax"), 2
    engine = LocomotionEngine(robot, gait="tripod", dynamics="feed-forward", ground_sensing=False)
    period = float(engine.reference.period)
    velocity = ratio * np.array(engine.largest_velocity(direction).velocity)
    scenario = Scenario().replace(
        robot=robot,
        drive="ideal-servo",
        duration=math.ceil(10 * (max(1.5, period) + cycles * period)) / 10,
        record_interval_ms=5,
        terrain="flat",
    )
    run = drive(scenario, engine, Command(velocity=tuple(velocity)))
    assert run.attrs["ending"] == "COMPLETED"
    last = run.sel(time=slice(float(run.time[-1]) - cycles * period - 1e-9, None))
    lasts = float(last.time[-1] - last.time[0])
    yaw = np.unwrap(quaternion_yaw(last["body_orientation"].values))
    step = np.diff(last["body_position"].values[:, :2], axis=0)
    forward = np.cos(yaw[:-1]) * step[:, 0] + np.sin(yaw[:-1]) * step[:, 1]
    left = np.cos(yaw[:-1]) * step[:, 1] - np.sin(yaw[:-1]) * step[:, 0]
    mean = np.array([forward.sum(), left.sum(), yaw[-1] - yaw[0]]) / lasts
    # Yaw counts by the speed of the feet, some 0.2 m from the middle.
    scale = np.array([1.0, 1.0, 0.2])
    assert np.linalg.norm(scale * (mean - velocity)) < 0.03 * np.linalg.norm(scale * velocity)
    assert summarise(run)["slip"]["mean"] < 1e-3


def test_random_commands_do_no_harm_in_either_world():
    """No fall, no joint beyond speed or limit, support margin never negative, comes to rest."""
    for world, duration in (("forces-free", 15.0), ("ideal-servo", 11.0)):
        assert follow(world, 0, duration)["faults"] == [], world


@pytest.mark.parametrize("kind", ground.GROUNDS)
def test_every_ground_begins_ahead_of_the_robot_by_its_seed(kind):
    """Level ground up to the start, 220 to 320 mm ahead; larger sizes are not the same ground."""
    row, ahead = ground.GROUNDS[kind], np.linspace(-1, 3, 2000)
    grounds = [ground.scenario_of(kind, size, 0).load_terrain() for size in row.sizes]
    yaw, start = np.random.default_rng([0, 77]).uniform((-20, 220), (20, 320))
    for terrain in grounds:
        assert np.degrees(terrain.yaw) == pytest.approx(yaw)
        heights = terrain.shape.surface(ahead, 0 * ahead)[0]
        assert np.all(heights[ahead < start / 1000] == 0)
    for one, other in pairwise(grounds):
        assert np.any(one.height(ahead, 0 * ahead) != other.height(ahead, 0 * ahead))


def test_stairs_up_and_down_end_on_level_ground():
    terrain = ground.scenario_of("stairs up and down", 40, 1).load_terrain()
    start = terrain.shape.x[0]
    u = start + np.array([-0.01, 0.01, 0.16, 0.44, 0.46, 0.59, 0.61, 3.0])
    heights = terrain.shape.surface(u, 0 * u)[0]
    assert heights == pytest.approx([0, 0.04, 0.08, 0.08, 0.04, 0.04, 0, 0])


def test_a_foot_that_cannot_go_on_stands_on_what_it_has_met():
    """On this ground a robot once stayed for good where a foot had met a block as it rose."""
    scenario = ground.scenario_of("blocks", 60, 4, joints="servo")
    engine = ground.engine_of(scenario.load_robot(), "blocks", ground.BLIND)
    assert not ground.walk(scenario, engine, ground.task_of("blocks", 60))[0].why


@pytest.mark.parametrize(
    ("kind", "size", "lost", "distance"), [("blocks", 40, {3}, 0.6), ("slope", 0, {1, 4}, 0.3)]
)
def test_a_robot_without_legs_walks_on_weak_servos(kind, size, lost, distance):
    robot = replace(load_robot(ground.ROBOT), servo=load_servo("AX-12A"))
    scenario = ground.scenario_of(kind, size, 2, robot, "servo")
    command = Command(velocity=(ground.SPEED, 0.0, 0.0), lost_legs=frozenset(lost))
    task = ground.task_of(kind, size)._replace(distance=distance)
    engine = ground.engine_of(robot, kind, ground.BLIND)
    assert not ground.walk(scenario, engine, task, command)[0].why
