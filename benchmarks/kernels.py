"""Time per sample of phasmid's kernels beside Pinocchio and MuJoCo, on the same states.

All in one run and on one core, taking turns; read the ratios. A time is the processor time of the
quickest round, which other work on the machine disturbed least.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
import pinocchio as pin

from phasmid import dynamics, kinematics
from phasmid.robot import Leg, load_robot
from phasmid.units import STANDARD_GRAVITY

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from dynamics.pinocchio_model import free_state, pinocchio_leg, pinocchio_model

ROUNDS = 15
LOOP = 2000
"""Samples of whatever runs in a Python loop."""

Row = tuple[Callable[[], object], int]


def quickest(rows: dict[str, Row]) -> dict[str, float]:
    """Seconds per sample of the quickest round of each, taking turns."""
    best = dict.fromkeys(rows, np.inf)
    for turn in range(ROUNDS + 1):
        for name, (work, count) in rows.items():
            start = time.process_time()
            work()
            if turn:
                best[name] = min(best[name], (time.process_time() - start) / count)
    return best


def table(title: str, rows: dict[str, Row], ours: str) -> None:
    """Print a comparison, in nanoseconds per sample."""
    found = {name: 1e9 * seconds for name, seconds in quickest(rows).items()}
    print(title)
    for name, nanoseconds in found.items():
        print(f"  {name:<48} {nanoseconds:12,.1f} ns {nanoseconds / found[ours]:10,.1f} x")


def loop(call: Callable[..., object], *arrays: np.ndarray) -> Callable[[], None]:
    """Calls a function for each of the first samples."""
    states = list(zip(*(a[:LOOP] for a in arrays), strict=True))

    def work() -> None:
        for state in states:
            call(*state)

    return work


def random_states(samples: int, *shape: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    q = rng.uniform([-1.5, -1.0, -2.2], [1.5, 1.0, -0.2], (samples, *shape, 3))
    return q, 5 * rng.normal(size=q.shape), 20 * rng.normal(size=q.shape)


def leg_dynamics(samples: int) -> None:
    robot = load_robot("phantomx-paper")
    leg = robot.legs[0]
    q, qd, qdd = random_states(samples)
    force = qd
    model = pinocchio_leg(leg)
    data, pool = model.createData(), pin.ModelPool(model, 1)
    columns, tau = [v.T for v in (q, qd, qdd)], np.empty((3, samples), order="F")
    rows: dict[str, Row] = {
        "phasmid": (
            lambda: dynamics.leg_torque(leg, q, qd, qdd, gravity=STANDARD_GRAVITY),
            samples,
        ),
        "phasmid, with foot force": (
            lambda: dynamics.leg_torque(
                leg, q, qd, qdd, foot_force=force, gravity=STANDARD_GRAVITY
            ),
            samples,
        ),
        "Pinocchio rneaInParallel, one thread": (
            lambda: pin.rneaInParallel(1, pool, *columns, tau),
            samples,
        ),
        "Pinocchio rnea in a Python loop": (
            loop(lambda *s: pin.rnea(model, data, *s), q, qd, qdd),
            LOOP,
        ),
    }
    table("inverse dynamics, per leg and sample", rows, "phasmid")
    error = np.abs(dynamics.leg_torque(leg, q, qd, qdd, gravity=STANDARD_GRAVITY) - tau.T).max()
    print(f"  largest difference from Pinocchio {error:.1e} N m")


def whole_robot(samples: int) -> None:
    robot = load_robot("phantomx-paper")
    q, qd, qdd = random_states(samples, 6)
    rng = np.random.default_rng(1)
    quaternion = rng.normal(size=(samples, 4))
    quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
    p, v, w, a, dw = rng.normal(size=(5, samples, 3))
    body = dynamics.BodyMotion(p, kinematics.quaternion_rotation(quaternion), v, w, a, dw)
    model = pinocchio_model(robot)
    data, pool = model.createData(), pin.ModelPool(model, 1)
    states = free_state(body, q, qd, qdd)
    columns, tau = [s.T for s in states], np.empty((model.nv, samples), order="F")
    rows: dict[str, Row] = {
        "phasmid": (
            lambda: dynamics.inverse_dynamics(robot, body, q, qd, qdd, gravity=STANDARD_GRAVITY),
            samples,
        ),
        "Pinocchio rneaInParallel, one thread": (
            lambda: pin.rneaInParallel(1, pool, *columns, tau),
            samples,
        ),
        "Pinocchio rnea in a Python loop": (
            loop(lambda *s: pin.rnea(model, data, *s), *states),
            LOOP,
        ),
    }
    table("inverse dynamics of the free robot, per sample", rows, "phasmid")
    torque = dynamics.inverse_dynamics(
        robot, body, q, qd, qdd, gravity=STANDARD_GRAVITY
    ).joint_torque
    error = np.abs(torque.reshape(samples, -1) - tau.T[:, 6:]).max()
    print(f"  largest difference from Pinocchio {error:.1e} N m")


def newton(leg: Leg) -> Callable[[np.ndarray], tuple[np.ndarray, int]]:
    """Newton's method on Pinocchio's kinematics, damped while far, from the neutral pose."""
    model = pinocchio_leg(leg)
    data, foot = model.createData(), model.getFrameId("foot_0")
    start, axes = kinematics.joint_angles(leg, leg.neutral_foot), pin.LOCAL_WORLD_ALIGNED

    def solve(goal: np.ndarray) -> tuple[np.ndarray, int]:
        q = start.copy()
        iterations = 0
        while iterations < 100:
            J = pin.computeFrameJacobian(model, data, q, foot, axes)[:3]
            pin.updateFramePlacement(model, data, foot)
            miss = goal - data.oMf[foot].translation
            size = miss @ miss
            if size < 1e-24:
                break
            iterations += 1
            q += np.linalg.solve(J.T @ J + min(0.01 * size, 1e-4) * np.eye(3), J.T @ miss)
        return q, iterations

    return solve


def leg_kinematics(samples: int) -> None:
    leg = load_robot("phantomx-paper").legs[0]
    q, *_ = random_states(samples)
    p = kinematics.foot_position(leg, q)
    solve = newton(leg)
    # Of Newton's method the goals that it misses are left out: each would cost a hundred steps.
    solved, iterations = map(np.array, zip(*map(solve, p[:LOOP]), strict=True))
    misses = np.abs(kinematics.foot_position(leg, solved) - p[:LOOP]).max(axis=-1)
    reached = misses < 1e-11
    goals, steps = p[:LOOP][reached], iterations[reached]
    rows: dict[str, Row] = {
        "inverse, phasmid": (lambda: kinematics.joint_angles(leg, p), samples),
        "inverse, Newton on Pinocchio in a Python loop": (loop(solve, goals), len(goals)),
        "foot, phasmid": (lambda: kinematics.foot_position(leg, q), samples),
        "Jacobian, phasmid": (lambda: kinematics.jacobian(leg, q), samples),
    }
    table("kinematics, per leg and sample", rows, "inverse, phasmid")
    error = np.abs(kinematics.foot_position(leg, kinematics.joint_angles(leg, p)) - p).max()
    print(f"  closed form: the foot is {error:.1e} m from its goal at most")
    print(
        f"  Newton: {len(goals)} of {LOOP} goals reached, within {misses[reached].max():.1e} m and "
        f"{steps.mean():.1f} iterations on average; the others are not timed"
    )


FIRST_CALLS = """
import json, time
import numpy as np
import phasmid
from phasmid import dynamics, kinematics
robot = phasmid.load_robot("phantomx-paper")
leg, q, Q = robot.legs[0], np.full((9, 3), -0.5), np.full((9, 6, 3), -0.5)
body = dynamics.BodyMotion.at_rest()
calls = {
    "foot_position": lambda: kinematics.foot_position(leg, q),
    "jacobian": lambda: kinematics.jacobian(leg, q),
    "joint_angles": lambda: kinematics.joint_angles(leg, leg.neutral_foot),
    "joint_motion": lambda: kinematics.joint_motion(leg, q, q, q),
    "leg_torque": lambda: dynamics.leg_torque(leg, q, q, q, gravity=9.81),
    "leg_matrices": lambda: dynamics.leg_matrices(leg, q, gravity=9.81),
    "inverse_dynamics": lambda: dynamics.inverse_dynamics(robot, body, Q, Q, Q, gravity=9.81),
}
start = time.perf_counter()
import numba
found = {"import of numba": time.perf_counter() - start}
for name, call in calls.items():
    start = time.perf_counter()
    call()
    found[name] = time.perf_counter() - start
print(json.dumps(found))
"""


def first_calls() -> None:
    """Print seconds of the first call of each function, without and with numba's cache."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for when in ("compiled", "from the cache"):
            run = subprocess.run(
                [sys.executable, "-c", FIRST_CALLS],
                env=os.environ | {"NUMBA_CACHE_DIR": folder},
                capture_output=True,
                text=True,
                check=True,
            )
            found[when] = json.loads(run.stdout)
    print(f"first call, seconds{'compiled':>21}{'from the cache':>17}")
    for name, seconds in found["compiled"].items():
        print(f"  {name:<28} {seconds:9.2f} {found['from the cache'][name]:16.2f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=1_000_000)
    samples = parser.parse_args().samples
    versions = {module.__name__: module.__version__ for module in (numba, np, pin)}
    print(f"{platform.processor()}, {os.cpu_count()} cores, {versions}")
    leg_dynamics(samples)
    whole_robot(samples // 10)
    leg_kinematics(samples)
    first_calls()
