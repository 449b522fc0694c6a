"""Compute torques, foot positions and joint angles of a leg for a million samples."""

import time

import numpy as np

import phasmid
from phasmid import dynamics, kinematics

leg = phasmid.load_robot("phantomx-paper").legs[0]
rng = np.random.default_rng(0)
q = rng.uniform([-0.5, 0.0, -2.0], [0.5, 0.8, -1.0], (1_000_000, 3))
qd, qdd = rng.normal(size=(2, 1_000_000, 3))

dynamics.leg_torque(
    leg, q[:1], qd[:1], qdd[:1], gravity=9.81
)  # compiles, or loads the compiled code
start = time.perf_counter()
torque = dynamics.leg_torque(leg, q, qd, qdd, gravity=9.81)
print(f"leg torques: {1e3 * (time.perf_counter() - start):.0f} ms, {abs(torque).max():.3f} N·m")

p = kinematics.foot_position(leg, q)
print(f"inverse of forward: {abs(kinematics.joint_angles(leg, p) - q).max():.0e} rad")
