"""Goals of position servos that give a feed-forward torque, by their inverted control law."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.robot import Servo
from phasmid.robot.servo import D_GAIN_UNIT, FULL_PUNCH, FULL_PWM, P_GAIN_UNIT

SLOW = 0.02
"""Speed from which friction acts fully against the motion [rad/s]. Joints of a leg in stance turn
at some 0.05 rad/s; with 0.1 the trunk of a level walk heaved by 1 mm."""


class InverseLaw(NamedTuple):
    """Constants of a servo's inverted law. Outputs are shares of the supply voltage.

    Attributes:
        tick: Resolution [rad].
        gain: Output per tick of the PID law; 0: the compliance law.
        margin: Error without output, for negative and positive outputs [ticks].
        slope: Error beyond it at full output, for negative and positive outputs [ticks].
        punch: Least output of the compliance law.
        largest: Largest output.
        per_torque: Output per torque of the motor [1/(N·m)].
        per_speed: Output per speed [s/rad].
        load_loss: Share of the torque that the gears lose.
        coulomb: Coulomb friction [N·m].
        viscous: Viscous friction [N·m·s/rad].
        lead: Time constant of the PID law's filtered derivative [s].
        lag: The same with the derivative's share of the gain [s].
        delay: Delay of the servo's answer [s].
    """

    tick: float
    gain: float
    margin: tuple[float, float]
    slope: tuple[float, float]
    punch: float
    largest: float
    per_torque: float
    per_speed: float
    load_loss: float
    coulomb: float
    viscous: float
    lead: float
    lag: float
    delay: float


def inverse_law(servo: Servo, voltage: float) -> InverseLaw:
    """Return the constants of a servo's inverted law.

    Args:
        servo: The servo; its stall current must be known.
        voltage: Supply [V].

    Raises:
        InvalidInput: The servo's stall current is not known.
        InvalidRobot: No motor has the servo's numbers.
    """
    motor, gain, lead, lag = servo.motor, 0.0, 0.0, 0.0
    if servo.law == "pid":
        gain, lead = servo.gain_scale * servo.p_gain / P_GAIN_UNIT / FULL_PWM, servo.derivative_time
        lag = lead + servo.d_gain / D_GAIN_UNIT / FULL_PWM * servo.control_period / gain
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


def goal_memory(joints: int) -> Float[np.ndarray, "2 joints"]:
    """Return the initial memory of `goals_for_torque` for a number of joints."""
    return np.full((2, joints), np.nan)


@compiled
def goals_for_torque(
    q: Float[np.ndarray, "times joints"],
    qd: Float[np.ndarray, "times joints"],
    torque: Float[np.ndarray, "times joints"],
    law: InverseLaw,
    dt: float,
    memory: Float[np.ndarray, "2 joints"],
) -> Float[np.ndarray, "times joints"]:
    """Return the goals with which servos give a torque while they follow a motion.

    Motor and gears determine the output for torque and speed; the goal is as far from the joint as
    the servo's law needs for that output. Friction acts against the planned motion, not at rest.
    Goals lead the motion by the servo's delay. Outputs are limited.

    Args:
        q: Angles of the motion [rad], shape (N, J).
        qd: Its speeds [rad/s], shape (N, J).
        torque: Torque on the joints [N·m], shape (N, J).
        law: From `inverse_law`.
        dt: Time from one row to the next [s].
        memory: From `goal_memory`, changed: filtered and last error of the PID law [ticks].

    Returns:
        Goals [rad], shape (N, J).
    """
    goal = np.empty(q.shape)
    for k in range(q.shape[0]):
        for j in range(q.shape[1]):
            speed = qd[k, j]
            direction = min(max(speed / SLOW, -1.0), 1.0)
            # The motor's torque includes the losses of the gears.
            push = torque[k, j] + law.viscous * speed + direction * law.coulomb
            push /= (
                1.0 - direction * law.load_loss if push > 0.0 else 1.0 + direction * law.load_loss
            )
            duty = push * law.per_torque + law.per_speed * speed
            duty = min(max(duty, -law.largest), law.largest)
            if law.gain > 0.0:
                target = duty / law.gain
                if math.isnan(memory[0, j]):
                    memory[0, j] = memory[1, j] = target
                # The law responds to the rate of the error too.
                filtered = law.lag * memory[0, j] + dt * target + law.lead * (target - memory[1, j])
                memory[0, j], memory[1, j] = filtered / (law.lag + dt), target
                error = memory[0, j]
            else:
                side = 0 if duty < 0.0 else 1
                size = abs(duty)
                if size > law.punch:
                    size = (size - law.punch) / (1.0 - law.punch)
                    error = law.margin[side] + law.slope[side] * size
                else:
                    # The law has no outputs below the punch; the edge of the margin replaces them.
                    error = law.margin[side] * size / law.punch
                error = error if side == 1 else -error
            goal[k, j] = q[k, j] + law.delay * speed + law.tick * error
    return goal
