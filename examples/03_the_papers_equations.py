"""Compute Equation 10 of the paper, corrected and as printed, and the errors of its misprints."""

import numpy as np

from phasmid import dynamics, load_robot
from phasmid.dynamics.printed import EQ_10, printed_leg_torque
from phasmid.paper.misprints import MISPRINTS
from phasmid.robot import with_mass_model

# The print assumes masses at mid-length; so only the misprints make a difference.
leg = with_mass_model(load_robot("phantomx-paper"), "mid-length").legs[0]
q, qd, qdd = np.radians([10.0, 20.0, -80.0]), np.array([1.0, 2.0, 3.0]), np.array([5.0, 5.0, 5.0])

M, B, C, G = dynamics.leg_matrices(leg, q, gravity=9.81)
products = np.array([qd[0] * qd[1], qd[0] * qd[2], qd[1] * qd[2]])
torque = M @ qdd + B @ products + C @ qd**2 + G
print("corrected ", np.round(1000 * torque, 3), "mN·m")
print("as printed", np.round(1000 * printed_leg_torque(leg, q, qd, qdd, gravity=9.81), 3), "mN·m")

# The ground pushes up with 10 N: Eq 11 as printed has the wrong sign.
up = np.array([0.0, 0.0, 10.0])
print(
    "on the ground, corrected ",
    dynamics.leg_torque(leg, q, qd, qdd, foot_force=up, gravity=9.81).round(3),
)
print(
    "on the ground, as printed",
    printed_leg_torque(leg, q, qd, qdd, foot_force=up, gravity=9.81).round(3),
)

print("\nlargest errors by one misprint of Eq 10, random states:")
entries = [row for row in MISPRINTS if row.switches < EQ_10]
for row in sorted(entries, key=lambda row: -row.cost().random.largest)[:5]:
    print(f"  {row.where}: {1000 * row.cost().random.largest:.2g} mN·m")
