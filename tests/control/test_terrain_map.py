"""The height map around the robot: fusion, edges, wrapped cells, rotation and sources."""

import math

import numpy as np
import pytest

from phasmid.control import LocomotionEngine
from phasmid.control.estimation import EstimatorSettings
from phasmid.control.terrain_map import (
    CELL,
    CELLS,
    CONFIRMED,
    FOOT_RADIUS,
    LEAST_NOISE,
    TERRAIN_MAP,
    TerrainMapView,
    add_foothold,
    add_points,
    clear_map,
    map_height,
    map_variance,
    recentre,
    rotate_map,
)
from phasmid.control.types import LegPhase
from phasmid.control.vectors import rotation
from phasmid.errors import InvalidInput
from phasmid.experiment import Command, Observation
from phasmid.kinematics import joint_angles, neutral_feet
from phasmid.robot import load_robot
from phasmid.scenario import Scenario
from phasmid.simulation.sensors.depth import DepthSensor

ROBOT = load_robot("phantomx-mk4")
NOISE = (0.01, 0.01, LEAST_NOISE)
LEVEL = np.eye(3)


class Map:
    """A map and its functions."""

    def __init__(self):
        self.records = np.zeros(1, TERRAIN_MAP)
        clear_map(self.records)
        self.record = self.records.view(np.recarray)[0]
        self.view = TerrainMapView(self.records, lambda: 0.0)

    def add(self, points, R=LEVEL, p=(0.0, 0.0, 0.0), time=0.0):
        points = np.array(points, dtype=float).reshape(-1, 3)
        add_points(self.records[0], points, R, np.array(p), NOISE, time)

    def height(self, x, y):
        return map_height(self.record, x, y)


def lattice(step=0.01, half=0.45):
    x = np.arange(-half, half, step) + 0.3 * step
    return (w.ravel() for w in np.meshgrid(x, x))


def test_top_of_a_cell_counts_and_its_noise_is_averaged():
    """Of points at 0 and 30 mm in one cell those at the top count, by their mean."""
    terrain_map = Map()
    terrain_map.add([[0.102, 0.0, 0.0], [0.104, 0.0, 0.031], [0.106, 0.0, 0.029]])
    assert terrain_map.height(0.105, 0.005) == pytest.approx(0.03)
    assert math.isnan(terrain_map.height(0.125, 0.005))


def test_a_cell_is_a_kalman_filter():
    """Equal readings with variance v: v / 2 after two, at the variance-weighted mean."""
    terrain_map = Map()
    terrain_map.add([0.3, 0.0, -0.1])
    first = map_variance(terrain_map.record, 0.3, 0.0)
    # Range along the depth, attitude across the distance, and the least noise.
    assert first == pytest.approx(0.001**2 + 0.003**2 + LEAST_NOISE**2)
    terrain_map.add([0.3, 0.0, -0.098])
    assert terrain_map.height(0.3, 0.0) == pytest.approx(-0.099, abs=1e-4)
    assert map_variance(terrain_map.record, 0.3, 0.0) == pytest.approx(first / 2, rel=0.01)


def test_contradictions_replace_a_height():
    """A higher one at once; a lower one after the time for which an edge resists."""
    terrain_map = Map()
    terrain_map.add([0.1, 0.0, 0.0])
    terrain_map.add([0.1, 0.0, 0.05], time=0.05)
    assert terrain_map.height(0.1, 0.0) == 0.05
    terrain_map.add([0.1, 0.0, 0.0], time=0.05 + 0.5 * CONFIRMED)
    assert terrain_map.height(0.1, 0.0) == 0.05
    terrain_map.add([0.1, 0.0, 0.0], time=0.05 + 1.1 * CONFIRMED)
    assert terrain_map.height(0.1, 0.0) == 0.0
    # A foot that stands there is sure.
    terrain_map.add([0.1, 0.0, 0.05], time=1.0)
    add_foothold(terrain_map.record, 0.1, 0.0, 0.01, FOOT_RADIUS, 1.01)
    assert terrain_map.height(0.1, 0.0) == 0.01


def test_holes_are_interpolated_and_edges_are_not():
    """Between 0 and 6 mm in cells 10 and 13 lie 2 and 4 mm; nothing between 0 and 60 mm."""
    terrain_map = Map()
    terrain_map.add([[0.105, 0.005, 0.0], [0.135, 0.005, 0.006]])
    heights = [terrain_map.height(0.105 + CELL * k, 0.005) for k in range(4)]
    np.testing.assert_allclose(heights, [0.0, 0.002, 0.004, 0.006], atol=1e-12)
    assert math.isnan(terrain_map.view.age[CELLS // 2 + 11, CELLS // 2])
    assert map_variance(terrain_map.record, 0.115, 0.005) > 0.01**2
    terrain_map.add([[0.105, 0.105, 0.0], [0.135, 0.105, 0.06]])
    assert math.isnan(terrain_map.height(0.115, 0.105))


@pytest.mark.parametrize("way", [(0.137, -0.052), (-0.31, 0.44), (3.0, 0.0), (-0.95, 0.2)])
def test_recentring_keeps_what_stays_and_forgets_the_rest(way):
    """A cell is known afterwards if and only if both squares contain it, at the same place."""
    terrain_map = Map()
    view = terrain_map.view
    x, y = (w.ravel() for w in np.meshgrid(view.x, view.y, indexing="ij"))
    terrain_map.add(np.column_stack([x, y, np.sin(7 * x) + np.cos(5 * y)]))
    recentre(terrain_map.record, np.array([*way, 0.1]), 0.0)
    x, y, height, _, _ = view.arrays()
    old = (np.abs(x) < CELL * CELLS / 2) & (np.abs(y) < CELL * CELLS / 2)
    assert np.array_equal(np.isfinite(height), old)
    np.testing.assert_allclose(height[old], (np.sin(7 * x) + np.cos(5 * y))[old], atol=1e-12)
    # The body's cell is the first of the second half.
    assert view.x[CELLS // 2] == pytest.approx(CELL * (math.floor(way[0] / CELL) + 0.5))


def test_rotation_equals_measuring_again():
    """Heights after a rotation by R are those of points measured with R times the attitude.

    The shear neglects the horizontal motion of level ground, depth · angle, which changes heights
    by angle² · depth; cells resolve a place to CELL, heights to angle · CELL along each axis.
    """
    angle, depth = 0.02, 0.12
    x, y = lattice()
    points = np.column_stack([x, y, np.full(x.shape, -depth)])
    R, p = rotation(angle, -angle, 0.0), np.array([0.03, -0.02, depth])
    before, again = Map(), Map()
    before.add(points, p=p)
    rotate_map(before.record, R, p)
    again.add(points, R=R, p=p)
    most = 2 * angle * CELL + 2 * angle**2 * (depth + 0.45)
    inside = np.linspace(-0.35, 0.35, 15)
    for u in inside:
        for v in inside:
            assert abs(before.height(u, v) - again.height(u, v)) <= most
    # Points measured afterwards agree with the rotated map, so that they leave it as it is.
    heights = before.view.height.copy()
    before.add(points, R=R, p=p)
    known = np.isfinite(heights)
    assert np.abs(before.view.height - heights)[known].max() <= most


@pytest.mark.parametrize("kind", ["camera", "lidar"])
def test_stairs_are_mapped_by_a_moving_robot(kind):
    """Heights within 4.5 standard deviations of one reading, nine of ten edges within a cell.

    A reading's vertical error is depth · noise. Ranges up to 0.6 m err by 6 mm along the ground,
    so that three cells around an edge may hold either tread.
    """
    noise, edges = 0.01, np.array([0.4, 0.6, 0.8])
    stairs = {"kind": "steps", "edge_x_mm": [400, 600, 800], "edge_z_mm": [30, 60, 90]}
    scenario = Scenario().replace(
        robot="phantomx-ax", terrain=stairs, depth=kind, depth_noise=noise, depth_drift=0.0
    )
    robot, ground = scenario.load_robot(), scenario.load_terrain()
    sensor, terrain_map = DepthSensor(scenario.sensors, robot, ground), Map()
    height = -neutral_feet(robot)[:, 2].mean()
    for k in range(100):
        p = np.array([0.004 * k, 0.0, height + 0.03])
        points = sensor.read(np.array([*p, 1.0, 0.0, 0.0, 0.0]))
        recentre(terrain_map.record, p, 0.05 * k)
        terrain_map.add(points, p=p, time=0.05 * k)
    x, y, z, _, _ = terrain_map.view.arrays()
    true = ground.height(x, y)
    clear = (np.abs(x[..., None] - edges) > 3 * CELL).all(axis=-1) & np.isfinite(z)
    clear &= np.hypot(x - 0.4, y) < 0.45
    assert clear.sum() > 1000
    depth = height + 0.03 + robot.body.size[2] / 2 + 0.06
    assert np.abs(z - true)[clear].max() <= 4.5 * noise * depth
    rows = np.abs(y[0]) < 0.15
    for edge, low in zip(edges, (0.0, 0.03, 0.06), strict=True):
        near = (np.abs(x[:, 0] - edge) < 0.05)[:, None] & rows
        over = np.where(np.isfinite(z) & near, z > low + 0.015, False)
        found = x[np.argmax(over, axis=0), 0][rows & over.any(axis=0)]
        assert len(found) > 10
        assert np.percentile(np.abs(found - CELL / 2 - edge), 90) <= CELL + 1e-9


def walk(engine, seconds, each, dt=0.005):
    """Walk ahead on level ground that the feet feel, with a function at each update."""
    q = joint_angles(ROBOT.arrays, ROBOT.arrays.neutral_foot)
    command = Command(velocity=(0.06, 0.0, 0.0))
    for k in range(round(seconds / dt)):
        engine.reference.contact[:] = engine.state.foot[:, 2] <= 1e-4
        points = each(k)
        engine.update(Observation(k * dt, q, ground_points=points), command)


def test_feet_alone_map_their_footholds():
    """Known cells lie within `FOOT_RADIUS` and a cell's diagonal of a foothold, at its height."""
    engine = LocomotionEngine(ROBOT, ground_sensing=False, dynamics="none", terrain_map="feet")
    places = []

    def keep(k):
        del k
        state = engine.state
        places.extend(state.foot[state.leg_phase == LegPhase.STANCE].copy())

    walk(engine, 3.0, keep)
    keep(0)
    x, y, height, _, age = engine.terrain_map.arrays()
    known, feet = np.isfinite(height), np.unique(np.round(places, 4), axis=0)
    assert known.sum() > 6 * 9
    np.testing.assert_allclose(height[known], 0.0, atol=1e-3)
    away = np.hypot(x[known][:, None] - feet[:, 0], y[known][:, None] - feet[:, 1]).min(axis=1)
    assert away.max() <= FOOT_RADIUS + CELL
    assert np.nanmin(age) >= 0.0
    assert np.nanmax(age) <= 3.0


def test_points_belong_to_the_pose_of_their_reading():
    """A checkerboard of cells, 20 mm high, is met although the body walks on for the delay.

    Points lie 1 mm from the borders of their cells; 50 ms at 60 mm/s are 3 mm.
    """
    settings = EstimatorSettings(depth_delay=0.05, motion_lag=0.0)
    engine = LocomotionEngine(
        ROBOT, ground_sensing=False, dynamics="none", terrain_map="points", estimator=settings
    )
    i, j = (w.ravel() for w in np.meshgrid(np.arange(20, 70), np.arange(-5, 6)))
    high = 0.02 * ((i + j) % 2)
    world = np.column_stack([CELL * i + 0.001, CELL * (j + 0.5), high])
    poses = []

    def read(k):
        state = engine.state
        poses.append((state.R_odom_body.copy(), state.body_position.copy()))
        if k < 20 or k % 10:
            return None
        R, p = poses[-11]
        return (world - p) @ R

    walk(engine, 1.5, read)
    assert engine.state.body_position[0] > 0.03
    record = engine.memory["terrain_map"].view(np.recarray)[0]
    centres = CELL * (np.column_stack([i, j]) + 0.5)
    mapped = [map_height(record, u, v) for u, v in centres]
    inside = np.isfinite(mapped)
    assert inside.sum() > 300
    np.testing.assert_allclose(np.array(mapped)[inside], high[inside], atol=1e-9)


def test_a_map_of_nothing_is_none():
    assert LocomotionEngine(ROBOT).terrain_map is None
    with pytest.raises(InvalidInput, match='terrain_map is "eyes"; it must be none, feet or'):
        LocomotionEngine(ROBOT, terrain_map="eyes")
