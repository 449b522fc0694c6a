"""Torques of a motion: the leg's equations in closed form, and the whole robot's."""

from phasmid.dynamics.body_motion import BodyMotion
from phasmid.dynamics.floating_base import (
    Accelerations,
    Momentum,
    bias_force,
    foot_jacobian,
    forward_dynamics,
    gravity_force,
    mass_matrix,
    momentum,
)
from phasmid.dynamics.leg import leg_matrices, leg_torque
from phasmid.dynamics.matrices import LegMatrices
from phasmid.dynamics.whole_body import (
    JointTorqueAndWrench,
    inverse_dynamics,
    kinetic_energy,
    potential_energy,
)

__all__ = [
    "Accelerations",
    "BodyMotion",
    "JointTorqueAndWrench",
    "LegMatrices",
    "Momentum",
    "bias_force",
    "foot_jacobian",
    "forward_dynamics",
    "gravity_force",
    "inverse_dynamics",
    "kinetic_energy",
    "leg_matrices",
    "leg_torque",
    "mass_matrix",
    "momentum",
    "potential_energy",
]
