"""The robot's own servos: position law, motor, gears and temperature of every joint."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.motion import Motion
from phasmid.robot import JOINTS
from phasmid.servo.law import (
    SERVO_STATE,
    inverse_law,
    servo_parameters,
)
from phasmid.servo.law_kernels import Shutdown, goal_memory, goals_for_torque, servo_step
from phasmid.simulation.drives import Drive, Setpoints

if TYPE_CHECKING:
    import mujoco

    from phasmid.simulation.loop import Samples


class ServoDrive(Drive):
    """The robot's own servos, each with its law, motor, gears, backlash, friction and temperature.

    A rotor turns behind each joint's gears, which twist like a spring beyond their backlash; this
    spring gives the joint's torque. Where a joint is held against its load, friction helps, up to
    the stall torque: no measurement shows that gears hold more than the motor lifts. The gears'
    friction follows the motor's torque: a servo that has shut down is turned back against its
    Coulomb and viscous friction alone.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, walk: Motion) -> None:
        robot, servo, dt = walk.robot, walk.robot.servo, model.opt.timestep
        self._dt, self._ambient = dt, servo.ambient_temperature
        self._goal_law = inverse_law(servo)
        self._constant, self._most = servo.motor.constant, servo.torque_limit
        self._names = [f"{leg.name}.{joint}" for leg in robot.legs for joint in JOINTS]
        start = walk.sample(np.zeros(1)).q[0].ravel()
        joints, delay = len(start), round(servo.delay / dt)
        self._own = joints * SERVO_STATE.itemsize // np.dtype(float).itemsize
        self.state = np.zeros(self._own + joints * delay)
        self.servos = self.state[: self._own].view(SERVO_STATE)
        self._torque = self.servos["torque"]
        delayed = self.state[self._own :].reshape(joints, delay)
        self._limits = np.vstack([leg.joint_limits for leg in robot.legs]).T.copy()
        self._arguments = (
            data.qpos[7:],
            data.qvel[6:],
            self._limits,
            servo_parameters(servo, dt),
            self.servos,
            delayed,
            data.qfrc_applied[6:],
        )
        self.servos["angle"], delayed[:] = start, start[:, None]
        self.begin(np.zeros(joints))

    def begin(self, speed: Float[np.ndarray, " joints"]) -> None:
        """Start cold and not overloaded, with rotors that turn as the joints do [rad/s]."""
        self.servos["speed"] = speed
        self.servos["temperature"] = self._ambient
        self._goal_memory = goal_memory(len(speed))
        for name in ("overloaded", "shutdown", "wait"):
            self.servos[name] = 0.0

    def command(self, target: Float[np.ndarray, " joints"]) -> None:
        """Advance the servos towards their goals [rad], and apply their torques."""
        servo_step(target, *self._arguments)

    def fail(self, joint: int) -> None:
        """Shut a servo down for good."""
        self.servos["shutdown"][joint] = Shutdown.FAILURE

    def torque(self) -> Float[np.ndarray, " joints"]:
        """Return the gears' torques on the joints."""
        return self._torque

    def output(self) -> Float[np.ndarray, " joints"]:
        """Return the servos' shares of the supply."""
        duty: np.ndarray = self.servos["duty"]
        return duty.copy()

    def load(self, samples: Samples) -> Float[np.ndarray, "samples joints"]:
        """Return the servos' shares of their largest duty; 1 after a shutdown by overload."""
        servos = samples["drive"][:, : self._own].view(SERVO_STATE)
        share = np.abs(servos["duty"]) / self._most
        return np.asarray(np.where(servos["shutdown"] == Shutdown.OVERLOAD, 1.0, share))

    def targets(self, setpoints: Setpoints) -> Float[np.ndarray, "samples joints"]:
        """Return the servos' goals [rad].

        These servos take no torque: their law is inverted, so that it gives the feed-forward
        torque where the joint is at its setpoint.
        """
        q = setpoints.q.reshape(len(setpoints.q), -1)
        if setpoints.torque is None:
            return q
        qd, torque = setpoints.qd.reshape(q.shape), setpoints.torque.reshape(q.shape)
        return goals_for_torque(q, qd, torque, self._goal_law, self._dt, self._goal_memory)

    def channels(self, states: Float[np.ndarray, "samples state"]) -> dict[str, np.ndarray]:
        """Return output, motor, friction, rotor speed, temperature and shutdown of every servo."""
        servos = states[:, : self._own].view(SERVO_STATE).reshape(len(states), -1, 3)
        names = "duty", "current", "speed", "temperature"
        channels = {f"servo_{name}": servos[name] for name in names}
        return channels | {
            "servo_motor_torque": self._constant * servos["current"],
            "servo_friction_torque": servos["friction"],
            "servo_shutdown": servos["shutdown"] != Shutdown.NONE,
        }

    def remark(self, state: Float[np.ndarray, " state"]) -> str:
        """Return which servos had shut down in a state, and why; or nothing."""
        codes = state[: self._own].view(SERVO_STATE)["shutdown"]
        down = [
            f"{name} ({Shutdown(code).name.lower()})"
            for name, code in zip(self._names, codes, strict=True)
            if code != Shutdown.NONE
        ]
        if not down:
            return ""
        more = f" and {len(down) - 2} more" if len(down) > 2 else ""
        verb = "servo had" if len(down) == 1 else "servos had"
        return f"{len(down)} {verb} shut down: {', '.join(down[:2])}{more}"
