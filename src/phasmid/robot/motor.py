"""Direct-current motor with gears of load-dependent friction."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Motor:
    """Motor and gears, with all quantities at the output.

    At voltage u and speed w the current is ``i = (u - k w) / R`` and the motor's torque ``k i``.
    Friction of the gears opposes the motion with ``c1 |k i| + c0 + b w``.

    Attributes:
        resistance: R, of winding and leads [Ω].
        constant: k, torque per current and voltage per speed [N·m/A].
        load_loss: c1, share of the motor's torque that the gears lose.
        coulomb: c0, friction without load [N·m].
        viscous: b, friction per speed [N·m·s/rad].
    """

    resistance: float
    constant: float
    load_loss: float
    coulomb: float
    viscous: float

    def stall_torque(self, voltage: float) -> float:
        """Return the stall torque at the output [N·m] when it lifts a load.

        Args:
            voltage: At the winding [V].
        """
        given = (1 - self.load_loss) * self.constant * voltage / self.resistance
        return max(given - self.coulomb, 0.0)

    def no_load_current(self, voltage: float) -> float:
        """Current that turns the unloaded output [A].

        Args:
            voltage: At the winding [V].
        """
        kept = (1 - self.load_loss) * self.constant
        drag = self.viscous / self.constant
        return (self.coulomb + drag * voltage) / (kept + drag * self.resistance)

    def no_load_speed(self, voltage: float) -> float:
        """Return the no-load speed of the output [rad/s].

        Args:
            voltage: At the winding [V].
        """
        return max((voltage - self.resistance * self.no_load_current(voltage)) / self.constant, 0.0)
