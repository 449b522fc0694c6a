"""A servo's numbers in the units of its compiled law and of the inverse law."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from phasmid.servo.heat import remaining
from phasmid.servo.law_kernels import InverseLaw
from phasmid.servo.servo import D_GAIN_UNIT, FULL_PUNCH, FULL_PWM, P_GAIN_UNIT, Servo

SERVO_STATE = np.dtype(
    [
        ("angle", np.float64),  # of the rotor, at the output [rad]
        ("speed", np.float64),  # of the rotor, at the output [rad/s]
        ("duty", np.float64),  # share of the supply
        ("current", np.float64),  # [A]
        ("torque", np.float64),  # on the joint, of this step [N·m]
        ("friction", np.float64),  # on the rotor, of this step [N·m]
        ("temperature", np.float64),  # [°C]
        ("overloaded", np.float64),  # time at the largest duty [s]
        ("shutdown", np.int64),  # `Shutdown`
        ("wait", np.int64),  # steps until the next reading of the position
        ("error", np.float64),  # of the position [ticks]
        ("change", np.float64),  # filtered rate of that error [ticks/s]
        ("due", np.int64),  # which of the delayed goals is due
    ]
)
"""State of a servo; each entry takes the memory of a float."""

MOST_OF_LIMIT = 0.75
"""Allowed share of the largest stable step: legs are lighter in other poses."""


def servo_parameters(servo: Servo, dt: float) -> np.ndarray:
    """Return a servo's parameters in the units of `servo_step`, one record in an array.

    Args:
        servo: With its settings, supply and air.
        dt: Time step [s].
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
        "gain": _pid_gain(servo),
        "change_gain": _derivative_gain(servo),
        "smoothing": look / (look + servo.derivative_time),
        "punch": servo.punch / FULL_PUNCH,
        "voltage": servo.voltage,
        "resistance": motor.resistance,
        "constant": motor.constant,
        **vars(motor.friction),
        "inertia": servo.armature,
        "play": servo.backlash / 2,
        "stiffness": servo.gear_stiffness,
        "damping": servo.gear_stiffness * servo.gear_damping_time,
        "ambient": servo.ambient_temperature + servo.thermal_resistance * servo.standby_power,
        "warming": servo.thermal_resistance * motor.resistance,
        "fading": remaining(servo, dt),
        "hottest": servo.temperature_limit,
        "patience": servo.overload_time,
        "limit": servo.stall_torque,
    }
    kind = [(name, np.float64, np.shape(value)) for name, value in values.items()]
    return np.array([tuple(values.values())], dtype=kind)


def _pid_gain(servo: Servo) -> float:
    """Return the output of the PID law per tick of the position error."""
    return servo.gain_scale * servo.p_gain / P_GAIN_UNIT / FULL_PWM


def _derivative_gain(servo: Servo) -> float:
    """Return the output of the PID law per rate of the error [s/tick]."""
    return servo.d_gain / D_GAIN_UNIT / FULL_PWM * servo.control_period


def output_per_tick(servo: Servo) -> float:
    """Return the servo's output per tick of position error, beyond margin and punch."""
    if servo.law == "pid":
        return _pid_gain(servo)
    slope = 2 / sum(1 / each for each in servo.effective_slope)
    return (1 - servo.punch / FULL_PUNCH) / slope


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


def inverse_law(servo: Servo) -> InverseLaw:
    """Return the constants of a servo's inverted law.

    Args:
        servo: The servo, with its supply; its stall current must be known.

    Raises:
        InvalidInput: The servo's stall current is not known.
        InvalidRobot: No motor has the servo's numbers.
    """
    motor, voltage = servo.motor, servo.voltage
    gain = lead = lag = 0.0
    if servo.law == "pid":
        gain, lead = _pid_gain(servo), servo.derivative_time
        lag = lead + _derivative_gain(servo) / gain
    low, high = servo.compliance_margin
    low_slope, high_slope = servo.effective_slope
    return InverseLaw(
        servo.resolution,
        gain,
        (float(low), float(high)),
        (float(low_slope), float(high_slope)),
        servo.punch / FULL_PUNCH,
        servo.torque_limit,
        motor.resistance / (motor.constant * voltage),
        motor.constant / voltage,
        motor.load_loss,
        motor.coulomb,
        motor.viscous,
        lead,
        lag,
        servo.delay,
    )
