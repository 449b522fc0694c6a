"""The robot's own servos: position law, motor, gears and temperature of every joint."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.feed_forward.servo_goal import (
    FULL_PUNCH,
    FULL_PWM,
    goal_memory,
    goals_for_torque,
    inverse_law,
)
from phasmid.motion import Motion
from phasmid.robot import JOINTS, Robot, Servo
from phasmid.scenario import Scenario
from phasmid.simulation.drives import Setpoints

if TYPE_CHECKING:
    import mujoco

FIELDS = (
    "angle",
    "speed",
    "duty",
    "current",
    "torque",
    "temperature",
    "overloaded",
    "shutdown",
    "wait",
    "error",
    "change",
)
"""Rows of a servo's state, one column per joint: rotor angle [rad] and speed [rad/s] at the output;
duty (share of the supply), current [A] and torque on the joint [N·m] of this step; temperature
[°C]; time at the largest duty [s]; reason of a shutdown; steps until the next reading of the
position; position error [ticks] and its filtered rate [ticks/s]. Servos with a delay have further
rows: which goal is due, and the goals on their way [rad]."""

RUNNING, OVERLOADED, OVERHEATED, FAILED = 0.0, 1.0, 2.0, 3.0
"""Values of ``shutdown``."""

REASONS = {OVERLOADED: "overload", OVERHEATED: "overheating", FAILED: "failure"}

MOST_OF_LIMIT = 0.75
"""Allowed share of the largest stable step: legs are lighter in other poses."""


def servo_step(
    target: np.ndarray,
    joint_angle: np.ndarray,
    joint_speed: np.ndarray,
    limits: np.ndarray,
    numbers: np.ndarray,
    state: np.ndarray,
    applied: np.ndarray,
) -> None:
    """Advance every joint's servo by one step; compiled.

    The rotor is integrated by symplectic Euler, its friction implicitly: friction never turns the
    speed around, so that a rotor at rest stays so. The gears transmit at most the stall torque in
    either direction; beyond it the joint drags the rotor along.

    Args:
        target: Goals [rad], shape (J,).
        joint_angle: [rad], shape (J,).
        joint_speed: [rad/s], shape (J,).
        limits: Lowest and highest goal [rad], shape (2, J).
        numbers: From `servo_numbers`.
        state: Rows of `FIELDS` and of goals on their way, changed in place, (`state_rows`, J).
        applied: Torques on the joints [N·m], written, shape (J,).
    """
    dt, tick, steps, pid = numbers[0], numbers[1], numbers[2], numbers[3]
    most, gain, change_gain, smoothing = numbers[8], numbers[9], numbers[10], numbers[11]
    punch, voltage, resistance, constant = numbers[12], numbers[13], numbers[14], numbers[15]
    loss, coulomb, viscous, inertia = numbers[16], numbers[17], numbers[18], numbers[19]
    play, stiffness, damping = numbers[20], numbers[21], numbers[22]
    ambient, warming, fading = numbers[23], numbers[24], numbers[25]
    hottest, patience, limit = numbers[26], numbers[27], numbers[28]
    delay = int(numbers[29])
    for j in range(target.shape[0]):
        aim = target[j]
        if delay > 0:
            due = int(state[11, j])
            aim, state[12 + due, j] = state[12 + due, j], aim
            state[11, j] = (due + 1) % delay
        if state[8, j] <= 0.0:
            state[8, j] = steps
            goal = min(max(aim, limits[0, j]), limits[1, j])
            error = math.floor(goal / tick + 0.5) - math.floor(joint_angle[j] / tick + 0.5)
            if pid > 0.0:
                slope = (error - state[9, j]) / (steps * dt)
                state[10, j] += smoothing * (slope - state[10, j])
                duty = gain * error + change_gain * state[10, j]
            else:
                side = 4 if error < 0.0 else 6
                beyond = abs(error) - numbers[side]
                duty = 0.0
                if beyond > 0.0:
                    duty = punch + (1.0 - punch) * beyond / numbers[side + 1]
                    if error < 0.0:
                        duty = -duty
            state[9, j] = error
            state[2, j] = min(max(duty, -most), most)
        state[8, j] -= 1.0

        angle, speed, running = state[0, j], state[1, j], state[7, j] == 0.0
        duty = state[2, j]
        current = 0.0
        if running:
            current = (duty * voltage - constant * speed) / resistance
        else:
            duty = 0.0
            state[2, j] = 0.0

        twist = angle - joint_angle[j]
        rate = speed - joint_speed[j]
        torque = 0.0
        if twist > play:
            torque = max(stiffness * (twist - play) + damping * rate, 0.0)
        elif twist < -play:
            torque = min(stiffness * (twist + play) + damping * rate, 0.0)
        is_dragged = abs(torque) > limit
        if is_dragged:
            torque = limit if torque > 0.0 else -limit

        push = constant * current
        speed += dt / inertia * (push - viscous * speed - torque)
        hold = dt / inertia * (coulomb + loss * abs(push))
        if speed > hold:
            speed -= hold
        elif speed < -hold:
            speed += hold
        else:
            speed = 0.0
        if is_dragged:
            speed = joint_speed[j]
            wound = play + limit / stiffness
            angle = joint_angle[j] + min(max(twist, -wound), wound)

        final = ambient + warming * current * current
        temperature = final + (state[5, j] - final) * fading
        if running:
            if abs(duty) >= most:
                state[6, j] += dt
            else:
                state[6, j] = 0.0
            if temperature >= hottest:
                state[7, j] = 2.0
            elif state[6, j] > patience:
                state[7, j] = 1.0
        state[0, j] = angle + dt * speed
        state[1, j] = speed
        state[3, j] = current
        state[4, j] = torque
        state[5, j] = temperature
        applied[j] = torque


def servo_numbers(
    servo: Servo, dt: float, voltage: float, ambient: float
) -> Float[np.ndarray, " numbers"]:
    """Return a servo's parameters in the order and units of `servo_step`.

    Args:
        servo: With its settings.
        dt: Time step [s].
        voltage: Supply [V].
        ambient: Temperature of the air [°C].
    """
    motor, slope, margin = servo.motor, servo.effective_slope, servo.compliance_margin
    steps = max(1, round(servo.control_period / dt))
    look = steps * dt
    return np.array(
        [
            dt,
            servo.resolution,
            steps,
            float(servo.law == "pid"),
            margin[0],
            slope[0],
            margin[1],
            slope[1],
            servo.torque_limit,
            servo.p_gain / 128 / FULL_PWM,
            servo.d_gain / 16 / FULL_PWM * servo.control_period,
            look / (look + servo.derivative_time),
            servo.punch / FULL_PUNCH,
            voltage,
            motor.resistance,
            motor.constant,
            motor.load_loss,
            motor.coulomb,
            motor.viscous,
            servo.armature,
            servo.backlash / 2,
            servo.gear_stiffness,
            servo.gear_stiffness * servo.gear_damping_time,
            ambient,
            servo.thermal_resistance * motor.resistance,
            math.exp(-dt / (servo.thermal_resistance * servo.heat_capacity)),
            servo.temperature_limit,
            servo.overload_time,
            servo.stall_at(voltage),
            round(servo.delay / dt),
        ]
    )


def state_rows(numbers: Float[np.ndarray, " numbers"]) -> int:
    """Return the number of rows of a servo's state: `FIELDS`, and goals on their way."""
    delay = int(numbers[29])
    return len(FIELDS) + (delay + 1 if delay > 0 else 0)


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
    return (math.sqrt(c * c + limit * k) - c) / k


def own_servo(scenario: Scenario, robot: Robot) -> Servo:
    """Return a robot's servo with a scenario's settings and a rotor; see `Servo.rotor_inertia`."""
    servo = scenario.servo.set_up(robot.servo)
    return replace(servo, armature=servo.rotor_inertia)


class ServoDrive:
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
        servo = own_servo(scenario, robot)
        start = walk.sample(np.zeros(1)).q[0].ravel()
        data.qpos[7:] = start
        limits = np.vstack([leg.joint_limits for leg in robot.legs]).T
        voltage, self._ambient = table.supply(servo), table.ambient_temperature
        numbers = servo_numbers(servo, model.opt.timestep, voltage, self._ambient)
        self._goal_law = inverse_law(servo, voltage)
        self._names = [f"{leg.name}.{joint}" for leg in robot.legs for joint in JOINTS]
        self._rows = np.zeros((state_rows(numbers), len(start)))
        self.state = self._rows.ravel()
        self._torque = self._row("torque")
        self._step = compiled(servo_step)
        self._limits = np.ascontiguousarray(limits)
        joints = data.qpos[7:], data.qvel[6:], self._limits
        self._arguments = (*joints, numbers, self._rows, data.qfrc_applied[6:])
        # Compiles here and not during the run.
        self.command(start)
        self._rows[:] = 0.0
        self._row("angle")[:] = start
        self._rows[len(FIELDS) + 1 :] = start
        self.begin(np.zeros(len(start)))

    def _row(self, name: str) -> np.ndarray:
        row: np.ndarray = self._rows[FIELDS.index(name)]
        return row

    def begin(self, speed: Float[np.ndarray, " joints"]) -> None:
        """Start cold and not overloaded, with rotors that turn as the joints do [rad/s]."""
        self._row("speed")[:] = speed
        self._row("temperature")[:] = self._ambient
        self._goal_memory = goal_memory(len(speed))
        for name in ("overloaded", "shutdown", "wait"):
            self._row(name)[:] = 0.0

    def command(self, target: Float[np.ndarray, " joints"]) -> None:
        """Advance the servos towards their goals [rad], and apply their torques."""
        self._step(target, *self._arguments)

    def fail(self, joint: int) -> None:
        """Shut a servo down for good."""
        self._row("shutdown")[joint] = FAILED

    def torque(self) -> Float[np.ndarray, " joints"]:
        """Return the gears' torques on the joints; friction is subtracted."""
        return self._torque

    def targets(self, setpoints: Setpoints, dt: float) -> Float[np.ndarray, "samples joints"]:
        """Return the servos' goals [rad].

        These servos take no torque: their law is inverted, so that it gives the feed-forward
        torque where the joint is at its setpoint.
        """
        q = setpoints.q.reshape(len(setpoints.q), -1)
        if setpoints.torque is None:
            return q
        qd, torque = setpoints.qd.reshape(q.shape), setpoints.torque.reshape(q.shape)
        return goals_for_torque(q, qd, torque, self._goal_law, dt, self._goal_memory)

    def channels(self, states: Float[np.ndarray, "samples state"]) -> dict[str, np.ndarray]:
        """Return duty, current, rotor speed, temperature and shutdown of every servo."""
        rows = states.reshape(len(states), len(self._rows), -1, 3)
        read = {
            f"servo_{name}": rows[:, FIELDS.index(name)]
            for name in ("duty", "current", "speed", "temperature")
        }
        return read | {"servo_shutdown": rows[:, FIELDS.index("shutdown")] != RUNNING}

    def remark(self, state: Float[np.ndarray, " state"]) -> str:
        """Return which servos had shut down in a state, and why; or nothing."""
        codes = state.reshape(self._rows.shape)[FIELDS.index("shutdown")]
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
