"""Drift of the body's estimated state over walks of 3 m."""

from __future__ import annotations

import math

import numpy as np

from phasmid.experiment import Command
from phasmid.reporting import summarise
from phasmid.scenario import Scenario
from phasmid.simulation import drive

from .study import Case, grouped, markdown
from .terrain import DRIVES

ROBOT, DURATION = "phantomx-ax", 33.0
"""Robot, and duration of a walk [s]."""

WALKS = {"straight": (0.09, 0.0, 0.0), "arc": (0.09, 0.0, 0.06)}
"""Commanded velocities: forward, lateral [m/s] and yaw [rad/s]."""

GROUNDS = {
    "level": {"kind": "flat"},
    "blocks 40 mm": {"kind": "blocks", "block_height_mm": 40, "block_size_mm": 100},
    "slope 10°": {"kind": "slope", "slope_deg": 10},
    "ice": {"kind": "flat", "friction": 0.1},
}

SENSORS = {"true": "nothing", "noisy": "everything"}


def cases(seeds: int = 3) -> list[Case]:
    """Return every ground, walk, kind of sensors and of servos, and seed."""
    return [
        {"ground": ground, "walk": walk, "sensors": sensors, "joints": joints, "seed": seed}
        for ground in GROUNDS
        for walk in WALKS
        for sensors in SENSORS
        for joints in DRIVES
        for seed in range(seeds)
    ]


def measure(
    ground: str, walk: str, sensors: str, joints: str, seed: int, duration: float = DURATION
) -> Case:
    """Walk once with the scenario's own controller."""
    rng = np.random.default_rng([seed, 78])
    terrain = {
        **GROUNDS[ground],
        "planned_on": "level",
        "terrain_seed": seed + 1,
        # The robot starts on level ground.
        "terrain_start_mm": float(rng.uniform(220, 320)),
    }
    scenario = Scenario().replace(
        robot=ROBOT,
        drive=DRIVES[joints],
        duration=duration,
        record_interval_ms=5,
        terrain=terrain,
        measured=SENSORS[sensors],
        sensor_seed=seed,
        body_state="estimated",
    )
    run = drive(scenario, None, Command(velocity=WALKS[walk]))
    found = summarise(run)
    return {
        "ending": run.attrs["ending"],
        "distance": found["travel"]["distance"],
        **found["state_estimate"],
    }


def table(results: list[Case]) -> str:
    """Return mean and largest drift, and the rms error of velocity, by ground and walk."""
    rows = []
    for (ground, walk), runs in grouped(results, "ground", "walk").items():
        row = [f"{ground}, {walk}"]
        for mine in grouped(runs, "sensors", "joints").values():
            drift = [100 * run["position_drift"] for run in mine]
            error = math.sqrt(np.mean([run["velocity_error"] ** 2 for run in mine]))
            row.append(f"{np.mean(drift):.2f} % (≤ {max(drift):.2f} %), {1000 * error:.1f} mm/s")
        rows.append(row)
    kinds = [f"{sensors}, {joints}" for sensors, joints in grouped(results, "sensors", "joints")]
    return markdown(["ground, walk", *kinds], rows)
