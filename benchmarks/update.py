"""How long one update of the locomotion engine takes, by robot and by the stages that take part.

    python benchmarks/update.py [ROBOT ...]

Each time is the mean over a walk's updates, of each of which the least counts that it takes in ten
walks that are alike. Robot and sensors agree: feet feel the ground where they meet it, on level
ground or on waves of 20 mm from trough to crest. A lidar reads 20 times a second; the updates that
write its points into the height map count apart. The time of a loop in Python shows how busy the
machine is.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from phasmid.control import LocomotionEngine
from phasmid.errors import PhasmidError
from phasmid.experiment import Command, Observation
from phasmid.robot import Robot, load_robot, preset_names
from phasmid.simulation.sensors.depth import lidar_rays

WALKS, UPDATES = 10, 2000
"""Number of equal walks, and updates in each."""

READING, SENSOR_HEIGHT = 10, 0.2
"""Updates between two readings of a lidar, 20 a second, and its height above the ground [m]."""

TOUCH = 1e-4
"""Height over the ground below which a foot has contact [m]."""


def level(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0.0 * x


def rough(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 0.005 * (np.sin(40.0 * x) + np.sin(31.0 * y))


BOTH = {"ground_sensing": True, "dynamics": "feed-forward"}

STAGES = {
    "walking alone": (level, {"ground_sensing": False, "dynamics": "none"}),
    "with ground sensing": (level, {"ground_sensing": True, "dynamics": "none"}),
    "with dynamics": (level, {"ground_sensing": False, "dynamics": "feed-forward"}),
    "with both": (level, BOTH),
    "with both, on waves of 20 mm": (rough, BOTH),
    "with a lidar, too": (rough, {**BOTH, "terrain_map": "points"}),
}
"""Ground and settings of each stage."""


def update_times(robot: Robot, stage: str) -> tuple[float, float]:
    """Return the mean times of the updates of a walk without and with a reading of a lidar [s].

    Each update counts with its least time in several equal walks, which leaves out other load of
    the machine but no difference between updates. The second is NaN where there is no lidar.
    """
    ground, settings = STAGES[stage]
    least = np.min([_walk(robot, ground, settings) for _ in range(WALKS)], axis=0)
    reads = np.arange(UPDATES) % READING == 0
    if "terrain_map" not in settings:
        return float(least.mean()), np.nan
    return float(least[~reads].mean()), float(least[reads].mean())


def _walk(robot: Robot, ground, settings) -> np.ndarray:
    """Return the times of the updates of a walk [s]."""
    engine = LocomotionEngine(robot, **settings)
    legs, took, now = len(robot.legs), np.zeros(UPDATES), 0.0
    limit = engine.largest_velocity((1.0, 0.2, 0.5))
    command = Command(velocity=tuple(0.7 * v for v in limit.velocity))
    sensors = {
        "joint_load": np.zeros((legs, 3)),
        "orientation": np.array([1.0, 0.0, 0.0, 0.0]),
        "angular_velocity": np.zeros(3),
        "acceleration": np.array([0.0, 0.0, 9.80665]),
    }
    engine.reset(
        Observation(now, engine.state.q.copy(), contact=np.ones(legs, dtype=bool), **sensors)
    )
    for n in range(UPDATES):
        now += engine.settings.update_period
        x, y, z = engine.state.foot.T
        sensors["contact"] = z - ground(x, y) < TOUCH
        reads = "terrain_map" in settings and n % READING == 0
        sensors["ground_points"] = _ground_points(engine, ground) if reads else None
        observation = Observation(now, engine.state.q.copy(), **sensors)
        began = time.perf_counter()
        engine.update(observation, command)
        took[n] = time.perf_counter() - began
    return took


def _ground_points(engine: LocomotionEngine, ground) -> np.ndarray:
    """Return points of the ground around a body, in its axes [m], shape (N, 3)."""
    rays = lidar_rays(0.0)
    R, body = engine.state.R_odom_body, engine.state.body_position
    points = body + SENSOR_HEIGHT / -rays[:, 2:] * rays
    points[:, 2] = ground(points[:, 0], points[:, 1])
    return (points - body) @ R


def loop_time() -> float:
    """Least time of a thousand additions in Python [s]."""
    best = np.inf
    for _ in range(500):
        began, total = time.perf_counter(), 0.0
        for i in range(1000):
            total += 0.5 * i
        best = min(best, time.perf_counter() - began)
    return float(best)


def main() -> int:
    print(f"a thousand additions in Python: {1e6 * loop_time():.1f} us")
    for name in sys.argv[1:] or preset_names():
        try:
            robot = load_robot(name)
        except PhasmidError as error:
            print(error.what, file=sys.stderr)
            return 2
        for stage in STAGES:
            alone, reading = update_times(robot, stage)
            also = "" if np.isnan(reading) else f"; with a reading {1e6 * reading:.0f} us"
            print(f"update, {name}, {stage}: {1e6 * alone:.1f} us{also}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
