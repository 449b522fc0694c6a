"""Joints that are driven by torque: what the motion takes, and more against errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.errors import InvalidInput
from phasmid.forces import minimum_norm, planned_torque
from phasmid.kinematics import jacobian
from phasmid.motion import Motion, SampledMotion, Walk
from phasmid.scenario import Scenario
from phasmid.simulation.drives import IdealServoDrive, Setpoints
from phasmid.simulation.model import joint_gains

if TYPE_CHECKING:
    import mujoco


class TorqueDrive(IdealServoDrive):
    """Joints whose motors give a torque, within a line that falls with speed.

    The torque is that which is fed forward, and a spring and a damper about the wanted angle and
    speed; rotor and friction are the servo's, and the friction is fed forward too.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, walk: Motion, scenario: Scenario
    ) -> None:
        super().__init__(model, data, walk)
        self._stiffness, self._damping = joint_gains(walk.robot, scenario)

    def targets(self, wanted: Setpoints, dt: float) -> Float[np.ndarray, "samples joints"]:
        """Torques that the motors would give at angle and speed zero, shape (N, 3 L) [N·m].

        From there spring and damper count in the engine, so that they act at each of its steps.
        """
        del dt
        count = len(wanted.q)
        q, qd = wanted.q.reshape(count, -1), wanted.qd.reshape(count, -1)
        torque = self._stiffness * q + self._damping * qd + self._friction_at(qd)
        if wanted.torque is not None:
            torque += wanted.torque.reshape(count, -1)
        return torque


def check_feed_forward(scenario: Scenario, walk: Motion) -> None:
    """Refuse to drive joints by torque along a motion of which no torque is known.

    Raises:
        InvalidInput: It is no plan of a walk: nobody knows which of its feet stand.
    """
    if scenario.simulation.drive == "torque" and not isinstance(walk, Walk):
        raise InvalidInput(
            'drive is "torque" and the joints follow a trajectory, which does not tell which feet '
            "stand; it must be another drive.",
            hint='"ideal-servo"',
        )


def walking_torque(scenario: Scenario, walk: Walk) -> Float[np.ndarray, "samples legs 3"]:
    """What a plan takes by inverse dynamics, the servos' rotors included [N·m].

    Args:
        scenario: Tells how the feet share the load.
        walk: The plan at some times.

    Raises:
        InfeasibleLoad: The standing feet cannot give what the motion needs.
    """
    return planned_torque(scenario, walk) + walk.robot.servo.armature * walk.qdd


def standing_torque(
    scenario: Scenario, start: SampledMotion
) -> Float[np.ndarray, "samples legs 3"]:
    """What holds a robot that stands on all its feet [N·m], shape (N, L, 3).

    Args:
        scenario: Its gravity is used.
        start: Where it stands.

    Raises:
        InfeasibleLoad: Its feet lie on a line.
    """
    robot, trunk, q = start.robot, start.trunk, start.q
    R, still = trunk.rotation, np.zeros_like(q)
    body = BodyMotion.at_rest(trunk.position, R)
    gravity = scenario.model.gravity
    torque, wrench = inverse_dynamics(robot, body, q, still, still, gravity=gravity)
    feet = start.foot_position - trunk.position[:, None]
    force = minimum_norm(feet, np.ones(q.shape[:-1], dtype=bool), wrench)
    J = R[:, None] @ robot.arrays.R_body_hip @ jacobian(robot.arrays, q)
    return torque - np.einsum("...ij,...i->...j", J, force)
