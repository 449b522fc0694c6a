"""Learned policies beside the locomotion controller: numbers of docs/learning.md.

    python tools/pages learning [--seeds 20] [--curves FILE.json ...]

Tables go to the terminal and to results/learning/comparison.json, the curves to
docs/images/learning-curves.png.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import ground
from pages.control import case_of, ground_table, grouped, markdown
from phasmid import drive, summarise
from phasmid.control import LocomotionEngine
from phasmid.cores import cores
from phasmid.experiment import Command, Controller
from phasmid.learning import (
    Policy,
    PolicyController,
    WalkVectorEnv,
    policy_names,
)
from phasmid.learning.task import RandomisationTable
from phasmid.recording import Recording
from phasmid.reporting.style import save_figure, styled
from phasmid.robot import Robot
from phasmid.scenario import Scenario
from phasmid.units import STANDARD_GRAVITY

ROOT = Path(__file__).parents[2]
ROBOT, JOINTS = "phantomx-ax", "servo"
SIZES = {
    "blocks": (10, 20, 30, 40, 60, 80, 100),
    "hills": (5, 10, 15),
    "slope": (5, 10, 15, 20, 25),
    "stairs": (20, 40, 60),
    "gap": (30, 60),
}
"""Grounds of the comparison."""

CLASSICAL = "locomotion controller"


def controller_of(name: str, robot: Any) -> Controller:
    """Return the locomotion controller, or a policy that comes with phasmid."""
    if name != CLASSICAL:
        return PolicyController(name, robot)
    return LocomotionEngine(robot, period=ground.PERIOD)


def effort(run: Recording, robot: Robot, distance: float) -> dict[str, float]:
    """Return peak torque [N·m], temperature [°C] and cost of transport of a walk of a distance."""
    interval = ground.RECORD_INTERVAL_MS / 1000
    torque, velocity = run["joint_torque"].values, run["joint_velocity"].values
    work = float(np.maximum(torque * velocity, 0).sum()) * interval
    return {
        "peak": float(np.abs(torque).max()),
        "warmest": float(run["servo_temperature"].values[-1].max()),
        "transport": work / (robot.mass * STANDARD_GRAVITY * max(distance, 1e-3)),
    }


def effort_table(results: list[dict[str, Any]], names: Sequence[str]) -> str:
    """Return means over the runs that passed: speed error, cost, torque and heat, by ground."""
    rows = []
    for (kind, size), runs in grouped(results, "kind", "size").items():
        row = [f"{kind} {size:g} {ground.GROUNDS[kind].unit}".replace(" °", "°")]
        for name in names:
            passed = [run for run in runs if run["mode"] == name and run["passed"]]
            if not passed:
                row.append("–")
                continue
            velocity = np.mean([run["distance"] / run["time"] for run in passed])
            error = 100 * (velocity / ground.SPEED - 1)
            cost, peak, warmest = (
                np.mean([run[key] for run in passed]) for key in ("transport", "peak", "warmest")
            )
            row.append(f"{error:+.0f} %, {cost:.2f}, {peak:.2f} N·m, {warmest:.1f} °C")
        rows.append(row)
    return markdown(["ground", *names], rows)


def measure(case: tuple[str, float, str, int]) -> dict[str, Any]:
    """Walk over one ground."""
    kind, size, name, seed = case
    scenario = ground.scenario_of(kind, size, seed, ROBOT, JOINTS)
    robot = scenario.load_robot()
    task = ground.task_of(kind, size)
    outcome, run = ground.walk(scenario, controller_of(name, robot), task)
    found = case_of(outcome) | effort(run, robot, outcome.distance)
    return {"kind": kind, "size": size, "mode": name, "seed": seed, **found}


def on_level(name: str) -> dict[str, float]:
    """Walk forward at 0.08 m/s for 20 s on level ground."""
    scenario = Scenario().replace(robot=ROBOT, drive=JOINTS, duration=20.0)
    robot = scenario.load_robot()
    recording = drive(scenario, controller_of(name, robot), Command((0.08, 0.0, 0.0)))
    late = recording.sel(time=slice(5.0, None))
    velocity = np.diff(late["body_position"].values[[0, -1]], axis=0)[0] / 15.0
    summary = summarise(recording)
    return {
        "speed error [%]": 100 * abs(np.hypot(velocity[0], velocity[1]) / 0.08 - 1),
        "cost of transport": summary["energy"]["cost_of_transport"],
        "peak torque [N·m]": float(np.abs(late["joint_torque"].values).max()),
        "warmest servo after 20 s [°C]": float(recording["servo_temperature"].values[-1].max()),
    }


RANDOMISED = {
    "friction": (0.4, 1.2),
    "mass": 0.1,
    "payload": 0.2,
    "centre_of_mass": 0.01,
    "strength": 0.1,
    "gain": 0.1,
    "latency": 0.02,
    "joint_offset": 0.02,
    "joint_noise": 0.005,
    "gyro_noise": 0.1,
    "gravity_noise": 0.02,
    "push": 0.2,
}
"""Ranges of the randomised robots, in SI; see `phasmid.learning.task.RandomisationTable`."""


def survivors(name: str, *, randomised: bool, robots: int = 100) -> dict[str, float]:
    """Walk episodes of 20 s at full fidelity, each with its own commands and robot."""
    policy = Policy(name)
    assert policy.task is not None
    task = policy.task.replace(
        fidelity="full",
        terrain={"kinds": ()},
        randomisation=RANDOMISED if randomised else RandomisationTable().model_dump(),
    )
    env = WalkVectorEnv(robots, task=task, threads=cores(), autoreset_mode="Disabled")
    observations, _ = env.reset(seed=5000)
    survived = np.ones(robots, bool)
    for _ in range(env.physics.constants.steps):
        observations, _, fell, _, _ = env.step(policy(observations))
        survived &= ~fell
    e = env.physics.episodes
    along = e.progress[survived].sum() / e.wanted[survived].sum()
    return {"survived [%]": 100 * survived.mean(), "distance along the commands [%]": 100 * along}


def draw_curves(files: list[Path]) -> None:
    """Draw the return of each seed over the control periods."""
    with styled():
        figure = Figure(figsize=(7, 3.2), layout="constrained")
        axes = figure.subplots()
        for file in files:
            points = json.loads(file.read_text())
            steps = [point["steps"] / 1e6 for point in points]
            axes.plot(steps, [point["return"] for point in points], label=file.stem)
        axes.set(xlabel="control periods [millions]", ylabel="return of an episode")
        axes.legend(ncols=2)
        save_figure(figure, ROOT / "docs/images/learning-curves.png", dpi=100)


def main() -> None:
    """Make the comparison, or the curves."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--curves", nargs="*", type=Path, default=[])
    options = parser.parse_args()
    if options.curves:
        draw_curves(options.curves)
        return
    names = (CLASSICAL, *policy_names())
    for name in names:
        level = {key: round(value, 3) for key, value in on_level(name).items()}
        sys.stdout.write(f"{name}: {level}\n")
    for name in policy_names():
        for randomised in (False, True):
            kind = "randomised" if randomised else "nominal"
            found = {k: round(v, 1) for k, v in survivors(name, randomised=randomised).items()}
            sys.stdout.write(f"{name}, {kind} robots at full fidelity: {found}\n")
    cases = [
        (kind, size, name, seed)
        for kind, sizes in SIZES.items()
        for size in sizes
        for name in names
        for seed in range(options.seeds)
    ]
    with ProcessPoolExecutor(cores(), mp_context=get_context("spawn")) as pool:
        results = list(pool.map(measure, cases, chunksize=4))
    out = ROOT / "results/learning/comparison.json"
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(results))
    sys.stdout.write(ground_table(results, "mode") + "\n" + effort_table(results, names) + "\n")
