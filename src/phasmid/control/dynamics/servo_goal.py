"""Goals of servos that take no torque, so that they give it all the same: their law, inverted."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.robot import Servo

FULL_PUNCH, FULL_PWM = 1023, 885
"""Full output in the makers' units: of the compliance law, and of the PID law."""

SLOW = 0.1
"""Speed from which on friction is taken to be all against the motion [rad/s]."""


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
    gain = servo.p_gain / 128 / FULL_PWM if servo.law == "pid" else 0.0
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
        ]
    )


def fill_goals(
    q: np.ndarray, qd: np.ndarray, torque: np.ndarray, numbers: np.ndarray, goal: np.ndarray
) -> None:
    """What `goals_for_torque` returns, as a loop for the compiler; arguments of shape (J,)."""
    tick, gain, punch, most = numbers[0], numbers[1], numbers[6], numbers[7]
    per_torque, per_speed = numbers[8], numbers[9]
    loss, coulomb, viscous = numbers[10], numbers[11], numbers[12]
    for j in range(q.shape[0]):
        way = min(max(qd[j] / SLOW, -1.0), 1.0)
        # The motor's torque: what is wanted, and what the gears take on the way.
        push = torque[j] + viscous * qd[j] + way * coulomb
        push /= 1.0 - way * loss if push > 0.0 else 1.0 + way * loss
        duty = min(max(push * per_torque + per_speed * qd[j], -most), most)
        if gain > 0.0:
            goal[j] = q[j] + tick * duty / gain
            continue
        size, side = abs(duty), 0 if duty < 0.0 else 1
        margin, slope = numbers[2 + side], numbers[4 + side]
        if size > punch:
            error = margin + slope * (size - punch) / (1.0 - punch)
        else:
            # Between nothing and the punch there is nothing: the margin's edge stands for it.
            error = margin * size / punch
        goal[j] = q[j] + tick * (error if side == 1 else -error)


def goals_for_torque(
    q: Float[np.ndarray, "*batch"],
    qd: Float[np.ndarray, "*batch"],
    torque: Float[np.ndarray, "*batch"],
    numbers: Float[np.ndarray, " numbers"],
) -> Float[np.ndarray, "*batch"]:
    """Goals with which servos give a torque while they are where they shall be.

    The output that makes the torque at this speed follows from motor and gears; the goal is as
    far from the joint as the servo's law needs for that output. Friction counts against the
    wanted motion, and not at rest. Outputs beyond the servo's limit are the limit.

    Args:
        q: Angles where the joints shall be [rad], shape (...).
        qd: Their speeds [rad/s], shape (...).
        torque: To be given to the joints [N·m], shape (...).
        numbers: From `goal_numbers`.
    """
    goal = np.empty(q.shape)
    compiled(fill_goals)(
        q.reshape(-1), qd.reshape(-1), torque.reshape(-1), numbers, goal.reshape(-1)
    )
    return goal
