"""A million samples: the same equations, compiled where numba is installed."""

import time

import numpy as np

import phasmid
from phasmid import batch, dynamics

leg = phasmid.load_robot("phantomx-paper").legs[0]
rng = np.random.default_rng(0)
q = rng.uniform([-0.5, 0.0, -2.0], [0.5, 0.8, -1.0], (1_000_000, 3))
qd, qdd = rng.normal(size=(2, 1_000_000, 3))

batch.leg_torque(leg, q[:1], qd[:1], qdd[:1])  # compiles, or finds what was compiled before
for name, work in {
    f"batch ({batch.backend()})": batch.leg_torque,
    "dynamics (NumPy)": dynamics.leg_torque,
}.items():
    start = time.perf_counter()
    torque = work(leg, q, qd, qdd)
    print(f"{name}: {1e3 * (time.perf_counter() - start):.0f} ms, {abs(torque).max():.3f} N·m")

p = batch.foot_position(leg, q)
print(f"inverse of forward: {abs(batch.joint_angles(leg, p) - q).max():.0e} rad")
