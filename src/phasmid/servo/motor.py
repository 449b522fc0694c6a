"""Direct-current motor with gears of load-dependent friction."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from phasmid.servo.friction import Friction

Array = TypeVar("Array", float, np.ndarray)


@dataclass(frozen=True)
class Motor:
    """Motor and gears, with all quantities at the output.

    At voltage u and speed w the current is ``i = (u - k w) / R`` and the motor's torque ``k i``.

    Attributes:
        resistance: R, of winding and leads [Ω].
        constant: k, torque per current and voltage per speed [N·m/A].
        friction: Friction of motor and gears.
    """

    resistance: float
    constant: float
    friction: Friction

    @property
    def load_loss(self) -> float:
        """Share of the motor's torque that the gears lose in motion."""
        return self.friction.load_loss

    @property
    def coulomb(self) -> float:
        """Friction in motion without load [N·m]."""
        return self.friction.coulomb

    @property
    def viscous(self) -> float:
        """Friction per speed [N·m·s/rad]."""
        return self.friction.viscous

    def stall_torque(self, voltage: float) -> float:
        """Return the stall torque at the output [N·m] when it lifts a load.

        Args:
            voltage: At the winding [V].
        """
        f = self.friction
        still = f.stribeck_share(0.0)
        kept = 1 - f.load_loss - still * f.stribeck_load_loss
        given = kept * self.constant * voltage / self.resistance - f.coulomb - still * f.stribeck
        if given <= 0:
            return 0.0
        part = 1 + f.external_loss + still * f.stribeck_external_loss
        root = math.sqrt(part**2 + 4 * still * f.quadratic_external_loss * given)
        return 2 * given / (part + root)

    def lifting_current(self, torque: Array) -> Array:
        """Return the current that starts to lift a load; friction does not help [A].

        Args:
            torque: Of the load, 0 or more [N·m].
        """
        f = self.friction
        still = f.stribeck_share(0.0)
        part = 1 + f.external_loss + still * f.stribeck_external_loss
        needed = part * torque + still * f.quadratic_external_loss * torque**2 + f.coulomb
        kept = 1 - f.load_loss - still * f.stribeck_load_loss
        return (needed + still * f.stribeck) / (self.constant * kept)

    def holding_current(self, torque: Array) -> Array:
        """Return the current below which a load at rest turns the output back [A].

        Args:
            torque: Of the load, 0 or more [N·m].
        """
        given = np.zeros_like(torque)
        # The gears' friction helps. Each pass leaves the share of the motor's torque that they
        # lose, below 1, of the error.
        for _ in range(MOST_ITERATIONS):
            before, friction = given, self.friction.limit(given, torque, 0.0)
            given = np.maximum(torque - friction, 0.0)
            if np.abs(given - before).max(initial=0.0) <= 1e-12:
                break
        return given / self.constant  # type: ignore[return-value]

    def working_current(self, torque: Array) -> Array:
        """Return the rms current of a joint that moves to and fro under a load [A].

        Half of the time it drives against the load, half of the time the gears help to hold it.
        An STS3215 of 12 V that was lifted to 1.04 N·m drew 0.55 A by its position error; these
        currents are 1.01 A, 0.28 A and, as rms, 0.74 A.

        Args:
            torque: Of the load, 0 or more [N·m].

        Source: robonine.com, test of an STS3215-C018, 2025: 1.5 kg at 10 cm and 45°, 25 ticks.
        """
        squares = self.lifting_current(torque) ** 2 + self.holding_current(torque) ** 2
        return (squares / 2) ** 0.5

    def no_load_speed(self, voltage: float) -> float:
        """Return the no-load speed of the output [rad/s].

        Args:
            voltage: At the winding [V].
        """
        # The Stribeck effect falls with the speed: without it the speed is too high, and falls in
        # iterations to the highest that is steady.
        f, drag = self.friction, self.friction.viscous / self.constant
        share, speed = 0.0, math.inf
        for _ in range(MOST_ITERATIONS):
            kept = (1 - f.load_loss - share * f.stribeck_load_loss) * self.constant
            still = f.coulomb + share * f.stribeck
            current = (still + drag * voltage) / (kept + drag * self.resistance)
            before = speed
            speed = max((voltage - self.resistance * current) / self.constant, 0.0)
            share = f.stribeck_share(speed)
            if abs(speed - before) <= 1e-15 * speed:
                break
        return speed


MOST_ITERATIONS = 200
"""Most iterations of the no-load speed and the holding current, whose errors shrink each time."""
