"""Pendulum bench of one servo: its logs, and their simulation with the servo's own law."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from phasmid.compiled import compiled
from phasmid.errors import InvalidInput
from phasmid.simulation.servo import FAILED, RUNNING, SERVO_STATE, servo_step
from phasmid.units import STANDARD_GRAVITY

STEP = 1e-3
"""Time step of the simulation [s]; the control period of the known servos."""


@dataclass(frozen=True)
class Pendulum:
    """A weight on an arm on the servo's horn; at angle 0 it hangs straight down.

    Attributes:
        mass: Of the weight, a point at the end of the arm [kg].
        length: From the axis to the weight's centre of mass [m].
        arm_mass: Of the arm, a uniform rod of that length [kg].

    Raises:
        InvalidInput: A number is not finite or has the wrong sign.
    """

    mass: float
    length: float
    arm_mass: float = 0.0

    def __post_init__(self) -> None:
        for name, value, least in (
            ("mass", self.mass, 0.0),
            ("length", self.length, 0.0),
            ("arm mass", self.arm_mass, -1e-12),
        ):
            if not least < value < math.inf:
                raise InvalidInput(f"the pendulum's {name} is {value:g}; it must be positive.")

    @property
    def inertia(self) -> float:
        """Inertia about the axis [kg·m²]."""
        return (self.mass + self.arm_mass / 3) * self.length**2

    @property
    def largest_load(self) -> float:
        """Torque of gravity when the arm is level [N·m]."""
        return (self.mass + self.arm_mass / 2) * self.length * STANDARD_GRAVITY


@dataclass(frozen=True)
class BenchLog:
    """Log of a servo that moves a pendulum.

    Attributes:
        name: Name of the log.
        time: Increasing [s], shape (N,).
        target: Goal that the servo has from each time on [rad], shape (N,).
        position: Angle that the servo reports [rad], shape (N,).
        powered: False while the servo's torque is off, shape (N,).
        pendulum: Its load.
        voltage: Its supply [V].
    """

    name: str
    time: Float[np.ndarray, " n"]
    target: Float[np.ndarray, " n"]
    position: Float[np.ndarray, " n"]
    powered: Bool[np.ndarray, " n"]
    pendulum: Pendulum
    voltage: float


def bench_steps(log: BenchLog) -> int:
    """Return the number of time steps of a log."""
    return math.ceil((log.time[-1] - log.time[0]) / STEP) + 1


def bench_inputs(log: BenchLog) -> tuple[np.ndarray, np.ndarray]:
    """Return the goal [rad] and whether the torque is on in each time step of a log."""
    times = log.time[0] + np.arange(bench_steps(log)) * STEP
    # Times of a log in decimals may be a round-off late.
    rows = np.searchsorted(log.time, times + 1e-6, side="right") - 1
    return log.target[rows], log.powered[rows]


def measured_states(log: BenchLog, delay: float, period: float) -> Float[np.ndarray, "steps 2"]:
    """Return angle [rad] and speed [rad/s] by the log at regular steps, NaN at the others.

    A parabola through the readings around each of them gives both; at the beginning the servo is
    taken to be at rest.

    Args:
        log: The log.
        delay: Of the log's angles after the steps [s].
        period: Time between two of these steps [s]; infinite: only the first has a state.
    """
    states = np.full((bench_steps(log), 2), np.nan)
    states[0] = log.position[0], 0.0
    time = log.time - log.time[0] - delay
    for instant in np.arange(period, time[-1], period) if math.isfinite(period) else ():
        near = np.abs(time - instant) <= AROUND
        if near.sum() > 3:
            _, speed, angle = np.polyfit(time[near] - instant, log.position[near], 2)
            states[round(instant / STEP)] = angle, speed
    return states


AROUND = 0.06
"""Time before and after an instant from which its state is measured [s]."""


def simulate_bench(
    logs: Sequence[BenchLog],
    parameters: np.ndarray,
    delay: float,
    hanging: float,
    period: float = math.inf,
) -> list[Float[np.ndarray, " n"]]:
    """Simulate the servo of each log, and return its angles at the times of the log [rad].

    A servo that answers each command late moves as one without delay does, but later. Delayed
    angles, unlike delayed goals, change smoothly with the delay.

    Args:
        logs: The logs; the simulation starts at the first angle, at rest.
        parameters: One record of `servo_parameters` per log.
        delay: Of the servo's answer to goals and switching [s].
        hanging: Angle that the servo reports where the pendulum hangs straight down [rad].
        period: Time after which the simulation restarts from measured states [s].
    """
    goals, powered = zip(*map(bench_inputs, logs), strict=True)
    ends = np.cumsum([len(one) for one in goals])
    loads = np.array([[log.pendulum.inertia, log.pendulum.largest_load] for log in logs])
    angles = np.empty(ends[-1])
    _simulate(
        np.concatenate(goals),
        np.concatenate(powered),
        np.concatenate([[0], ends]),
        np.concatenate([measured_states(log, delay, period) for log in logs]),
        loads,
        hanging,
        parameters,
        np.zeros(len(logs), SERVO_STATE),
        angles,
    )
    split = np.split(angles, ends[:-1])
    return [
        np.interp(log.time - log.time[0] - delay, STEP * np.arange(len(one)), one)
        for log, one in zip(logs, split, strict=True)
    ]


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
    """Write the angle of every log at the beginning of each of its time steps; compiled."""
    limits = np.array([[-np.inf], [np.inf]])
    delayed = np.empty((1, 0))
    for i in range(len(loads)):
        servo, own, dt = servos[i : i + 1], parameters[i : i + 1], parameters[i].dt
        inertia, load = loads[i]
        angle, speed, torque = np.zeros(1), np.zeros(1), np.zeros(1)
        for k in range(ends[i], ends[i + 1]):
            if not math.isnan(states[k, 0]):
                angle[0], speed[0] = states[k]
                servo[0].angle, servo[0].speed = states[k]
            angles[k] = angle[0]
            servo[0].shutdown = RUNNING if powered[k] else FAILED
            servo_step(goals[k : k + 1], angle, speed, limits, own, servo, delayed, torque)
            pull = torque[0] - load * math.sin(angle[0] - hanging)
            speed[0] += dt / inertia * pull
            angle[0] += dt * speed[0]
