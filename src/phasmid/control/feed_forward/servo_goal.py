"""Goals of servos that take no torque, so that they give it all the same: their law, inverted."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.robot import Servo

FULL_PUNCH, FULL_PWM = 1023, 885
"""Full output in the makers' units: of the compliance law, and of the PID law."""

SLOW = 0.02
"""Speed from which on friction is taken to be all against the motion [rad/s]. Joints of a leg in
stance turn at some 0.05 rad/s; with 0.1 the trunk of a level walk heaved by 1 mm."""


def goal_numbers(servo: Servo, voltage: float) -> Float[np.ndarray, " numbers"]:
    """What `goals_for_torque` has to know of a servo.

    Args:
        servo: With its settings; its stall current must be known.
        voltage: Supply [V].

    Raises:
        InvalidInput: The servo's stall current is not known.
        InvalidRobot: No motor has the servo's numbers.
    """
    motor, tick = servo.motor, servo.resolution
    slope, margin = servo.effective_slope, servo.compliance_margin
    gain, change, lead = 0.0, 0.0, 0.0
    if servo.law == "pid":
        gain = servo.p_gain / 128 / FULL_PWM
        change = servo.d_gain / 16 / FULL_PWM * servo.control_period
        lead = servo.derivative_time
    return np.array(
        [
            tick,
            gain,
            *margin,
            *slope,
            servo.punch / FULL_PUNCH,
            servo.torque_limit,
            motor.resistance / (motor.constant * voltage),
            motor.constant / voltage,
            motor.load_loss,
            motor.coulomb,
            motor.viscous,
            lead,
            lead + change / gain if gain > 0.0 else 0.0,
            servo.delay,
        ]
    )


def fill_goals(
    q: np.ndarray,
    qd: np.ndarray,
    torque: np.ndarray,
    numbers: np.ndarray,
    dt: float,
    memory: np.ndarray,
    goal: np.ndarray,
) -> None:
    """Write what `goals_for_torque` returns, as a loop for the compiler."""
    tick, gain, punch, most = numbers[0], numbers[1], numbers[6], numbers[7]
    per_torque, per_speed = numbers[8], numbers[9]
    loss, coulomb, viscous = numbers[10], numbers[11], numbers[12]
    lead, lag, delay = numbers[13], numbers[14], numbers[15]
    for k in range(q.shape[0]):
        for j in range(q.shape[1]):
            speed = qd[k, j]
            way = min(max(speed / SLOW, -1.0), 1.0)
            # The motor's torque: what is wanted, and what the gears take on the way.
            push = torque[k, j] + viscous * speed + way * coulomb
            push /= 1.0 - way * loss if push > 0.0 else 1.0 + way * loss
            duty = min(max(push * per_torque + per_speed * speed, -most), most)
            if gain > 0.0:
                error = duty / gain
                if math.isnan(memory[0, j]):
                    memory[0, j] = memory[1, j] = error
                # The law also answers to how fast the error changes, which is undone here.
                told = lag * memory[0, j] + dt * error + lead * (error - memory[1, j])
                memory[0, j], memory[1, j] = told / (lag + dt), error
                goal[k, j] = q[k, j] + delay * speed + tick * memory[0, j]
                continue
            size, side = abs(duty), 0 if duty < 0.0 else 1
            margin, slope = numbers[2 + side], numbers[4 + side]
            if size > punch:
                error = margin + slope * (size - punch) / (1.0 - punch)
            else:
                # Between nothing and the punch there is nothing: the margin's edge stands for it.
                error = margin * size / punch
            goal[k, j] = q[k, j] + delay * speed + tick * (error if side == 1 else -error)


def goal_memory(joints: int) -> Float[np.ndarray, "2 joints"]:
    """What the inverse of a law remembers from one time to the next: nothing yet.

    Args:
        joints: Their number.
    """
    return np.full((2, joints), np.nan)


def goals_for_torque(
    q: Float[np.ndarray, "times joints"],
    qd: Float[np.ndarray, "times joints"],
    torque: Float[np.ndarray, "times joints"],
    numbers: Float[np.ndarray, " numbers"],
    dt: float,
    memory: Float[np.ndarray, "2 joints"],
) -> Float[np.ndarray, "times joints"]:
    """Goals with which servos give a torque while they are where they shall be.

    The output that makes the torque at this speed follows from motor and gears; the goal is as
    far from the joint as the servo's law needs for that output. Friction counts against the
    wanted motion, and not at rest. The goal is ahead of the motion by the servo's
    delay. Outputs beyond the servo's limit are the limit.

    Args:
        q: Angles where the joints shall be [rad], shape (N, J).
        qd: Their speeds [rad/s], shape (N, J).
        torque: To be given to the joints [N·m], shape (N, J).
        numbers: From `goal_numbers`.
        dt: Time from one row to the next [s].
        memory: From `goal_memory`, changed: the inverse of a law that answers to how fast its
            error changes depends on what came before.

    Returns:
        Shape (N, J) [rad].
    """
    goal = np.empty(q.shape)
    compiled(fill_goals)(q, qd, torque, numbers, dt, memory, goal)
    return goal
