"""What torques a motion needs: the leg's equations in closed form, and the whole robot."""

from phasmid.dynamics.body_motion import BodyMotion
from phasmid.dynamics.leg import LegMatrices, leg_matrices, leg_torque
from phasmid.dynamics.whole_body import (
    JointTorqueAndWrench,
    inverse_dynamics,
    kinetic_energy,
    potential_energy,
)

__all__ = [
    "BodyMotion",
    "JointTorqueAndWrench",
    "LegMatrices",
    "inverse_dynamics",
    "kinetic_energy",
    "leg_matrices",
    "leg_torque",
    "potential_energy",
]
