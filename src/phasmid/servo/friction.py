"""Friction of a servo's motor and gears."""

from __future__ import annotations

from dataclasses import astuple, dataclass, fields

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Friction:
    """Friction of a servo's motor and gears at the output, model M6 of Rhoban BAM.

    The motor's torque m and the external torque e act on the gears, in one direction where their
    signs agree; w is the speed. Friction opposes the motion with at most ::

        b |w| + c0 + |c1 m - c2 e| + (s0 + |s1 m - s2 e| + Q) exp(-|w / ws|^a)

    where Q is q2 e² if m drives against e (opposite signs, ``|m| > |e|``), q1 m² if e drives
    against m, else 0. At rest it holds the output within that torque. The smaller models have
    zeros: M1 has c0 and b; M2 adds s0, M3 c1 = c2; M4 has both and s1 = s2; M5 all but Q.
    phasmid's own law has c0, b and c1.

    Source: Duclusaud, Passault, Padois and Ly, "Extended Friction Models for the Physics Simulation
    of Servo Actuators" (2024).

    Attributes:
        coulomb: c0 [N·m].
        viscous: b [N·m·s/rad].
        load_loss: c1, share of the motor's torque that the gears lose.
        external_loss: c2, share of the external torque.
        stribeck: s0 [N·m].
        stribeck_load_loss: s1, share of the motor's torque.
        stribeck_external_loss: s2, share of the external torque.
        quadratic_load_loss: q1 [1/(N·m)].
        quadratic_external_loss: q2 [1/(N·m)].
        stribeck_speed: ws [rad/s]; 0: the exponential is left out.
        stribeck_exponent: a.
    """

    coulomb: float = 0.0
    viscous: float = 0.0
    load_loss: float = 0.0
    external_loss: float = 0.0
    stribeck: float = 0.0
    stribeck_load_loss: float = 0.0
    stribeck_external_loss: float = 0.0
    quadratic_load_loss: float = 0.0
    quadratic_external_loss: float = 0.0
    stribeck_speed: float = 0.0
    stribeck_exponent: float = 1.0

    @property
    def record(self) -> np.ndarray:
        """One record of the fields, for `dry_friction`."""
        kind = [(field.name, np.float64) for field in fields(self)]
        return np.array([astuple(self)], dtype=kind)

    def stribeck_share(self, speed: float) -> float:
        """Return the exponential at a speed [rad/s]; 0 without a Stribeck effect."""
        if self.stribeck_speed <= 0:
            return 0.0
        return float(np.exp(-((abs(speed) / self.stribeck_speed) ** self.stribeck_exponent)))

    def limit(
        self,
        motor_torque: Float[np.ndarray, "*shape"] | float,
        external_torque: Float[np.ndarray, "*shape"] | float,
        speed: Float[np.ndarray, "*shape"] | float,
    ) -> Float[np.ndarray, "*shape"]:
        """Return the largest friction torque [N·m], for arrays that broadcast.

        Args:
            motor_torque: Torque of the motor on the gears [N·m].
            external_torque: Torque of the load on the gears, in the motor's direction [N·m].
            speed: Of the output [rad/s].
        """
        # Lazy import: robots are read without the compiler.
        from phasmid.servo.friction_kernels import dry_frictions

        states = np.broadcast_arrays(*map(np.float64, (motor_torque, external_torque, speed)))
        dry = np.empty(states[0].size)
        dry_frictions(self.record, *(state.ravel() for state in states), dry)
        return dry.reshape(states[0].shape) + self.viscous * np.abs(states[2])
