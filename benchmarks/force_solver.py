"""How long the ground's share-out takes: each member of the family, and the second solver beside.

Six feet on slopes of some ten degrees, loads that use up to 95 % of the friction, one core. The
second solver, clarabel, gets the same second-order cone programmes; agreement is shown with it.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import clarabel
import numpy as np
from report import machine, write
from scipy import sparse

from phasmid.forces import (
    FORCE_MODELS,
    Contacts,
    FrictionCone,
    JointLoad,
    MinimumTorque,
    friction_statistics,
    share_load,
)

SAMPLES = 10_000
COMPARED = 500
LEGS = 6
FRICTION = 0.6


def loads(count: int, tilt: float) -> tuple[Contacts, np.ndarray, JointLoad]:
    """Feet, wrenches of admissible forces, and joints."""
    rng = np.random.default_rng(0)
    angle = 2 * np.pi * np.arange(LEGS) / LEGS
    feet = np.stack([0.25 * np.cos(angle), 0.2 * np.sin(angle), -0.1 + 0 * angle], axis=-1)
    feet = feet + rng.normal(scale=0.03, size=(count, LEGS, 3))
    normals = np.array([0, 0, 1.0]) + rng.normal(scale=tilt, size=feet.shape)
    contacts = Contacts(feet, np.ones((count, LEGS)), normals, FRICTION)
    normal = rng.uniform(0.5, 10.0, size=(count, LEGS))
    along = FRICTION * normal * rng.uniform(0, 0.95, size=normal.shape)
    turn = rng.uniform(0, 2 * np.pi, size=normal.shape)
    force = np.stack([normal, along * np.cos(turn), along * np.sin(turn)], axis=-1)
    force = (contacts.axes @ force[..., None])[..., 0]
    wrench = np.concatenate([force.sum(axis=1), np.cross(feet, force).sum(axis=1)], axis=-1)
    jacobian = rng.normal(scale=0.1, size=(count, LEGS, 3, 3))
    torque = np.einsum("nlij,nli->nlj", jacobian, force)
    joints = JointLoad(jacobian, np.zeros(torque.shape), 1.05 * np.abs(torque) + 0.02)
    return contacts, wrench, joints


def seconds(work: Callable[[], object]) -> float:
    """The quickest of three."""
    best = np.inf
    for _ in range(3):
        start = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - start)
    return best


def by_clarabel(
    contacts: Contacts, axes: np.ndarray, wrench: np.ndarray, sample: int
) -> np.ndarray:
    """The friction cone's forces by an interior-point method."""
    A = np.zeros((6 + 3 * LEGS, 3 * LEGS))
    for i in range(LEGS):
        at = slice(3 * i, 3 * i + 3)
        x, y, z = contacts.feet[sample, i]
        A[:3, at] = np.eye(3)
        A[3:6, at] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
        A[6 + 3 * i : 9 + 3 * i, at] = -axes[sample, i].T
        A[6 + 3 * i, at] *= FRICTION
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = 1e-13
    settings.tol_feas = 1e-12
    solver = clarabel.DefaultSolver(
        sparse.identity(3 * LEGS, format="csc"),
        np.zeros(3 * LEGS),
        sparse.csc_matrix(A),
        np.concatenate([wrench[sample], np.zeros(3 * LEGS)]),
        [clarabel.ZeroConeT(6), *[clarabel.SecondOrderConeT(3)] * LEGS],
        settings,
    )
    return np.asarray(solver.solve().x).reshape(LEGS, 3)


def members(tilt: float, ground: str) -> dict[str, float]:
    """Each member, on one kind of ground; seconds for all samples."""
    contacts, wrench, joints = loads(SAMPLES, tilt)
    free = JointLoad(joints.jacobian, joints.torque)
    rows = {name: (name, free) for name in FORCE_MODELS}
    rows["friction-cone, torque limits"] = ("friction-cone", joints)
    rows["friction-cone of least torque"] = (FrictionCone(MinimumTorque(0.05)), free)
    plain = friction_statistics(contacts, share_load(contacts, wrench))
    count = 100 * (plain.margin < 0).any(axis=1).mean()
    print(f"{SAMPLES} loads of {LEGS} feet, {ground}, one core")
    print(f"  the minimum norm would slip or pull in {count:.0f} % of them")
    found = {}
    for name, (model, load) in rows.items():
        took = seconds(lambda m=model, j=load: share_load(contacts, wrench, m, joints=j))
        print(f"  {name:<32} {1e6 * took / SAMPLES:8.1f} us a sample  {took:6.2f} s")
        found[name] = took
    return found


def side_by_side() -> dict[str, float]:
    """The friction cone by both solvers, from the same arrays to the same forces."""
    contacts, wrench, _ = loads(COMPARED, 0.2)
    axes = contacts.axes
    ours = share_load(contacts, wrench, "friction-cone")
    took = seconds(lambda: share_load(contacts, wrench, "friction-cone"))
    start = time.perf_counter()
    theirs = np.array([by_clarabel(contacts, axes, wrench, i) for i in range(COMPARED)])
    other = time.perf_counter() - start
    apart = np.abs(ours - theirs).max(axis=(1, 2))
    costs = [0.5 * np.sum(force**2, axis=(1, 2)) for force in (ours, theirs)]
    dearer = costs[1] - costs[0]
    agree = 100 * (apart < 1e-6).mean()
    print(f"friction cone, {COMPARED} loads on slopes")
    print(f"  daqp, as used here               {1e6 * took / COMPARED:8.1f} us a sample")
    print(f"  clarabel, to 1e-13               {1e6 * other / COMPARED:8.1f} us a sample")
    print(f"  ratio                            {other / took:8.1f}")
    print(f"  forces agree within 1e-6 N in    {agree:8.1f} % of the loads")
    print(f"  largest difference               {apart.max():8.1e} N")
    # Of two admissible forces the cheaper are nearer to the optimum.
    print(f"  its cost less ours, least, most  {dearer.min():8.1e}, {dearer.max():.1e} N^2")
    return {
        "daqp_us": 1e6 * took / COMPARED,
        "clarabel_us": 1e6 * other / COMPARED,
        "clarabel_over_daqp": other / took,
        "agree_within_1e-6_N_percent": float(agree),
        "largest_difference_N": float(apart.max()),
        "least_excess_cost_N2": float(dearer.min()),
        "most_excess_cost_N2": float(dearer.max()),
    }


def main(out: Path) -> None:
    """Both tables."""
    measured_on = machine(("daqp", "clarabel", "numpy", "scipy"))
    print(", ".join(f"{key} {value}" for key, value in measured_on.items()))
    results = {
        "machine": measured_on | {"threads": 1},
        "samples": SAMPLES,
        "legs": LEGS,
        "level_ground_s": members(0.0, "level ground"),
        "slopes_s": members(0.2, "slopes"),
        "friction_cone": side_by_side(),
    }
    write(results, out)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/benchmark-forces.json"))
    arguments = parser.parse_args()
    one_core = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    if one_core.items() <= os.environ.items():
        main(arguments.out)
    else:
        # The algebra libraries read these when they are loaded, so that a new process is needed.
        sys.exit(subprocess.call([sys.executable, *sys.argv], env={**os.environ, **one_core}))
