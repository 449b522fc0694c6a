"""Depth sensors measure points of the true ground, with their noise, drift, rate and delay."""

import math

import numpy as np
import pytest

import phasmid
from phasmid.control import LocomotionEngine
from phasmid.experiment import Command
from phasmid.kinematics import neutral_feet
from phasmid.robot import load_robot
from phasmid.scenario import Scenario, idle_fields
from phasmid.simulation.sensors.depth import BRACKET, HALVINGS, DepthSensor

ROBOT = load_robot("phantomx-ax")
HEIGHT = -neutral_feet(ROBOT)[:, 2].mean()
PERFECT = {"depth_noise": 0.0, "depth_dropout": 0.0, "depth_drift": 0.0}
STAIRS = {"kind": "stairs", "rise_mm": 30, "run_mm": 150, "terrain_start_mm": 400}


def sensor_on(terrain, kind, **changes):
    scenario = Scenario().replace(terrain=terrain, depth=kind, **changes)
    return DepthSensor(scenario.sensors, ROBOT, scenario.load_terrain()), scenario.load_terrain()


def measured(terrain, kind, x=0.0, **changes):
    """Points in the world from a level body over a place, and the ground."""
    sensor, ground = sensor_on(terrain, kind, **changes)
    p = np.array([x, 0.0, HEIGHT + float(ground.height(np.array([x]), np.zeros(1))[0])])
    return sensor.read(np.array([*p, 1.0, 0.0, 0.0, 0.0])) + p, ground


@pytest.mark.parametrize("kind", ["camera", "lidar", "exact"])
@pytest.mark.parametrize("terrain", [{"kind": "flat"}, {"kind": "slope", "slope_deg": 12}])
def test_points_lie_on_a_plane(kind, terrain):
    """Linear interpolation along a ray is exact on planes: round-off only."""
    points, ground = measured(terrain, kind, **PERFECT)
    assert len(points) > 1000
    np.testing.assert_allclose(points[:, 2], ground.height(*points.T[:2]), atol=1e-12)


@pytest.mark.parametrize("kind", ["camera", "lidar"])
def test_points_lie_on_treads_and_risers(kind):
    """A bisected bracket leaves 2 BRACKET / 2^HALVINGS along the ray at a riser, none on treads."""
    points, ground = measured(STAIRS, kind, **PERFECT)
    x, y, z = points.T
    on_tread = np.abs(z - ground.height(x, y)) < 1e-12
    edges, rise, left = np.array([0.4, 0.55, 0.7, 0.85]), 0.03, 2 * BRACKET / 2**HALVINGS
    on_riser = np.any(
        (np.abs(x[:, None] - edges) <= left)
        & (z[:, None] >= rise * np.arange(4) - left)
        & (z[:, None] <= rise * np.arange(1, 5) + left),
        axis=1,
    )
    assert (on_tread | on_riser).all()
    assert (on_riser & ~on_tread).sum() > 20


def test_camera_sees_the_ground_before_the_front_feet():
    """Its rows reach from 0.1 m before the front feet to 0.8 m before the body, by construction."""
    points, _ = measured({"kind": "flat"}, "camera", **PERFECT)
    middle = points[np.abs(points[:, 1]) < 0.02, 0]
    front = neutral_feet(ROBOT)[:, 0].max()
    np.testing.assert_allclose([middle.min(), middle.max()], [front + 0.1, 0.8], atol=1e-3)


def test_smooth_ground_is_met_between_nodes():
    """Interpolation over cells of 10 mm errs by curvature times cell² / 8 at most, twice in 2D."""
    waves = {"kind": "waves", "wave_height_mm": 20, "wave_length_mm": 300}
    points, ground = measured(waves, "lidar", **PERFECT)
    curvature = 0.01 * (2 * math.pi / 0.3) ** 2
    error = points[:, 2] - ground.height(*points.T[:2])
    # A shallow ray stretches a vertical error along itself, and so does the ground's slope.
    assert np.abs(error).max() <= 2 * 2 * curvature * 0.01**2 / 8


def test_noise_is_a_share_of_the_range():
    """Standard deviation of 4800 relative errors: ± 4 / sqrt(2 · 4800) = 4 %."""
    exact, _ = sensor_on({"kind": "flat"}, "camera", **PERFECT)
    noisy, _ = sensor_on({"kind": "flat"}, "camera", **PERFECT | {"depth_noise": 0.02})
    pose = np.array([0.0, 0.0, HEIGHT, 1.0, 0.0, 0.0, 0.0])
    true = exact.read(pose)
    mount = np.array([ROBOT.body.size[0] / 2, 0.0, ROBOT.body.size[2] / 2 + 0.03])
    share = [
        np.linalg.norm(noisy.read(pose) - mount, axis=1) / np.linalg.norm(true - mount, axis=1)
        for _ in range(4)
    ]
    assert np.std(share) == pytest.approx(0.02, rel=4 / math.sqrt(2 * np.size(share)))


def test_dropout_is_a_share_of_the_rays():
    """Binomial with 1200 rays: ± 4 standard deviations."""
    points, _ = measured({"kind": "flat"}, "camera", **PERFECT | {"depth_dropout": 0.3})
    assert abs(len(points) - 0.7 * 1200) <= 4 * math.sqrt(1200 * 0.3 * 0.7)


def test_mounting_angles_drift():
    """After a minute level ground seems tilted by the drift: 2 · 80 angles, ± 4 / sqrt(320)."""
    tilts, drift = [], math.radians(0.5)
    pose = np.array([0.0, 0.0, HEIGHT, 1.0, 0.0, 0.0, 0.0])
    for seed in range(80):
        sensor, _ = sensor_on(
            {"kind": "flat"},
            "lidar",
            **PERFECT
            | {"depth_drift": drift, "depth_rate": 1 / 60, "depth_range": 0.5, "sensor_seed": seed},
        )
        first, second = sensor.read(pose), sensor.read(pose)
        assert np.ptp(first[:, 2]) < 1e-12
        columns = np.column_stack([second[:, :2], np.ones(len(second))])
        tilts.append(np.linalg.lstsq(columns, second[:, 2], rcond=None)[0][:2])
    assert np.std(tilts) == pytest.approx(drift, rel=4 / math.sqrt(2 * np.size(tilts)))


def test_one_seed_repeats_readings():
    options = {"depth_noise": 0.02, "depth_dropout": 0.1}
    first, again = (measured({"kind": "flat"}, "lidar", **options)[0] for _ in range(2))
    other, _ = measured({"kind": "flat"}, "lidar", sensor_seed=1, **options)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


class Listener:
    """Stands, and keeps its observations."""

    def __init__(self):
        self.engine, self.observations = LocomotionEngine(ROBOT, dynamics="none"), []

    def reset(self, observation):
        self.engine.reset(observation)

    def update(self, observation, command):
        self.observations.append(observation)
        return self.engine.update(observation, command)


@pytest.mark.parametrize("measures", ["nothing", "everything"])
def test_readings_arrive_late_and_once(measures):
    """20 readings a second, 50 ms late, are in the observations at 50, 100, ... ms alone.

    The other sensors' readings stay bit by bit what they are without a depth sensor.
    """
    seen = []
    for depth in ("none", "camera"):
        scenario = Scenario().replace(
            robot="phantomx-ax", drive="servo", duration=0.25, depth=depth, measured=measures
        )
        listener = Listener()
        phasmid.drive(scenario, listener, Command())
        seen.append(listener.observations)
    without, observed = seen
    assert all(each.ground_points is None for each in without)
    times = [each.time for each in observed if each.ground_points is not None]
    np.testing.assert_allclose(times, [0.05, 0.1, 0.15, 0.2, 0.25][: len(times)], atol=1e-9)
    assert len(times) >= 4
    for one, other in zip(without, observed, strict=True):
        assert np.array_equal(one.joint_position, other.joint_position)
        assert np.array_equal(one.acceleration, other.acceleration)


def test_settings_without_a_sensor_have_no_effect():
    robot = load_robot("phantomx-ax")
    idle = idle_fields(Scenario().replace(depth_noise=0.02), robot)
    assert idle == ['depth_noise has no effect with depth "none".']
    used = Scenario().replace(depth="camera", depth_noise=0.02, sensor_seed=3)
    assert idle_fields(used, robot) == []
