"""Servos: motor, gears and position law."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cached_property
from typing import Annotated, Any, Literal, get_type_hints

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BeforeValidator, create_model

from phasmid.arguments import check_kind
from phasmid.errors import InvalidInput, InvalidRobot, PhasmidError
from phasmid.servo.friction import Friction
from phasmid.servo.motor import Motor
from phasmid.servo.words import servo_words
from phasmid.tables import (
    Angle,
    AngularVelocity,
    Mass,
    Number,
    Rate,
    Table,
    Temperature,
    Time,
    Voltage,
    dotted,
    validate,
)

Law = Literal["compliance", "pid"]
Interface = Literal["pwm", "bus", "smart"]


def both_directions(value: Any) -> Any:
    """Return a pair for both directions of a servo, from one number or a pair."""
    alone = isinstance(value, int | float) and not isinstance(value, bool)
    return (value, value) if alone else value


Positive = Annotated[Number, Gt(0)]
NotNegative = Annotated[Number, Ge(0)]
Directions = Annotated[tuple[NotNegative, NotNegative], BeforeValidator(both_directions)]
"""A setting of a servo while it turns towards smaller angles, and towards larger ones."""

STEEPEST_SLOPE, FLATTEST_SLOPE = 2.0, 128.0
"""Compliance slopes of the makers' servos, in ticks; between them the powers of two."""

AMBIENT = 25.0
"""Usual temperature of the air, and of servos at the start [°C]."""

NEEDED = ("name", "stall_torque", "no_load_speed")
"""Fields that no rule can give."""

LAW_FIELDS = {
    "compliance": ("compliance_margin", "compliance_slope", "punch"),
    "pid": ("p_gain", "d_gain", "derivative_time"),
}
"""Numbers that one position law alone uses."""

FULL_PUNCH, FULL_PWM = 1023, 885
"""Full output in the makers' units: of the compliance law, and of the PID law."""

P_GAIN_UNIT, D_GAIN_UNIT = 128, 16
"""Gains of the PID law that stand for 1 in `FULL_PWM` of full output."""

LEAST = 1e-6
"""Least stall torque [N·m] and no-load speed [rad/s]: under a supply below the motor's friction
they would be 0, and ratios to them infinite."""

ROUND_OFF = 1e-9
"""Efficiency above 1 that is round-off of gears without load-dependent losses."""

LONGEST_DELAY = 0.2
"""Longest delay of a servo [s]; the slowest published one is 50 ms."""


@dataclass(frozen=True)
class Servo:
    """Position servo with the numbers of its data sheet, its supply and its air.

    `at` returns the servo at another supply. `stall_torque`, `no_load_speed` and `voltage` are
    those at the supply; the rated ones belong to `rated_voltage`. The types carry the units of
    files, whose keys for the rated numbers are ``stall_torque`` and ``no_load_speed``.

    The drive ``ideal-servo`` uses `stiffness` and `damping`, the drive ``servo`` the servo's own
    position law. `phasmid.servo.complete_servo` builds a servo of the numbers that are known, by
    the rules of ``rules`` for the others.

    Attributes:
        name: Maker's name.
        rated_stall_torque: Largest torque, at standstill under `rated_voltage` [N·m].
        rated_no_load_speed: Largest speed, without load under `rated_voltage` [rad/s].
        stiffness: Of the ideal servo: torque per position error, below the limit [N·m/rad].
        damping: Of the ideal servo: loss of torque per speed, by the motor's counter voltage and
            friction [N·m·s/rad].
        armature: Rotor inertia seen at the output [kg·m²].
        friction: Coulomb friction of motor and gears, at the output [N·m].
        stall_current: Current at standstill under `rated_voltage` [A]; None: not known, and the
            servo's own law cannot be simulated.
        rated_voltage: Supply at which torque, speed and current are given [V].
        maximum_voltage: Highest supply that the maker allows [V].
        continuous_torque: Torque that the servo holds without an end [N·m].
        viscous_friction: Friction per speed of motor and gears, at the output [N·m·s/rad].
        external_loss: Share of the external torque that the gears lose, see `Friction`.
        stribeck_friction: Friction beside `friction` at rest, which fades with the speed [N·m].
        stribeck_load_loss: Share of the motor's torque that is lost at rest, likewise.
        stribeck_external_loss: Share of the external torque that is lost at rest, likewise.
        quadratic_load_loss: Loss at rest per square of the motor's torque [1/(N·m)].
        quadratic_external_loss: Loss at rest per square of the external torque [1/(N·m)].
        stribeck_speed: Speed over which the losses at rest fade [rad/s]; 0: there are none.
        stribeck_exponent: Of that fading.
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
        gain_scale: Factor on the output per position error, by which a servo differs from its
            maker's law; 1: not at all. `phasmid.compare` estimates it.
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
        interface: ``pwm``: pulses, nothing comes back and nothing protects it; ``bus``: a serial
            bus, the servo reports its position and shuts down when it is too hot; ``smart``: it
            reports load and temperature, too; None: not known.
        mass: Mass [kg]; None: not known.
        price: About what one costs [US dollars]; None: not known.
        supply: Supply voltage [V]; None: `rated_voltage`.
        ambient_temperature: Temperature of the air [°C].
        sources: Source of each number, by its name: ``data sheet``, ``identified``, ``assumed``,
            ``robot file`` or ``unknown``, with the publication in brackets.

    Raises:
        InvalidRobot: A number is not finite or has the wrong sign.
    """

    name: str
    rated_stall_torque: Positive
    rated_no_load_speed: Annotated[Rate, Gt(0)]
    stiffness: Positive
    damping: NotNegative
    armature: Positive
    friction: NotNegative
    viscous_friction: NotNegative
    rated_voltage: Annotated[Voltage, Gt(0)]
    maximum_voltage: Annotated[Voltage, Gt(0)]
    continuous_torque: Positive
    backlash: Annotated[Angle, Ge(0)]
    gear_stiffness: Positive
    gear_damping_time: Annotated[Time, Ge(0)]
    delay: Annotated[Time, Ge(0), Le(LONGEST_DELAY)]
    resolution: Annotated[Angle, Gt(0)]
    control_period: Annotated[Time, Gt(0)]
    law: Law
    torque_limit: Annotated[Number, Gt(0), Le(1)]
    overload_time: Annotated[Time, Gt(0)]
    temperature_limit: Temperature
    thermal_resistance: Positive
    heat_capacity: Positive
    standby_current: NotNegative
    stall_current: Positive | None = None
    external_loss: NotNegative = 0.0
    stribeck_friction: NotNegative = 0.0
    stribeck_load_loss: Annotated[Number, Ge(0), Lt(1)] = 0.0
    stribeck_external_loss: NotNegative = 0.0
    quadratic_load_loss: NotNegative = 0.0
    quadratic_external_loss: NotNegative = 0.0
    stribeck_speed: Annotated[AngularVelocity, Ge(0)] = 0.0
    stribeck_exponent: Positive = 1.0
    compliance_margin: Directions = (1.0, 1.0)
    compliance_slope: Directions = (32.0, 32.0)
    punch: Annotated[Number, Ge(0), Le(1023)] = 32.0
    gain_scale: Positive = 1.0
    p_gain: NotNegative = 850.0
    d_gain: NotNegative = 0.0
    derivative_time: Annotated[Time, Gt(0)] = 0.01
    interface: Interface | None = None
    mass: Annotated[Mass, Gt(0)] | None = None
    price: Positive | None = None
    supply: Annotated[Voltage, Gt(0)] | None = None
    ambient_temperature: Temperature = AMBIENT
    sources: Mapping[str, str] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        check_kind(self.name, str, "servo: name", InvalidRobot)
        check_kind(self.sources, Mapping[str, str], f"{self.name}: sources", InvalidRobot)
        for name in ("supply", "ambient_temperature"):
            check_kind(getattr(self, name), float | None, f"{self.name}: {name}", InvalidRobot)
        if self.supply is not None and not (math.isfinite(self.supply) and self.supply > 0):
            raise InvalidRobot(
                f"{servo_words(self.name)}: supply is {self.supply:g} V; it must be above 0."
            )
        try:
            validate(
                ServoNumbers,
                self.numbers,
                lambda loc: (f"{servo_words(self.name)}: {dotted(loc)}", ""),
            )
        except InvalidInput as error:
            raise InvalidRobot(error.what, hint=error.hint) from None

    @cached_property
    def motor(self) -> Motor:
        """The motor and its gears, so that stall and no-load point are both met.

        At stall k i (1 - c1 - s1) = A, the torque that the gears take for the stall torque, with
        i = V/R. Without load the current i0 obeys k i0 (1 - c1 - s1 e) = D, the drag at the no-load
        speed w0, with R i0 + k w0 = V and the Stribeck effect e of w0. Eliminating c1 gives
        (A + s k) (1 - k w0/V) = D with s = s1 (1 - e) i, an equation in k alone.

        Ideal servos do without, and may have numbers that fit no motor.

        Raises:
            InvalidInput: The stall current is not known.
            InvalidRobot: The gears would need an efficiency above 1, or friction takes all of the
                motor's torque.
        """
        current, voltage = self.stall_current, self.rated_voltage
        torque, speed = self.rated_stall_torque, self.rated_no_load_speed
        if current is None:
            raise InvalidInput(
                f"{servo_words(self.name)} has no stall_current; its own law needs one.",
                hint='drive = "ideal-servo", or the stall_current of its data sheet in the file\'s '
                "table of the servo",
            )
        lossless = self._friction(0.0)
        still, fast = lossless.stribeck_share(0.0), lossless.stribeck_share(speed)
        drag = self.friction + fast * self.stribeck_friction + self.viscous_friction * speed
        part = 1 + self.external_loss + still * self.stribeck_external_loss
        taken = part * torque + self.friction + still * self.stribeck_friction
        taken += still * self.quadratic_external_loss * torque**2
        idle = drag / taken
        if idle >= 1:
            raise InvalidRobot(
                f"{servo_words(self.name)}: friction at the no-load speed is {drag:.3g} N·m; the "
                f"stall torque of {torque:.3g} N·m cannot overcome it."
            )
        constant = voltage * (1 - idle) / speed
        lost_at_rest = (still - fast) * self.stribeck_load_loss * current
        if lost_at_rest > 0:
            slope = taken * speed / voltage - lost_at_rest
            root = math.sqrt(slope**2 + 4 * lost_at_rest * speed / voltage * (taken - drag))
            constant = 2 * (taken - drag) / (slope + root)
        efficiency = taken / (constant * current) + still * self.stribeck_load_loss
        if efficiency > 1 + ROUND_OFF:
            raise InvalidRobot(
                f"{servo_words(self.name)}: stall_torque and no_load_speed give "
                f"{torque * speed:.3g} W per {voltage * current:.3g} W of supply; gears "
                "cannot create power.",
                hint="check stall_current and rated_voltage",
            )
        return Motor(voltage / current, constant, self._friction(max(1 - efficiency, 0.0)))

    def _friction(self, load_loss: float) -> Friction:
        """Return the friction with a share of the motor's torque that the gears lose in motion."""
        return Friction(
            self.friction,
            self.viscous_friction,
            load_loss,
            self.external_loss,
            self.stribeck_friction,
            self.stribeck_load_loss,
            self.stribeck_external_loss,
            self.quadratic_load_loss,
            self.quadratic_external_loss,
            self.stribeck_speed,
            self.stribeck_exponent,
        )

    @property
    def source_lines(self) -> tuple[str, ...]:
        """Which numbers come from where, a line for each source."""
        by_source: dict[str, list[str]] = {}
        for number in filter(self.sources.__contains__, self.numbers):
            by_source.setdefault(self.sources[number], []).append(number.replace("_", " "))
        return tuple(f"{source}: {', '.join(names)}." for source, names in by_source.items())

    def is_assumed(self, number: str) -> bool:
        """Return whether a number is assumed."""
        return self.sources.get(number, "").startswith("assumed")

    def at(self, voltage: float | None) -> Servo:
        """Return this servo at a supply voltage [V]; None: the rated one."""
        return replace(self, supply=voltage)

    @property
    def voltage(self) -> float:
        """Supply voltage [V]."""
        return self.rated_voltage if self.supply is None else self.supply

    @property
    def standby_power(self) -> float:
        """Power of the electronics [W]; all of it is heat."""
        return self.standby_current * self.voltage

    @property
    def supply_words(self) -> str:
        """Words such as `` at 9 V`` where supply or torque limit lower its numbers, else none."""
        words = [] if self.voltage == self.rated_voltage else [f"at {self.voltage:g} V"]
        if self.torque_limit < 1:
            words.append(f"with a torque limit of {100 * self.torque_limit:.3g} %")
        return "".join(f" {each}" for each in words)

    @cached_property
    def stall_torque(self) -> float:
        """Largest torque at standstill, at the supply and within the torque limit [N·m].

        A supply above `maximum_voltage` adds nothing: no data sheet vouches for more. Without a
        known motor the torque is taken as proportional to the voltage. The least is `LEAST`.
        """
        if self._applied == self.rated_voltage:
            return self.rated_stall_torque
        motor, rated = self.known_motor, self.rated_stall_torque
        share = self._applied / self.rated_voltage
        return max(rated * share if motor is None else motor.stall_torque(self._applied), LEAST)

    @cached_property
    def no_load_speed(self) -> float:
        """Largest speed without load, at the supply and within the torque limit [rad/s].

        The torque limit is one of the motor's voltage: it limits the speed, too. Other rules as for
        `stall_torque`.
        """
        if self._applied == self.rated_voltage:
            return self.rated_no_load_speed
        motor, rated = self.known_motor, self.rated_no_load_speed
        share = self._applied / self.rated_voltage
        return max(rated * share if motor is None else motor.no_load_speed(self._applied), LEAST)

    @property
    def full_output_torque(self) -> float:
        """Torque at standstill of the full output, whatever the torque limit [N·m]."""
        return replace(self, torque_limit=1.0).stall_torque

    @property
    def _applied(self) -> float:
        """Largest voltage at the winding for which a data sheet vouches [V]."""
        return self.torque_limit * min(self.voltage, self.maximum_voltage)

    @property
    def numbers(self) -> dict[str, Any]:
        """Name and numbers by the keys of files; SI units."""
        return {key: getattr(self, FIELD_OF.get(key, key)) for key in _FIELDS}

    @property
    def known_motor(self) -> Motor | None:
        """Motor, or None where it is unknown or impossible."""
        try:
            return self.motor
        except PhasmidError:
            return None

    @property
    def effective_slope(self) -> Directions:
        """Effective compliance slopes: powers of two, as in the servos, over `gain_scale`."""
        return tuple(  # type: ignore[return-value]
            2.0 ** math.floor(math.log2(min(max(slope, STEEPEST_SLOPE), FLATTEST_SLOPE)))
            / self.gain_scale
            for slope in self.compliance_slope
        )


FIELD_OF = {"stall_torque": "rated_stall_torque", "no_load_speed": "rated_no_load_speed"}
"""Fields of `Servo` that have another key in files."""

_KEY_OF = {field: key for key, field in FIELD_OF.items()}

_TYPES = get_type_hints(Servo, include_extras=True)

_FIELDS: dict[str, Any] = {
    _KEY_OF.get(each.name, each.name): (
        _TYPES[each.name],
        ... if each.default is MISSING else each.default,
    )
    for each in fields(Servo)
    if each.name not in ("sources", "supply", "ambient_temperature")
}

ServoNumbers: Any = create_model("ServoNumbers", __base__=Table, **_FIELDS)
"""Table of a servo's fields, with their units and bounds."""

_KNOWN: dict[str, Any] = {
    name: (kind, ...) if name in NEEDED else (kind | None, None)
    for name, (kind, _) in _FIELDS.items()
}

KnownNumbers: Any = create_model("KnownNumbers", __base__=Table, **_KNOWN)
"""The same of a file, which may leave out all but `NEEDED`."""
