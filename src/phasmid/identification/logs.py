"""Logs of servos: of one that moves a pendulum, and of the three of a leg in the air."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Bool, Float

from phasmid.dynamics import leg_matrices
from phasmid.errors import InvalidInput
from phasmid.robot import Leg
from phasmid.units import STANDARD_GRAVITY

SETTLING = 0.3
"""Time after a joint's first motion that is not compared [s]: speed and rotor are unknown."""

FIRST_TURN = 0.1
"""Share of a joint's largest turn in a log up to which it is not compared."""

LEAST_LOAD = 0.1
"""Torque of gravity on a joint, as a share of the leg's largest, from which it is compared."""


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


def compared_rows(log: Log) -> Bool[np.ndarray, "n joints"]:
    """Return which readings of a log are compared.

    Where a joint that friction holds comes to rest depends on where it was at first, which a coarse
    sensor does not show. A joint without load floats in its backlash: a coxa with a vertical axis,
    and a tibia while it hangs down.
    """
    angles = joint_columns(log)[1]
    read = np.isfinite(angles)
    first = angles[read.argmax(axis=0), np.arange(angles.shape[1])]
    turned = np.abs(angles - first) > FIRST_TURN * np.nanmax(np.abs(angles - first), axis=0)
    compared: np.ndarray = read & (log.time[:, None] >= log.time[turned.argmax(axis=0)] + SETTLING)
    if isinstance(log, LegLog):
        load = np.abs(leg_matrices(log.leg, np.nan_to_num(angles), gravity=STANDARD_GRAVITY).G)
        compared &= load >= LEAST_LOAD * load.max()
    return compared
