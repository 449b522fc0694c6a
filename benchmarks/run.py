"""How fast phasmid is, beside the limit that the machine sets, in one run.

Read the ratios: on a shared machine the times of one run to the next differ.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np
from mujoco.rollout import rollout

from phasmid import dynamics, kinematics
from phasmid.forces import analyse
from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.simulation import Run, new_run

ROUNDS = 7


def seconds(work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def engine_standing(scenario, walk):
    """The engine's own loop on the same model, held still on three feet amid a stance."""
    amid = Run(scenario.replace(duration=0.5), walk)
    amid.advance()
    return lambda: mujoco.mj_step(amid.model, amid.data, 10_000)


def engine_walking(scenario, walk):
    """The engine's own loop over the same walk, in C: its rollout takes a table of servo goals."""
    run = Run(scenario, walk)
    physics = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.zeros((1, mujoco.mj_stateSize(run.model, physics)))
    mujoco.mj_getState(run.model, run.data, state[0], physics)
    goals, scratch = run.targets(0, run.steps)[None], mujoco.MjData(run.model)
    return lambda: rollout(run.model, scratch, state, goals)


def engine_replaying(scenario, walk):
    """The engine's own loop over the same walk, in C, with the torques that the servos gave.

    Torques alone do not hold a robot up for long: the replay starts anew every so many steps.
    """
    first, run, block = Run(scenario, walk), Run(scenario, walk), 250
    first.advance()
    physics, forces = mujoco.mjtState.mjSTATE_FULLPHYSICS, mujoco.mjtState.mjSTATE_QFRC_APPLIED
    starts = range(0, first.steps - block + 1, block)
    states = np.zeros((len(starts), mujoco.mj_stateSize(run.model, physics)))
    for state, start in zip(states, starts, strict=True):
        run.data.qpos[:], run.data.qvel[:] = first.log.qpos[start], first.log.qvel[start]
        mujoco.mj_getState(run.model, run.data, state, physics)
    torque = first.log.torque[: len(starts) * block].reshape(len(starts), block, -1)
    table = np.pad(torque, [(0, 0), (0, 0), (6, 0)])
    scratch = mujoco.MjData(run.model)
    return lambda: rollout(run.model, scratch, states, table, control_spec=int(forces))


def simulation_loop(drive: str, engine) -> None:
    """The recorded loop against the engine's own loop in C, taking turns."""
    scenario = load_scenario("paper").replace(drive=drive)
    walk = plan(scenario)
    in_c = engine(scenario, walk)
    ours, limits = [], []
    for _ in range(ROUNDS):
        run = Run(scenario, walk)
        ours.append(seconds(run.advance) / run.steps)
        limits.append(seconds(in_c) / 10_000)
    # The quickest round of each is the one that other work on the machine disturbed least.
    best, limit = min(ours), min(limits)
    rounds = statistics.median(e / o for e, o in zip(limits, ours, strict=True))
    print(f"simulation loop, {drive} joints, every channel at every step")
    print(f"  phasmid            {1e6 * best:7.1f} us a step  ({1 / best:,.0f} steps/s)")
    print(f"  MuJoCo alone, in C {1e6 * limit:7.1f} us a step")
    print(f"  rate against C     {limit / best:7.2f}  (median of rounds {rounds:.2f})")


def second_simulator() -> None:
    """The simulator of prescribed joints against MuJoCo's own loop in C on the same walk."""
    scenario = load_scenario("paper")
    walk, own = plan(scenario), scenario.replace(contact_law="simscape")
    in_c = engine_standing(scenario, walk)
    ours, limits = [], []
    for _ in range(ROUNDS):
        run = new_run(own, walk)
        ours.append(seconds(run.advance) / run.steps)
        limits.append(seconds(in_c) / 10_000)
    best, limit = min(ours), min(limits)
    rounds = statistics.median(e / o for e, o in zip(limits, ours, strict=True))
    print("simulator of prescribed joints, contact_law = simscape, every channel at every step")
    print(f"  phasmid            {1e6 * best:7.1f} us a step  ({1 / best:,.0f} steps/s)")
    print(f"  MuJoCo alone, in C {1e6 * limit:7.1f} us a step")
    print(f"  rate against C     {limit / best:7.2f}  (median of rounds {rounds:.2f})")


def arrays() -> None:
    scenario = load_scenario("paper")
    walk = plan(scenario)
    robot, fine = walk.robot, np.arange(10_001) * 1e-3
    leg, rng = robot.legs[0], np.random.default_rng(0)
    q = rng.uniform([-0.5, 0, -2], [0.5, 0.8, -1], (100_000, 3))
    p = kinematics.foot_position(leg, q)
    rows = {
        "inverse kinematics of one leg": (lambda: kinematics.joint_angles(leg, p), len(q)),
        "torques of one leg, closed form": (lambda: dynamics.leg_torque(leg, q, q, q), len(q)),
        "plan of the whole robot": (lambda: walk.sample(fine), len(fine)),
        "analysis of the whole robot": (lambda: analyse(scenario, walk.sample(fine)), len(fine)),
    }
    print("arrays, per sample")
    for name, (work, count) in rows.items():
        work()
        print(f"  {name:<34} {1e6 * min(seconds(work) for _ in range(3)) / count:8.2f} us")


def commands() -> None:
    python = sys.executable
    with tempfile.TemporaryDirectory() as folder:
        walk = [python, "-m", "phasmid", "walk", "--out", str(Path(folder) / "paper"), "--quiet"]
        rows = {
            "phasmid walk, all figures": [*walk, "--force"],
            "phasmid walk --no-figures": [*walk, "--force", "--no-figures"],
            "phasmid --help": [python, "-m", "phasmid", "--help"],
            "phasmid walk --help": [python, "-m", "phasmid", "walk", "--help"],
            "python -c 'import phasmid'": [python, "-c", "import phasmid"],
        }
        print("commands, from start to end")
        for name, command in rows.items():
            times = [
                seconds(lambda c=command: subprocess.run(c, check=True, stdout=subprocess.DEVNULL))
                for _ in range(3)
            ]
            print(f"  {name:<34} {min(times):8.2f} s")


if __name__ == "__main__":
    print(f"MuJoCo {mujoco.__version__}, NumPy {np.__version__}, Python {sys.version.split()[0]}")
    simulation_loop("prescribed", engine_standing)
    simulation_loop("ideal-servo", engine_walking)
    simulation_loop("servo", engine_replaying)
    second_simulator()
    arrays()
    commands()
