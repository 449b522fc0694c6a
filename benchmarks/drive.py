"""Speed of driven simulations: the engine at 200 Hz, physics at 1 ms, all channels.

    python benchmarks/drive.py [SECONDS]

For each drive: a constant command, a function as command, and measured sensors, all with set-up.
Beside them, in turns, MuJoCo alone makes the same steps with the same goals: once through the loop
of phasmid, which records each step, and once by one `mj_step` per period with the drive law as a
compiled control callback, which records nothing. `benchmarks/run.py` compares a planned walk with
prescribed joints with the same walk in C.
"""

from __future__ import annotations

import ctypes
import sys
import time
from collections.abc import Callable

import mujoco
import numba
import numpy as np
from run import address_as_void_pointer

from phasmid import Scenario, load_scenario
from phasmid.experiment import Command
from phasmid.servo.law import SERVO_STATE
from phasmid.servo.law_kernels import servo_step
from phasmid.simulation.closed_loop import ClosedLoopRun
from phasmid.simulation.drive import new_drive

ROUNDS = 3
COMMAND = Command(velocity=(0.05, 0.0, 0.1))


def changing(moment: float, observation: object) -> Command:
    """A command that changes at every update."""
    return Command(velocity=(0.05 * np.sin(moment), 0.0, 0.1))


def driven(scenario: Scenario, commands: object = COMMAND) -> ClosedLoopRun:
    return new_drive(scenario, None, commands)


def period_goals(scenario: Scenario) -> list[np.ndarray]:
    """Goals of the joints in each period of a walk."""
    run, goals = driven(scenario), []
    convert = run.drive.targets

    def noted(*args):
        goals.append(convert(*args).copy())
        return goals[-1]

    run.drive.targets = noted
    run.advance()
    return goals


def stepping(run: ClosedLoopRun, goals: list[np.ndarray]) -> Callable[[], None]:
    """The steps alone, through the loop of phasmid."""

    def work():
        for rows in goals:
            run._advance(rows)

    return work


def engine_alone(run: ClosedLoopRun, goals: list[np.ndarray]) -> Callable[[], None]:
    """The steps alone, each goal set by the drive and nothing recorded."""

    def work():
        command = run.drive.command
        for rows in goals:
            for row in rows:
                command(row)
                mujoco.mj_step(run.model, run.data)

    return work


def with_callback(run: ClosedLoopRun, goals: list[np.ndarray]) -> Callable[[], None]:
    """One `mj_step` per period, with the servos' law as a control callback in machine code."""
    q, qd, limits, parameters, servos, delayed, applied = run.drive._arguments
    goal = np.zeros(len(servos))
    arrays = goal, q, qd, limits, parameters, servos, delayed, applied
    goal_at, q_at, qd_at, limits_at, parameters_at, servos_at, delayed_at, applied_at = (
        array.ctypes.data for array in arrays
    )
    joints, delay = delayed.shape
    own, kind = parameters.dtype, SERVO_STATE

    @numba.cfunc(numba.void(numba.types.voidptr, numba.types.voidptr))
    def law(model, data):
        servo_step(
            numba.carray(address_as_void_pointer(goal_at), joints, np.float64),
            numba.carray(address_as_void_pointer(q_at), joints, np.float64),
            numba.carray(address_as_void_pointer(qd_at), joints, np.float64),
            numba.carray(address_as_void_pointer(limits_at), (2, joints), np.float64),
            numba.carray(address_as_void_pointer(parameters_at), 1, own),
            numba.carray(address_as_void_pointer(servos_at), joints, kind),
            numba.carray(address_as_void_pointer(delayed_at), (joints, delay), np.float64),
            numba.carray(address_as_void_pointer(applied_at), joints, np.float64),
        )

    callback = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(law.address)

    def work():
        mujoco.set_mjcb_control(callback)
        try:
            for rows in goals:
                goal[:] = rows[0]
                mujoco.mj_step(run.model, run.data, len(rows))
        finally:
            mujoco.set_mjcb_control(None)

    # Memory that the machine code reads must not be collected.
    work.keeps = arrays, law
    return work


def seconds(work: Callable[[], object]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


def main() -> None:
    duration = float(sys.argv[1]) if len(sys.argv) > 1 else 30.0
    for kind in ("prescribed", "ideal-servo", "servo"):
        scenario = load_scenario("paper").replace(period=1.0, drive=kind, duration=duration)
        cases = {
            "constant command": (scenario, COMMAND),
            "function as command": (scenario, changing),
            "measured sensors": (scenario.replace(measured="everything"), COMMAND),
        }
        for each, commands in cases.values():
            # Functions are compiled, or loaded, before the clock runs.
            driven(each.replace(duration=0.1), commands).simulate()
        goals = period_goals(scenario)
        best: dict[str, float] = {}
        for _ in range(ROUNDS):
            works = {
                name: lambda case=case: driven(*case).simulate() for name, case in cases.items()
            }
            works["steps, recorded"] = stepping(driven(scenario), goals)
            works["steps alone"] = engine_alone(driven(scenario), goals)
            if kind == "servo":
                works["steps, law as callback"] = with_callback(driven(scenario), goals)
            for name, work in works.items():
                best[name] = min(best.get(name, np.inf), seconds(work))
        print(f"driven, {kind}, times real time (processor time)")
        for name, least in best.items():
            print(f"  {name:<24}{duration / least:6.1f}", flush=True)


if __name__ == "__main__":
    main()
