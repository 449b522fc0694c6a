"""A few cases of the studies of docs/control.md keep the limits of the page."""

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

SCRIPTS = [str(Path(__file__).parents[2] / folder) for folder in ("benchmarks", "tools")]
sys.path += SCRIPTS

from control_study import damage, sequences, velocity  # noqa: E402

import ground  # noqa: E402, needs the path above

# Scripts there have the names of packages of tests.
del sys.path[-len(SCRIPTS) :]

FEW = [
    ("tripod", "0°", (1.0, 0.0, 0.0), 0.9),
    ("tripod", "turn left", (0.0, 0.0, 1.0), 0.5),
]


@pytest.mark.parametrize(("gait", "way", "direction", "share"), FEW)
def test_ideal_servos_with_torque_keep_the_commanded_velocity(gait, way, direction, share):
    """The goals of the page: |mean - commanded| <= 3 % of it, slip under 1 mm a step."""
    found = velocity.measure(gait, way, direction, share, "ideal, with torque")
    assert found["ending"] == "COMPLETED"
    assert found["error"] < velocity.ERROR
    assert found["slip_mean"] < velocity.SLIP


def test_random_commands_do_no_harm_in_either_world():
    """No fall, no joint beyond speed or limit, support margin never negative, comes to rest."""
    for world, duration in (("forces-free", 15.0), ("ideal-servo", 11.0)):
        assert sequences.measure(world, 0, duration)["wrong"] == [], world


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


def test_two_legs_of_one_side_cannot_be_spared_and_two_opposite_ones_can():
    """Without both ends of a side its middle leg cannot lift: the others reach past the mass."""
    assert len(damage.PAIRS) == 9
    assert damage.largest_margin((1, 3)) < 0 < damage.largest_margin((1, 4))


@pytest.mark.parametrize(("kind", "size", "lost"), [("blocks", 40, [3]), ("slope", 0, [1, 4])])
def test_a_robot_without_legs_walks_on_weak_servos(kind, size, lost):
    assert damage.measure(kind, size, lost, "AX-12A", 2)["passed"]
