"""The servos' position law, motor and gears, and the inverse of that law; compiled."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.servo.friction_kernels import dry_friction


class Shutdown(IntEnum):
    """Why a servo gives no torque."""

    NONE = 0
    OVERLOAD = 1
    OVERHEATING = 2
    FAILURE = 3
    TORQUE_OFF = 4


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
            due = servo.due
            goal, delayed[j, due] = delayed[j, due], goal
            servo.due = (due + 1) % delayed.shape[1]
        if servo.wait <= 0:
            servo.wait = int(p.steps)
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
        servo.wait -= 1

        angle, speed, running = servo.angle, servo.speed, servo.shutdown == Shutdown.NONE
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
                servo.shutdown = Shutdown.OVERHEATING
            elif servo.overloaded > p.patience:
                servo.shutdown = Shutdown.OVERLOAD
        servo.angle = angle + p.dt * speed
        servo.speed = speed
        servo.current = current
        servo.torque = torque
        servo.friction = friction
        servo.temperature = temperature
        applied[j] = torque


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
