"""What moves the joints: prescribed motion, or ideal position servos."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from phasmid.control.feed_forward.servo_goal import SLOW
from phasmid.errors import PhasmidError
from phasmid.motion import Motion
from phasmid.simulation.model import JOINT_IMPEDANCE, drive_gains

if TYPE_CHECKING:
    import mujoco


class LostConstraints(PhasmidError):
    """The engine made no constraint for some of the joints that constraints hold."""

    def __init__(self) -> None:
        super().__init__(
            "the engine left out constraints that hold joints, whose torques are therefore unknown."
        )


class Setpoints(NamedTuple):
    """What the joints shall do at some steps, whatever moves them.

    Attributes:
        q: Angles [rad], shape (N, L, 3).
        qd: Speeds [rad/s], shape (N, L, 3).
        qdd: Accelerations [rad/s²], shape (N, L, 3).
        torque: Feed-forward torque beside what follows from the angles [N·m], shape (N, L, 3);
            None: none.
    """

    q: Float[np.ndarray, "samples legs 3"]
    qd: Float[np.ndarray, "samples legs 3"]
    qdd: Float[np.ndarray, "samples legs 3"]
    torque: Float[np.ndarray, "samples legs 3"] | None = None


@runtime_checkable
class Drive(Protocol):
    """Sets the joints' targets before each step and tells their torques after it.

    Attributes:
        state: All that the drive remembers from one step to the next, one row of numbers that is
            changed in place; empty where the joints' own state is all. It is recorded with every
            sample, and a run is continued from it.
    """

    state: Float[np.ndarray, " state"]

    def command(self, target: Float[np.ndarray, " joints"]) -> None:
        """Set what the joints shall do in the next step; one row of `targets`."""

    def begin(self, speed: Float[np.ndarray, " joints"]) -> None:
        """Start the walk with joint speeds [rad/s], shape (3 L,), after all has settled."""

    def torque(self) -> Float[np.ndarray, " joints"]:
        """Torques of the last step, leg by leg [N·m], shape (3 L,).

        Raises:
            LostConstraints: There are none.
        """

    def targets(self, wanted: Setpoints, dt: float) -> Float[np.ndarray, "samples joints"]:
        """What `command` is told so that setpoints are followed with a time step [s], (N, 3 L)."""

    def channels(self, states: Float[np.ndarray, "samples state"]) -> dict[str, np.ndarray]:
        """What the states of all samples tell a recording, by channel name."""

    def remark(self, state: Float[np.ndarray, " state"]) -> str:
        """What is wrong with the drive in a state, to be told when a run ends early; or nothing."""

    def fail(self, joint: int) -> None:
        """Let go of a joint from now on, counted leg by leg: it is limp."""


class Memoryless:
    """What drives share that remember nothing from one step to the next, and do not fail."""

    def __init__(self) -> None:
        self.state = np.empty(0)

    def begin(self, speed: Float[np.ndarray, " joints"]) -> None:
        """Nothing: these joints remember nothing."""
        del speed

    def channels(self, states: Float[np.ndarray, "samples state"]) -> dict[str, np.ndarray]:
        """Nothing: these joints remember nothing."""
        del states
        return {}

    def remark(self, state: Float[np.ndarray, " state"]) -> str:
        """Nothing: these joints do not fail."""
        del state
        return ""


class PrescribedDrive(Memoryless):
    """Joints that follow the plan exactly, whatever torque it takes: the paper's way.

    Each joint is held by an equality constraint; its force is the joint's torque.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, walk: Motion) -> None:
        super().__init__()
        self._data = data
        self._angle = model.eq_data[:, 0]
        self._held = np.arange(3 * len(walk.robot.legs))
        self._count = len(self._held)

    def command(self, target: Float[np.ndarray, " joints"]) -> None:
        """Set the angles at which the constraints hold."""
        self._angle[:] = target

    def torque(self) -> Float[np.ndarray, " joints"]:
        """Forces of the constraints, which stand first among the engine's constraint forces.

        Raises:
            LostConstraints: The engine left some of them out.
        """
        force: np.ndarray = self._data.efc_force[: self._count]
        if self._data.ne < self._count or len(force) < self._count:
            raise LostConstraints
        if self._count == len(self._angle):
            return force
        torque = np.zeros(len(self._angle))
        torque[self._held] = force
        return torque

    def fail(self, joint: int) -> None:
        """Take away a joint's constraint."""
        self._data.eq_active[joint] = 0
        self._held = self._held[self._held != joint]
        self._count = len(self._held)

    def targets(self, wanted: Setpoints, dt: float) -> Float[np.ndarray, "samples joints"]:
        """Angles to hold so that position, velocity and acceleration are those wanted.

        The engine's constraint asks for the acceleration -b q' - k (q - target), so a target of
        q + (b q' + q'')/k asks for the acceleration wanted. Its gains b and k come divided by the
        impedance, and once more multiplied in k.

        Args:
            wanted: At the steps; a feed-forward torque changes nothing, as these joints take
                whatever torque they need.
            dt: Time step [s].

        Returns:
            Shape (N, 3 L) [rad].
        """
        stiffness, damping = drive_gains(dt)
        angle = wanted.q + (damping * wanted.qd + JOINT_IMPEDANCE * wanted.qdd) / stiffness
        return angle.reshape(len(wanted.q), -1)


class IdealServoDrive(Memoryless):
    """Position servos with a torque that falls with speed, from stall to none at no load."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, walk: Motion) -> None:
        super().__init__()
        servo = walk.robot.servo
        self._control, self._force = data.ctrl, data.actuator_force
        self._velocity = data.qvel[6:]
        self._limits = model.actuator_forcerange
        self._lower, self._upper = self._limits.T
        # The engine's friction holds a load beside the motor; together they hold the stall torque.
        self._stall = max(servo.stall_torque - servo.friction, 0.0)
        self._friction = servo.friction
        self._stiffness: float | np.ndarray = servo.stiffness
        self._damping: float | np.ndarray = servo.damping
        self._drop_per_speed = self._stall / servo.no_load_speed
        self._gains, self._biases = model.actuator_gainprm, model.actuator_biasprm
        self._drop, self._loss = np.empty((2, model.nu))

    def command(self, target: Float[np.ndarray, " joints"]) -> None:
        """Set the servos' goals, and what torque they can give at the present speed."""
        self._control[:] = target
        # In-place ufuncs, with buffers of their own: this runs at every step.
        np.multiply(self._velocity, self._drop_per_speed, out=self._drop)
        np.subtract(self._stall, np.maximum(self._drop, 0.0, out=self._loss), out=self._loss)
        np.maximum(self._loss, 0.0, out=self._upper)
        np.add(self._stall, np.minimum(self._drop, 0.0, out=self._loss), out=self._loss)
        np.minimum(np.negative(self._loss, out=self._loss), 0.0, out=self._lower)

    def torque(self) -> Float[np.ndarray, " joints"]:
        """What the servos gave, their own friction not taken off."""
        force: np.ndarray = self._force
        return force

    def fail(self, joint: int) -> None:
        """Take a joint's motor away; rotor and friction stay."""
        self._gains[joint] = self._biases[joint] = 0.0

    def targets(self, wanted: Setpoints, dt: float) -> Float[np.ndarray, "samples joints"]:
        """Goals of the servos, shape (N, 3 L) [rad], whatever the time step.

        A servo gives its stiffness times how far it is from its goal: a goal further by the
        feed-forward torque over that stiffness adds this torque, within the servo's limits. With
        it goes what the servo's damping and friction take from the wanted motion.
        """
        del dt
        goal = wanted.q.reshape(len(wanted.q), -1)
        if wanted.torque is None:
            return goal
        speed = wanted.qd.reshape(goal.shape)
        torque = wanted.torque.reshape(goal.shape) + self._damping * speed
        return goal + (torque + self._friction_at(speed)) / self._stiffness

    def _friction_at(self, speed: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Torque that friction takes from joints that turn [N·m]; slow ones have part of it."""
        # As np.clip, in a third of its time.
        return self._friction * np.minimum(np.maximum(speed / SLOW, -1.0), 1.0)
