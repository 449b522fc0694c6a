"""The robot's own servos: position law, motor, gears and temperature of every joint."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.feed_forward.servo_goal import (
    goal_memory,
    goals_for_torque,
    inverse_law,
)
from phasmid.motion import Motion
from phasmid.robot import JOINTS, Servo
from phasmid.robot.friction_kernels import dry_friction
from phasmid.robot.servo import D_GAIN_UNIT, FULL_PUNCH, FULL_PWM, P_GAIN_UNIT
from phasmid.scenario import Scenario
from phasmid.simulation.drives import Drive, Setpoints

if TYPE_CHECKING:
    import mujoco

    from phasmid.simulation.loop import Samples

FIELDS = (
    "angle",
    "speed",
    "duty",
    "current",
    "torque",
    "friction",
    "temperature",
    "overloaded",
    "shutdown",
    "wait",
    "error",
    "change",
    "due",
)
"""State of a servo: rotor angle [rad] and speed [rad/s] at the output; duty (share of the supply),
current [A], torque on the joint and friction torque on the rotor [N·m] of this step; temperature
[°C]; time at the largest duty
[s]; reason of a shutdown; steps until the next reading of the position; position error [ticks] and
its filtered rate [ticks/s]; which of the delayed goals is due."""

SERVO_STATE = np.dtype([(name, np.float64) for name in FIELDS])

RUNNING, OVERLOADED, OVERHEATED, FAILED = 0.0, 1.0, 2.0, 3.0
"""Values of ``shutdown``."""

REASONS = {OVERLOADED: "overload", OVERHEATED: "overheating", FAILED: "failure"}

MOST_OF_LIMIT = 0.75
"""Allowed share of the largest stable step: legs are lighter in other poses."""


@compiled
def servo_step(
    target: np.ndarray,
    joint_angle: np.ndarray,
    joint_speed: np.ndarray,
    limits: np.ndarray,
    parameters: np.ndarray,
    servos: np.ndarray,
    delayed: np.ndarray,
    applied: np.ndarray,
) -> None:
    """Advance the servos of J joints by one step; compiled.

    The rotor is integrated by symplectic Euler, its friction implicitly: friction never turns the
    speed around, so that a rotor at rest stays so. The gears transmit at most the stall torque in
    either direction; beyond it the joint drags the rotor along.

    Args:
        target: Goals [rad], shape (J,).
        joint_angle: [rad], shape (J,).
        joint_speed: [rad/s], shape (J,).
        limits: Lowest and highest goal [rad], shape (2, J).
        parameters: From `servo_parameters`.
        servos: Records of `SERVO_STATE`, changed in place, shape (J,).
        delayed: Goals on their way [rad], changed in place, shape (J, steps of the delay).
        applied: Torques on the joints [N·m], written, shape (J,).
    """
    p = parameters[0]
    for j in range(len(target)):
        servo, goal = servos[j], target[j]
        if delayed.shape[1] > 0:
            due = int(servo.due)
            goal, delayed[j, due] = delayed[j, due], goal
            servo.due = (due + 1) % delayed.shape[1]
        if servo.wait <= 0.0:
            servo.wait = p.steps
            goal = min(max(goal, limits[0, j]), limits[1, j])
            error = math.floor(goal / p.tick + 0.5) - math.floor(joint_angle[j] / p.tick + 0.5)
            if p.is_pid > 0.0:
                slope = (error - servo.error) / (p.steps * p.dt)
                servo.change += p.smoothing * (slope - servo.change)
                duty = p.gain * error + p.change_gain * servo.change
            else:
                side = 0 if error < 0.0 else 1
                beyond = abs(error) - p.margin[side]
                duty = 0.0
                if beyond > 0.0:
                    duty = p.punch + (1.0 - p.punch) * beyond / p.slope[side]
                    if error < 0.0:
                        duty = -duty
            servo.error = error
            servo.duty = min(max(duty, -p.most), p.most)
        servo.wait -= 1.0

        angle, speed, running = servo.angle, servo.speed, servo.shutdown == 0.0
        current = 0.0
        if running:
            current = (servo.duty * p.voltage - p.constant * speed) / p.resistance
        else:
            servo.duty = 0.0

        twist = angle - joint_angle[j]
        rate = speed - joint_speed[j]
        torque = 0.0
        if twist > p.play:
            torque = max(p.stiffness * (twist - p.play) + p.damping * rate, 0.0)
        elif twist < -p.play:
            torque = min(p.stiffness * (twist + p.play) + p.damping * rate, 0.0)
        is_dragged = abs(torque) > p.limit
        if is_dragged:
            torque = p.limit if torque > 0.0 else -p.limit

        push = p.constant * current
        hold = p.dt / p.inertia * dry_friction(p, push, -torque, speed)
        speed += p.dt / p.inertia * (push - p.viscous * speed - torque)
        if speed > hold:
            speed -= hold
        elif speed < -hold:
            speed += hold
        else:
            speed = 0.0
        if is_dragged:
            speed = joint_speed[j]
            wound = p.play + p.limit / p.stiffness
            angle = joint_angle[j] + min(max(twist, -wound), wound)

        # Friction is what closes the balance of the rotor.
        friction = p.inertia / p.dt * (speed - servo.speed) + torque - push

        final = p.ambient + p.warming * current * current
        temperature = final + (servo.temperature - final) * p.fading
        if running:
            servo.overloaded = servo.overloaded + p.dt if abs(servo.duty) >= p.most else 0.0
            if temperature >= p.hottest:
                servo.shutdown = 2.0
            elif servo.overloaded > p.patience:
                servo.shutdown = 1.0
        servo.angle = angle + p.dt * speed
        servo.speed = speed
        servo.current = current
        servo.torque = torque
        servo.friction = friction
        servo.temperature = temperature
        applied[j] = torque


def servo_parameters(servo: Servo, dt: float, voltage: float, ambient: float) -> np.ndarray:
    """Return a servo's parameters in the units of `servo_step`, one record in an array.

    Args:
        servo: With its settings.
        dt: Time step [s].
        voltage: Supply [V].
        ambient: Temperature of the air [°C].
    """
    motor, steps = servo.motor, max(1, round(servo.control_period / dt))
    look = steps * dt
    values: dict[str, Any] = {
        "dt": dt,
        "tick": servo.resolution,
        "steps": steps,
        "is_pid": servo.law == "pid",
        "margin": servo.compliance_margin,
        "slope": servo.effective_slope,
        "most": servo.torque_limit,
        "gain": servo.gain_scale * servo.p_gain / P_GAIN_UNIT / FULL_PWM,
        "change_gain": servo.d_gain / D_GAIN_UNIT / FULL_PWM * servo.control_period,
        "smoothing": look / (look + servo.derivative_time),
        "punch": servo.punch / FULL_PUNCH,
        "voltage": voltage,
        "resistance": motor.resistance,
        "constant": motor.constant,
        **vars(motor.friction),
        "inertia": servo.armature,
        "play": servo.backlash / 2,
        "stiffness": servo.gear_stiffness,
        "damping": servo.gear_stiffness * servo.gear_damping_time,
        "ambient": ambient,
        "warming": servo.thermal_resistance * motor.resistance,
        "fading": math.exp(-dt / (servo.thermal_resistance * servo.heat_capacity)),
        "hottest": servo.temperature_limit,
        "patience": servo.overload_time,
        "limit": servo.stall_at(voltage),
    }
    kind = [(name, np.float64, np.shape(value)) for name, value in values.items()]
    return np.array([tuple(values.values())], dtype=kind)


def longest_servo_step(servo: Servo, mobility: float) -> float:
    """Return the longest time step that resolves a servo's gears on a robot's legs [s].

    In coordinates scaled by the masses the gears are a symmetric stiffness matrix K, gears and
    motor a damping matrix C. For an eigenvector u of a step of symplectic Euler, with k = u*Ku and
    c = u*Cu, its eigenvalue z obeys z² - (2 - c dt - k dt²) z + 1 - c dt = 0, and |z| < 1 where
    k dt² + 2 c dt < 4. No k or c exceeds the largest eigenvalue of its matrix.

    Args:
        servo: The servo.
        mobility: Largest eigenvalue of the joints' part of the inverse mass matrix
            [rad/s² per N·m].
    """
    motor = servo.motor
    k = servo.gear_stiffness * (mobility + 1 / servo.armature)
    brake = motor.constant**2 / motor.resistance + motor.viscous
    c = servo.gear_damping_time * k + brake / servo.armature
    limit = 4 * MOST_OF_LIMIT
    return limit / (math.sqrt(c * c + limit * k) + c)


class ServoDrive(Drive):
    """The robot's own servos, each with its law, motor, gears, backlash, friction and temperature.

    A rotor turns behind each joint's gears, which twist like a spring beyond their backlash; this
    spring gives the joint's torque. Where a joint is held against its load, friction helps, up to
    the stall torque: no measurement shows that gears hold more than the motor lifts. The gears'
    friction follows the motor's torque: a servo that has shut down is turned back against its
    Coulomb and viscous friction alone.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, walk: Motion, scenario: Scenario
    ) -> None:
        robot, table = walk.robot, scenario.servo
        servo, dt = scenario.servo.set_up(robot.servo), model.opt.timestep
        self._dt = dt
        voltage, self._ambient = table.supply(servo), table.ambient_temperature
        self._goal_law = inverse_law(servo, voltage)
        self._constant, self._most = servo.motor.constant, servo.torque_limit
        self._names = [f"{leg.name}.{joint}" for leg in robot.legs for joint in JOINTS]
        start = walk.sample(np.zeros(1)).q[0].ravel()
        joints, delay = len(start), round(servo.delay / dt)
        self._own = joints * len(FIELDS)
        self.state = np.zeros(self._own + joints * delay)
        self.servos = self.state[: self._own].view(SERVO_STATE)
        self._torque = self.servos["torque"]
        delayed = self.state[self._own :].reshape(joints, delay)
        self._limits = np.vstack([leg.joint_limits for leg in robot.legs]).T.copy()
        self._arguments = (
            data.qpos[7:],
            data.qvel[6:],
            self._limits,
            servo_parameters(servo, dt, voltage, self._ambient),
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
        self.servos["shutdown"][joint] = FAILED

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
        return np.asarray(np.where(servos["shutdown"] == OVERLOADED, 1.0, share))

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
            "servo_shutdown": servos["shutdown"] != RUNNING,
        }

    def remark(self, state: Float[np.ndarray, " state"]) -> str:
        """Return which servos had shut down in a state, and why; or nothing."""
        codes = state[: self._own].view(SERVO_STATE)["shutdown"]
        down = [
            f"{name} ({REASONS[float(code)]})"
            for name, code in zip(self._names, codes, strict=True)
            if code != RUNNING
        ]
        if not down:
            return ""
        more = f" and {len(down) - 2} more" if len(down) > 2 else ""
        verb = "servo had" if len(down) == 1 else "servos had"
        return f"{len(down)} {verb} shut down: {', '.join(down[:2])}{more}"
