"""Logs of servos: of one that moves a pendulum, and of the three of a leg in the air."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Bool, Float

from phasmid.errors import InvalidInput
from phasmid.robot import Leg
from phasmid.units import STANDARD_GRAVITY


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


@dataclass(frozen=True, eq=False)
class LegLog:
    """Log of a leg that moves in the air, on a level trunk that stands still.

    Attributes:
        name: Name of the log.
        time: Increasing [s], shape (N,).
        target: Goals that its servos have from each time on [rad], shape (N, 3).
        position: Angles that its servos report [rad], shape (N, 3); NaN where one was not read.
        leg: The leg, with the masses that its servos move.
        voltage: Their supply [V].
    """

    name: str
    time: Float[np.ndarray, " n"]
    target: Float[np.ndarray, "n 3"]
    position: Float[np.ndarray, "n 3"]
    leg: Leg
    voltage: float


Log: TypeAlias = BenchLog | LegLog


def joint_columns(log: Log) -> tuple[np.ndarray, np.ndarray]:
    """Return goals and positions of a log's joints [rad], shape (N, J) each."""
    return log.target.reshape(len(log.time), -1), log.position.reshape(len(log.time), -1)
