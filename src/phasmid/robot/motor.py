"""Direct-current motor with gears of load-dependent friction."""

from __future__ import annotations

from dataclasses import dataclass

from phasmid.errors import InvalidRobot


@dataclass(frozen=True)
class Motor:
    """Motor and gears, with all quantities at the output.

    Its current is i = (u - k w) / R under the voltage u at the speed w, its torque k i. Of that
    the gears lose c1 |k i| + c0 to friction that opposes the motion, and b w.

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

    @classmethod
    def from_data_sheet(
        cls,
        name: str,
        *,
        stall_torque: float,
        stall_current: float,
        no_load_speed: float,
        voltage: float,
        coulomb: float,
        viscous: float,
    ) -> Motor:
        """Return the motor with the stall and no-load points of a data sheet.

        At stall k i (1 - c1) - c0 is the torque with i = V/R. Without load the current i0 obeys
        k i0 (1 - c1) = c0 + b w0 and R i0 + k w0 = V. These are two linear equations in turn: the
        ratio i0 / i is (c0 + b w0) / (torque + c0), and k = (V - R i0) / w0.

        Args:
            name: Of the servo, for messages.
            stall_torque: At the output [N·m].
            stall_current: Current with it [A].
            no_load_speed: w0 [rad/s].
            voltage: V, of both points [V].
            coulomb: c0 [N·m].
            viscous: b [N·m·s/rad].

        Raises:
            InvalidRobot: The gears would need an efficiency above 1, or friction takes all of the
                motor's torque.
        """
        idle = (coulomb + viscous * no_load_speed) / (stall_torque + coulomb)
        if idle >= 1:
            raise InvalidRobot(
                f"servo {name}: friction at the no-load speed is "
                f"{coulomb + viscous * no_load_speed:.3g} N·m; "
                f"the stall torque of {stall_torque:.3g} N·m cannot overcome it."
            )
        constant = voltage * (1 - idle) / no_load_speed
        kept = (stall_torque + coulomb) / (constant * stall_current)
        if kept > 1:
            raise InvalidRobot(
                f"servo {name}: stall_torque and no_load_speed give "
                f"{stall_torque * no_load_speed:.3g} W per {voltage * stall_current:.3g} W of "
                "supply; gears cannot create power.",
                hint="check stall_current and rated_voltage",
            )
        return cls(voltage / stall_current, constant, 1 - kept, coulomb, viscous)

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
