"""How fast phasmid is, beside the limit that the machine sets, in one run.

Read the ratios: on a shared machine the times of one run to the next differ.
"""

from __future__ import annotations

import ctypes
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mujoco
import numba
import numba.extending
import numpy as np
from mujoco.rollout import rollout
from numba.core import cgutils

from phasmid.forces import analyse
from phasmid.motion import plan
from phasmid.scenario import load_scenario
from phasmid.simulation import Run, new_run, simulate_many

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
        run.data.qpos[:], run.data.qvel[:] = first.log["qpos"][start], first.log["qvel"][start]
        mujoco.mj_getState(run.model, run.data, state, physics)
    torque = first.log["torque"][: len(starts) * block].reshape(len(starts), block, -1)
    table = np.pad(torque, [(0, 0), (0, 0), (6, 0)])
    scratch = mujoco.MjData(run.model)
    return lambda: rollout(run.model, scratch, states, table, control_spec=int(forces))


def engine_prescribed(scenario, walk):
    """The engine's own loop over the same walk, in C, with targets set by compiled code."""
    run = Run(scenario, walk)
    run.drive.command(run.targets(0, 1)[0])
    begin, targets = run.state(), run.targets(1, run.steps + 1)
    step = np.zeros(1, np.int64)
    joints, width = targets.shape[1], run.model.eq_data.shape[1]
    places = (run.model.eq_data.ctypes.data, targets.ctypes.data, step.ctypes.data)
    eq_at, targets_at, step_at = places
    rows = len(targets)

    @numba.cfunc(numba.void(numba.types.voidptr, numba.types.voidptr))
    def set_targets(model, data):
        # The engine has read this step's targets by now: these are the next one's.
        now = numba.carray(address_as_void_pointer(step_at), 1, np.int64)
        table = numba.carray(address_as_void_pointer(targets_at), (rows, joints), np.float64)
        held = numba.carray(address_as_void_pointer(eq_at), (joints, width), np.float64)
        for joint in range(joints):
            held[joint, 0] = table[now[0], joint]
        now[0] += 1

    callback = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(set_targets.address)

    def work():
        step[0] = 0
        run.restore(begin)
        mujoco.set_mjcb_control(callback)
        try:
            mujoco.mj_step(run.model, run.data, run.steps)
        finally:
            mujoco.set_mjcb_control(None)

    # What the compiled code looks at must not be collected.
    work.keeps = run, targets, set_targets
    return work


@numba.extending.intrinsic
def address_as_void_pointer(typing, address):
    """A whole number as a pointer, which numba itself does not offer."""

    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return numba.types.voidptr(address), generate


def simulation_loop(drive: str, engines) -> None:
    """The recorded loop against the engine's own loops in C, taking turns."""
    scenario = load_scenario("paper").replace(drive=drive)
    walk = plan(scenario)
    in_c = {name: engine(scenario, walk) for name, engine in engines.items()}
    ours, limits = [], {name: [] for name in engines}
    for _ in range(ROUNDS):
        run = Run(scenario, walk)
        ours.append(seconds(run.advance) / run.steps)
        for name, work in in_c.items():
            limits[name].append(seconds(work) / 10_000)
    # The quickest round of each is the one that other work on the machine disturbed least.
    best = min(ours)
    print(f"simulation loop, {drive} joints, every channel at every step")
    print(f"  phasmid                    {1e6 * best:7.1f} us a step  ({1 / best:,.0f} steps/s)")
    for name, times in limits.items():
        rounds = statistics.median(e / o for e, o in zip(times, ours, strict=True))
        print(
            f"  MuJoCo in C, {name:<13} {1e6 * min(times):7.1f} us a step, rate against it "
            f"{min(times) / best:.2f} (median of rounds {rounds:.2f})"
        )


def side_by_side() -> None:
    """Independent runs on two threads against one, taking turns, and the engine's own loop so."""
    scenario = load_scenario("paper").replace(duration=30.0)
    pairs = [(scenario, plan(scenario))] * 4
    engine = [Run(scenario, pairs[0][1]) for _ in range(2)]

    def in_c(run):
        mujoco.mj_step(run.model, run.data, 20_000)

    def both():
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(in_c, engine))

    # Machine code is made, or read, before the clock runs.
    simulate_many([(scenario.replace(duration=0.1), pairs[0][1])])
    one, two, limits = [], [], []
    for _ in range(ROUNDS):
        one.append(seconds(lambda: simulate_many(pairs, workers=1)))
        two.append(seconds(lambda: simulate_many(pairs, workers=2)))
        limits.append(2 * seconds(lambda: in_c(engine[0])) / seconds(both))
    median = statistics.median(a / b for a, b in zip(one, two, strict=True))
    print(f"simulate_many, four walks of {scenario.duration:g} s")
    print(f"  one worker  {min(one):6.2f} s")
    print(
        f"  two workers {min(two):6.2f} s, {min(one) / min(two):.2f} times as fast "
        f"(median of rounds {median:.2f})"
    )
    print(
        f"  MuJoCo in C, two threads, {max(limits):.2f} times as fast as one "
        f"(median of rounds {statistics.median(limits):.2f})"
    )


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


def plans() -> None:
    scenario = load_scenario("paper")
    walk = plan(scenario)
    fine = np.arange(10_001) * 1e-3
    rows = {
        "plan of the whole robot": (lambda: walk.sample(fine), len(fine)),
        "analysis of the whole robot": (lambda: analyse(scenario, walk.sample(fine)), len(fine)),
    }
    print("a planned walk, per sample")
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
    simulation_loop("prescribed", {"standing": engine_standing, "the same walk": engine_prescribed})
    simulation_loop("ideal-servo", {"the same walk": engine_walking})
    simulation_loop("servo", {"the same walk": engine_replaying})
    side_by_side()
    second_simulator()
    plans()
    commands()
