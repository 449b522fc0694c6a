"""Servos: motor, gears and position law."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator

from phasmid.errors import InvalidInput, InvalidRobot, PhasmidError
from phasmid.robot.motor import Motor
from phasmid.tables import Angle, Mass, Number, Rate, Temperature, Time, Voltage

Law = Literal["compliance", "pid"]


def both_directions(value: Any) -> Any:
    """Return a pair for both directions of a servo, from one number or a pair."""
    alone = isinstance(value, int | float) and not isinstance(value, bool)
    return (value, value) if alone else value


Directions = Annotated[tuple[Number, Number], BeforeValidator(both_directions)]
"""A setting of a servo while it turns towards smaller angles, and towards larger ones."""

STEEPEST_SLOPE, FLATTEST_SLOPE = 2.0, 128.0
"""Compliance slopes of the makers' servos, in ticks; between them the powers of two."""

CONTINUOUS_SHARE = 1 / 5
"""Part of the stall torque within which the maker's AX series holds steadily (e-manual)."""

ROTOR_TIME = 0.02
"""Armature times no-load speed over stall torque [s], assumed where no armature is known. Four
identified servos have 13 ms (MX-64), 15 (MX-106), 34 (XL-320) and 38 (XL-330): Rhoban BAM, m1,
with the stall torques and no-load speeds of their data sheets."""

HEAT_RANGE = 0.5, 2.0
"""Factors on a computed warming between which the real one is expected. Free air takes 5 to
20 W/(m² K) from a case, with radiation and a light draught; 10 is assumed. The specific heat lies
between that of copper, 0.4 J/(g K), and of plastic, 1.4; 0.9 is assumed."""


BACKLASH, TICK = math.radians(0.5), math.radians(300 / 1024)
"""Backlash and resolution of an AX-12A [rad]."""

STANDBY_CURRENT = 0.05
"""Current of a servo's electronics [A], assumed where none is published: that of the RX-28 by its
maker's e-manual; the MX-28's is 0.1."""

LONGEST_DELAY = 0.2
"""Longest delay of a servo [s]; the slowest published one is 50 ms."""


@dataclass(frozen=True)
class Servo:
    """Position servo with the numbers of its data sheet; the types carry the units of files.

    The first ones serve the ideal servo and the limits of plan and report, the others the drive
    ``servo``, which imitates the servo's own inner law. What a table leaves out of those is as of
    the AX-12A; see ``servos.toml`` for where each number comes from.

    Attributes:
        name: Maker's name.
        stall_torque: Largest torque, at standstill [N·m].
        no_load_speed: Largest speed, without load [rad/s].
        stiffness: Of the ideal servo: torque per position error, below the limit [N·m/rad].
        damping: Of the ideal servo: torque per speed error [N·m·s/rad].
        armature: Rotor inertia seen at the output [kg·m²]; 0: not known, see `rotor_inertia`.
        friction: Coulomb friction of motor and gears, at the output [N·m].
        stall_current: Current at standstill under `rated_voltage` [A].
        rated_voltage: Supply at which torque, speed and current are given [V].
        maximum_voltage: Highest supply that the maker allows [V]; None: `rated_voltage`.
        continuous_torque: Torque that the servo holds without an end [N·m]; None: a fifth of the
            stall torque, which the maker of the AX series advises for any of its servos.
        viscous_friction: Friction per speed of motor and gears, at the output [N·m·s/rad].
        backlash: Angle by which the output is free of the gears [rad].
        gear_stiffness: Torque per twist of the gears, seen at the output [N·m/rad].
        gear_damping_time: Damping of that twist over its stiffness [s].
        delay: Time from a command on the bus to the servo's answer to it [s].
        resolution: Step of the position sensor, which sits at the output, and of the goal [rad].
        control_period: Time from one look at the position to the next [s].
        law: How the position error becomes an output, a share of the supply voltage:
            ``compliance``: none within a margin, then from the punch up to all of it along the
            slope; ``pid``: proportional to the error and to how fast it changes.
        compliance_margin: Error up to which the output is nothing [ticks].
        compliance_slope: Error beyond the margin at which the output is full [ticks]; as in the
            maker's servo the power of two below it counts, from 2 to 128.
        punch: Output at the margin, in 1/1023 of the full one.
        p_gain: Of ``pid``, in the maker's units: 128 stands for 1/885 of full output per tick.
        d_gain: Of ``pid``, in the maker's units: 16 stands for 1/885 of full output per tick that
            the error changes in a control period.
        derivative_time: Time constant with which that change is smoothed [s].
        torque_limit: Largest output, as a share of the full one.
        overload_time: Time at the largest output after which the servo shuts down [s].
        temperature_limit: Temperature at which it shuts down [°C].
        thermal_resistance: Warming per power lost in the winding, when steady [K/W].
        heat_capacity: Heat that warms it by a degree [J/K].
        standby_current: Current of the electronics while the motor rests [A].
        mass: Mass [kg]; None: not known.
        price: About what one costs [US dollars]; None: not known.

    Raises:
        InvalidRobot: A number is not finite or has the wrong sign.
    """

    name: str
    stall_torque: Number
    no_load_speed: Rate
    stiffness: Number
    damping: Number = 0.0
    armature: Number = 0.0
    friction: Number = 0.0
    stall_current: Number | None = None
    rated_voltage: Voltage = 12.0
    maximum_voltage: Voltage | None = None
    continuous_torque: Number | None = None
    viscous_friction: Number = 0.0033
    backlash: Angle = BACKLASH
    gear_stiffness: Number = 60.0
    gear_damping_time: Time = 1e-3
    delay: Time = 0.0
    resolution: Angle = TICK
    control_period: Time = 1e-3
    law: Law = "compliance"
    compliance_margin: Directions = (1.0, 1.0)
    compliance_slope: Directions = (32.0, 32.0)
    punch: Number = 32.0
    p_gain: Number = 850.0
    d_gain: Number = 0.0
    derivative_time: Time = 0.01
    torque_limit: Number = 1.0
    overload_time: Time = 2.0
    temperature_limit: Temperature = 70.0
    thermal_resistance: Number = 10.2
    heat_capacity: Number = 49.0
    standby_current: Number = STANDBY_CURRENT
    mass: Mass | None = None
    price: Number | None = None

    def __post_init__(self) -> None:
        if self.law not in get_args(Law):
            raise InvalidRobot(
                f'servo {self.name}: law is "{self.law}"; it must be "compliance" or "pid".'
            )
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in {"name", "law"} or value is None:
                continue
            for number in value if isinstance(value, tuple) else (value,):
                self._check(field.name, number)
        if self.delay > LONGEST_DELAY:
            raise InvalidRobot(
                f"servo {self.name}: delay is {self.delay:g} s; "
                f"it must be {LONGEST_DELAY:g} s or less.",
                hint="delay_ms = 11",
            )
        if self.punch > 1023 or self.torque_limit > 1:
            name, most = ("punch", 1023) if self.punch > 1023 else ("torque_limit", 1)
            raise InvalidRobot(
                f"servo {self.name}: {name} is {getattr(self, name)}; it must be {most} or less."
            )

    def _check(self, name: str, value: float) -> None:
        positive = name in _POSITIVE
        least = "greater than 0" if positive else "0 or more"
        if name == "temperature_limit":
            if math.isfinite(value):
                return
            least = "in °C"
        elif math.isfinite(value) and value >= 0 and not (positive and value == 0):
            return
        raise InvalidRobot(
            f"servo {self.name}: {name} is {value}; it must be a finite number, {least}."
        )

    @property
    def motor(self) -> Motor:
        """The motor and its gears, so that stall and no-load point are both met.

        Ideal servos do without, and may have numbers that fit no motor.

        Raises:
            InvalidInput: The stall current is not known.
            InvalidRobot: No motor has these numbers.
        """
        if self.stall_current is None:
            raise InvalidInput(
                f"servo {self.name} has no stall_current; its own law needs one.",
                hint='drive = "ideal-servo", or stall_current = 1.5 (A) in [servo]',
            )
        return Motor.from_data_sheet(
            self.name,
            stall_torque=self.stall_torque,
            stall_current=self.stall_current,
            no_load_speed=self.no_load_speed,
            voltage=self.rated_voltage,
            coulomb=self.friction,
            viscous=self.viscous_friction,
        )

    @property
    def rotor_inertia(self) -> float:
        """Armature [kg·m²]; by default stall torque over no-load speed times `ROTOR_TIME`."""
        return self.armature or ROTOR_TIME * self.stall_torque / self.no_load_speed

    @property
    def highest_voltage(self) -> float:
        """Highest supply voltage of the data sheet [V]."""
        return self.rated_voltage if self.maximum_voltage is None else self.maximum_voltage

    @property
    def continuous(self) -> float:
        """Continuous torque [N·m]."""
        if self.continuous_torque is None:
            return CONTINUOUS_SHARE * self.stall_torque
        return self.continuous_torque

    def stall_at(self, voltage: float) -> float:
        """Return the stall torque at a supply voltage, within the torque limit [N·m].

        A supply above `highest_voltage` adds nothing: no data sheet vouches for more. Without a
        known motor the torque is taken as proportional to the voltage.

        Args:
            voltage: The supply [V].
        """
        applied = self.torque_limit * min(voltage, self.highest_voltage)
        motor = self.known_motor
        if motor is None:
            return self.stall_torque * applied / self.rated_voltage
        return motor.stall_torque(applied)

    @property
    def known_motor(self) -> Motor | None:
        """Motor, or None where it is unknown or impossible."""
        try:
            return self.motor
        except PhasmidError:
            return None

    @property
    def effective_slope(self) -> Directions:
        """Effective compliance slopes: powers of two, as in the servos."""
        return tuple(  # type: ignore[return-value]
            2.0 ** math.floor(math.log2(min(max(slope, STEEPEST_SLOPE), FLATTEST_SLOPE)))
            for slope in self.compliance_slope
        )


_POSITIVE = {
    "stall_torque",
    "no_load_speed",
    "stiffness",
    "stall_current",
    "rated_voltage",
    "maximum_voltage",
    "continuous_torque",
    "gear_stiffness",
    "resolution",
    "control_period",
    "derivative_time",
    "torque_limit",
    "overload_time",
    "thermal_resistance",
    "heat_capacity",
    "mass",
    "price",
}
