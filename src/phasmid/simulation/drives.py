"""Joint drives: prescribed motion, ideal position servos, and torque control.

The robot's own servos, with their law, motor and gears, are in `servo`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.experiment import Experiment
from phasmid.forces import holding_forces, planned_load
from phasmid.motion import Motion, SampledMotion, Walk
from phasmid.servo.law_kernels import SLOW
from phasmid.simulation.model import JOINT_IMPEDANCE, drive_gains, joint_gains

if TYPE_CHECKING:
    import mujoco

    from phasmid.simulation.loop import Samples


class Setpoints(NamedTuple):
    """Reference motion of the joints at N steps, for any drive.

    Attributes:
        q: Angles [rad], shape (N, L, 3).
        qd: Velocities [rad/s], shape (N, L, 3).
        qdd: Accelerations [rad/s²], shape (N, L, 3).
        torque: Feed-forward torque [N·m], shape (N, L, 3); None: none.
    """

    q: Float[np.ndarray, "samples legs 3"]
    qd: Float[np.ndarray, "samples legs 3"]
    qdd: Float[np.ndarray, "samples legs 3"]
    torque: Float[np.ndarray, "samples legs 3"] | None = None


class Drive:
    """Applies commands to the joints before each step, and reads their torques after it.

    Attributes:
        state: The drive's own state, changed in place; empty where it has none. It is recorded
            with every sample and restored with a run.
    """

    def __init__(self) -> None:
        self.state: Float[np.ndarray, " state"] = np.empty(0)

    def targets(self, setpoints: Setpoints) -> Float[np.ndarray, "samples joints"]:
        """Convert setpoints to the input of `command`, shape (N, 3 L)."""
        raise NotImplementedError

    def command(self, target: Float[np.ndarray, " joints"]) -> None:
        """Apply one row of `targets` in the next step."""
        raise NotImplementedError

    def torque(self) -> Float[np.ndarray, " joints"]:
        """Return the torques transmitted to the links in the last step [N·m], shape (3 L,).

        The torque of a joint acts at its axis: friction and inertia of the servo's rotor are
        subtracted from the motor's torque.
        """
        raise NotImplementedError

    def output(self) -> Float[np.ndarray, " joints"]:
        """Return the servos' outputs in the last step over the largest one, shape (3 L,)."""
        raise NotImplementedError

    def load(self, samples: Samples) -> Float[np.ndarray, "samples joints"]:
        """Return shares of the largest torques of joints in N samples; joints below 1 follow.

        Joints that never give way have no largest torque.
        """
        return np.zeros(samples["torque"].shape)

    def fail(self, joint: int) -> None:
        """Make a joint limp from now on; joints are counted leg by leg."""
        raise NotImplementedError

    def begin(self, speed: Float[np.ndarray, " joints"]) -> None:
        """Reset the state after the robot has settled, with joint velocities [rad/s], (3 L,)."""

    def channels(self, states: Float[np.ndarray, "samples state"]) -> dict[str, np.ndarray]:
        """Return the recorded channels of states."""
        del states
        return {}

    def remark(self, state: Float[np.ndarray, " state"]) -> str:
        """Return the failures in a state, for the message of a run that ends early; or nothing."""
        del state
        return ""


class PrescribedDrive(Drive):
    """Joints that follow the setpoints exactly, whatever torque it takes, as in the paper.

    Each joint is held by an equality constraint, whose force is the joint's torque.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, walk: Motion) -> None:
        super().__init__()
        self._data, self._angle = data, model.eq_data[:, 0]
        self._full = walk.robot.arrays.strength.ravel() * walk.robot.servo.full_output_torque
        self._gains = drive_gains(model.opt.timestep)
        self._held = np.arange(3 * len(walk.robot.legs))

    def command(self, target: Float[np.ndarray, " joints"]) -> None:
        """Set the angles of the constraints [rad]."""
        self._angle[:] = target

    def torque(self) -> Float[np.ndarray, " joints"]:
        """Return the forces of the constraints, which come first among MuJoCo's."""
        torque = np.zeros(len(self._angle))
        torque[self._held] = self._data.efc_force[: len(self._held)]
        return torque

    def output(self) -> Float[np.ndarray, " joints"]:
        """Return the joint torques over those of the servos' full output."""
        return self.torque() / self._full

    def fail(self, joint: int) -> None:
        """Disable a joint's constraint."""
        self._data.eq_active[joint] = 0
        self._held = self._held[self._held != joint]

    def targets(self, setpoints: Setpoints) -> Float[np.ndarray, "samples joints"]:
        """Return the constraint angles that give the acceleration of the setpoints.

        A constraint has the reference acceleration -b q' - k (q - target), so that a target of
        q + (b q' + q'')/k gives q''. MuJoCo takes the gains b and k divided by the impedance,
        and k divided by it once more. Torques of the setpoints have no effect.
        """
        stiffness, damping = self._gains
        q, qd, qdd, _ = setpoints
        return (q + (damping * qd + JOINT_IMPEDANCE * qdd) / stiffness).reshape(len(q), -1)


class IdealServoDrive(Drive):
    """Position servos whose largest torque falls with speed, from stall to none at no load.

    The state has the torques of the motors and of the servos' friction in the last step [N·m].
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, walk: Motion) -> None:
        super().__init__()
        servo, joints = walk.robot.servo, 3 * len(walk.robot.legs)
        self.state = np.zeros(2 * joints)
        self._motor, self._friction_torque = self.state.reshape(2, joints)
        self._torque = np.zeros(joints)
        self._data, self._acceleration = data, data.qacc[6:]
        self._added_inertia = -model.dof_armature[6:]
        arrays = walk.robot.arrays
        # MuJoCo has no row for a joint without friction.
        self._rubbing = np.flatnonzero(arrays.friction)
        self._full = arrays.strength.ravel() * servo.full_output_torque
        # MuJoCo's friction holds a load beside the motor; together they hold the stall torque.
        self._stall = np.maximum(arrays.stall_torque - arrays.friction, 0.0).ravel()
        self._drop = self._stall / arrays.no_load_speed.ravel()
        self._goal, self._speed, self._force = data.ctrl, data.qvel[6:], data.actuator_force
        self._limits = model.actuator_forcerange
        self._friction = arrays.friction
        self._stiffness = arrays.strength * servo.stiffness
        self._damping = arrays.strength * servo.damping
        self._gains, self._biases = model.actuator_gainprm, model.actuator_biasprm

    def command(self, target: Float[np.ndarray, " joints"]) -> None:
        """Set the servos' goals [rad], and the torque limits at the present speed."""
        drop = self._drop * self._speed
        self._goal[:] = target
        self._limits[:, 0] = np.minimum(-self._stall - np.minimum(drop, 0.0), 0.0)
        self._limits[:, 1] = np.maximum(self._stall - np.maximum(drop, 0.0), 0.0)

    def torque(self) -> Float[np.ndarray, " joints"]:
        """Return the motors' torques with friction and without the part that turns the rotors.

        Friction is a constraint of MuJoCo; its rows come first, as there are no equalities.
        """
        self._motor[:] = self._force
        self._friction_torque[self._rubbing] = self._data.efc_force[: len(self._rubbing)]
        np.multiply(self._added_inertia, self._acceleration, out=self._torque)
        self._torque += self._motor
        self._torque += self._friction_torque
        return self._torque

    def output(self) -> Float[np.ndarray, " joints"]:
        """Return the motors' torques over those of the servos' full output."""
        force: np.ndarray = self._force
        return force / self._full

    def load(self, samples: Samples) -> Float[np.ndarray, "samples joints"]:
        """Return the motors' torques over the stall torque."""
        motor = np.abs(samples["drive"][:, : len(self._stall)])
        return np.asarray(motor / np.maximum(self._stall, 1e-9))

    def channels(self, states: Float[np.ndarray, "samples state"]) -> dict[str, np.ndarray]:
        """Return the torques of motor and friction of every servo."""
        motor, friction = states.reshape(len(states), 2, -1, 3).swapaxes(0, 1)
        return {"servo_motor_torque": motor, "servo_friction_torque": friction}

    def fail(self, joint: int) -> None:
        """Remove a joint's motor; rotor and friction stay."""
        self._gains[joint] = self._biases[joint] = 0.0

    def targets(self, setpoints: Setpoints) -> Float[np.ndarray, "samples joints"]:
        """Return the servos' goals [rad].

        A servo gives its stiffness times the distance to its goal, so that a goal further by
        torque over stiffness adds a torque: the feed-forward torque, damping and friction.
        """
        q, qd, _, torque = setpoints
        if torque is not None:
            q = q + (torque + self._damping * qd + self._friction_at(qd)) / self._stiffness
        return q.reshape(len(q), -1)

    def _friction_at(self, speed: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Return the friction torque at a speed [N·m]; part of it at slow speeds."""
        return self._friction * np.clip(speed / SLOW, -1.0, 1.0)


class TorqueDrive(IdealServoDrive):
    """Torque-controlled joints, with the torque limits, rotor and friction of an ideal servo.

    The torque is the feed-forward torque, friction, and a spring and a damper about the setpoint.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, walk: Motion, experiment: Experiment
    ) -> None:
        super().__init__(model, data, walk)
        self._stiffness, self._damping = joint_gains(experiment)
        self._friction = self._friction.ravel()

    def targets(self, setpoints: Setpoints) -> Float[np.ndarray, "samples joints"]:
        """Return the torques at zero angle and speed [N·m]; MuJoCo adds spring and damper."""
        q, qd, _, torque = setpoints
        q, qd = q.reshape(len(q), -1), qd.reshape(len(q), -1)
        total = self._stiffness * q + self._damping * qd + self._friction_at(qd)
        return total if torque is None else total + torque.reshape(len(q), -1)


def check_feed_forward(experiment: Experiment, walk: Motion) -> None:
    """Refuse the torque drive for a trajectory, whose stance feet are unknown.

    Raises:
        InvalidInput: The drive is ``torque`` and the motion is no planned walk.
    """
    if experiment.solver.drive == "torque" and not isinstance(walk, Walk):
        raise InvalidInput(
            'drive is "torque" and the joints follow a trajectory without foot '
            "contacts; it must be another drive.",
            hint='drive = "ideal-servo"',
        )


def walking_torque(experiment: Experiment, walk: Walk) -> Float[np.ndarray, "samples legs 3"]:
    """Return the model torques of a sampled plan with the servos' rotors [N·m], shape (N, L, 3).

    Raises:
        InfeasibleLoad: The stance feet cannot give what the motion needs.
    """
    return planned_load(experiment, walk).torque + walk.robot.arrays.armature * walk.qdd


def standing_torque(
    experiment: Experiment, start: SampledMotion
) -> Float[np.ndarray, "samples legs 3"]:
    """Return the static torques of a robot on all its feet [N·m], shape (N, L, 3).

    Raises:
        InfeasibleLoad: Its feet lie on a line.
    """
    trunk, ground, feet = start.trunk, experiment.world.planned_terrain, start.foot_position[0]
    pose = trunk.position[0], trunk.rotation[0], start.q[0], feet
    stance = np.ones(len(feet), dtype=bool)
    return holding_forces(experiment, *pose, stance, ground).torque[None]
