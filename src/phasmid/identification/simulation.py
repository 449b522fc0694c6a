"""Simulation of logs with the servos' own law: pendulums, and legs on a fixed trunk."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.dynamics import leg_matrices
from phasmid.dynamics.leg_kernels import leg_acceleration
from phasmid.dynamics.matrices import hip_gravity, link_moments
from phasmid.identification.logs import BenchLog, LegLog, Log, joint_columns
from phasmid.servo import Servo
from phasmid.servo.law import SERVO_STATE, longest_servo_step
from phasmid.servo.law_kernels import Shutdown, servo_step
from phasmid.units import STANDARD_GRAVITY

STEP = 1e-3
"""Longest time step of the simulation [s]; the control period of the known servos."""

AROUND = 0.06
"""Time before and after an instant from which its state is measured [s]."""


def time_step(logs: Sequence[Log], servo: Servo) -> float:
    """Return the time step that resolves the servo's gears on the loads of the logs [s].

    It is `STEP`, or a fraction of it where a light leg needs one.
    """
    limit = math.inf
    for log in logs:
        mobility = 0.0
        if isinstance(log, LegLog):
            poses = np.nan_to_num(log.position)
            mobility = 1 / float(
                np.linalg.eigvalsh(leg_matrices(log.leg, poses, gravity=STANDARD_GRAVITY).M).min()
            )
        else:
            mobility = 1 / log.pendulum.inertia
        limit = min(limit, longest_servo_step(servo, mobility))
    return STEP / math.ceil(STEP / limit)


def _steps(log: Log, dt: float) -> np.ndarray:
    """Return the times of a simulation of a log [s]."""
    count = math.ceil((log.time[-1] - log.time[0]) / dt - 1e-6) + 1
    return log.time[0] + np.arange(count) * dt


def inputs(log: Log, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Return goals [rad], shape (T, J), and whether the torque is on in each time step of a log."""
    # Times of a log in decimals may be a round-off late.
    rows = np.searchsorted(log.time, _steps(log, dt) + 1e-6, side="right") - 1
    target, _ = joint_columns(log)
    powered = log.powered[rows] if isinstance(log, BenchLog) else np.ones(len(rows), dtype=bool)
    return target[rows], powered


def measured_states(
    log: Log, delay: float, period: float, dt: float
) -> Float[np.ndarray, "steps joints 2"]:
    """Return angles [rad] and speeds [rad/s] by a log at regular steps, NaN at the others.

    A parabola through the readings around each of them gives both; at the beginning the joints are
    taken to be at rest.

    Args:
        log: The log.
        delay: Of the log's angles after the steps [s].
        period: Time between two of these steps [s]; infinite: only the first has a state.
        dt: Time step [s].
    """
    position = joint_columns(log)[1]
    states = np.full((len(_steps(log, dt)), position.shape[1], 2), np.nan)
    time = log.time - log.time[0] - delay
    instants = np.arange(period, time[-1], period) if math.isfinite(period) else ()
    for j, angles in enumerate(position.T):
        read = np.isfinite(angles)
        states[0, j] = angles[read][0], 0.0
        for instant in instants:
            near = read & (np.abs(time - instant) <= AROUND)
            if near.sum() > 3:
                _, speed, angle = np.polyfit(time[near] - instant, angles[near], 2)
                states[round(instant / dt), j] = angle, speed
    return states


def simulate_logs(
    logs: Sequence[Log],
    parameters: np.ndarray,
    delay: float,
    hanging: float = 0.0,
    *,
    period: float = math.inf,
) -> list[np.ndarray]:
    """Simulate the servos of each log, and return their angles in the form of its positions [rad].

    A servo that answers each command late moves as one without delay does, but later. Delayed
    angles, unlike delayed goals, change smoothly with the delay.

    Args:
        logs: Logs of benches or of legs; the simulation starts at the first angles, at rest.
        parameters: One record of `servo_parameters` per log, all with one time step.
        delay: Of the servos' answer to goals and switching [s].
        hanging: Angle that the servo reports where the pendulum hangs straight down [rad].
        period: Time after which the simulation restarts from measured states [s].
    """
    dt = float(parameters["dt"][0])
    goals, powered = zip(*(inputs(log, dt) for log in logs), strict=True)
    ends = np.cumsum([len(one) for one in goals])
    joints = goals[0].shape[1]
    states = [measured_states(log, delay, period, dt) for log in logs]
    angles = np.empty((ends[-1], joints))
    _simulate(
        np.concatenate(goals),
        np.concatenate(powered),
        np.concatenate([[0], ends]),
        np.concatenate(states),
        _loads(logs),
        hanging,
        parameters,
        np.zeros((len(logs), joints), SERVO_STATE),
        angles,
    )
    simulated = []
    for log, one in zip(logs, np.split(angles, ends[:-1]), strict=True):
        time, steps = log.time - log.time[0] - delay, dt * np.arange(len(one))
        columns = [np.interp(time, steps, column) for column in one.T]
        simulated.append(np.stack(columns, axis=-1).reshape(log.position.shape))
    return simulated


def _loads(logs: Sequence[Log]) -> tuple[np.ndarray, ...]:
    """Return limits of the goals, pendulums and legs as arrays, zero where a log has none."""
    pendulums, legs = np.zeros((len(logs), 2)), [np.zeros((len(logs), *(3,) * n)) for n in LEG]
    limits = []
    for i, log in enumerate(logs):
        if isinstance(log, BenchLog):
            pendulums[i] = log.pendulum.inertia, log.pendulum.largest_load
            limits.append(np.array([[-np.inf], [np.inf]]))
        else:
            leg = log.leg
            parts = leg.lengths, *link_moments(leg), hip_gravity(leg, STANDARD_GRAVITY)
            for array, part in zip(legs, parts, strict=True):
                array[i] = part
            limits.append(leg.joint_limits.T)
    return np.stack(limits), pendulums, *legs


LEG = 1, 1, 2, 3, 1
"""Dimensions of a leg's lengths, masses, moments and gravity."""


@compiled
def _simulate(
    goals: Any,
    powered: Any,
    ends: Any,
    states: Any,
    loads: Any,
    hanging: float,
    parameters: Any,
    servos: Any,
    angles: Any,
) -> None:
    """Write the angles of every log at the beginning of each of its time steps; compiled."""
    limits, pendulums, lengths, mass, first, second, gravity = loads
    joints = goals.shape[1]
    delayed = np.empty((joints, 0))
    for i in range(len(pendulums)):
        servo, own, dt = servos[i], parameters[i : i + 1], parameters[i].dt
        inertia, load = pendulums[i]
        angle, speed, torque = np.zeros(joints), np.zeros(joints), np.zeros(joints)
        acceleration = np.zeros(joints)
        for k in range(ends[i], ends[i + 1]):
            for j in range(joints):
                if not math.isnan(states[k, j, 0]):
                    angle[j], speed[j] = states[k, j]
                    servo[j].angle, servo[j].speed = states[k, j]
                angles[k, j] = angle[j]
                servo[j].shutdown = Shutdown.NONE if powered[k] else Shutdown.FAILURE
            servo_step(goals[k], angle, speed, limits[i], own, servo, delayed, torque)
            if joints == 1:
                acceleration[0] = (torque[0] - load * math.sin(angle[0] - hanging)) / inertia
            else:
                leg_acceleration(
                    lengths[i],
                    mass[i],
                    first[i],
                    second[i],
                    gravity[i],
                    angle,
                    speed,
                    torque,
                    acceleration,
                )
            for j in range(joints):
                speed[j] += dt * acceleration[j]
                angle[j] += dt * speed[j]
