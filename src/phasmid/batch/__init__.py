"""The equations of kinematics and dynamics over millions of samples, compiled where numba is."""

from phasmid.batch.compiled import backend
from phasmid.batch.leg import foot_position, jacobian, joint_angles, leg_torque
from phasmid.batch.whole_body import inverse_dynamics

__all__ = [
    "backend",
    "foot_position",
    "inverse_dynamics",
    "jacobian",
    "joint_angles",
    "leg_torque",
]
