"""Settings and supply of a scenario's servos."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from annotated_types import Ge, Gt, Le
from pydantic import BeforeValidator

from phasmid.robot import Servo
from phasmid.robot.servo import both_directions
from phasmid.tables import Hint, Number, Table, Temperature, Voltage

Ticks = Annotated[Number, Ge(0), Le(254)]
Pair = Annotated[
    Annotated[tuple[Ticks, Ticks], BeforeValidator(both_directions)] | None,
    Hint("a number of ticks, or two of them, such as [1, 2]"),
]


class ServoTable(Table):
    """``[servo]``: settings of the robot's servos; those that are absent are the servo's own.

    All of them concern ``drive = "servo"``; supply, air and torque limit also the verdict on the
    servos.

    Attributes:
        voltage: Supply of the servos [V]; absent: the servo's rated voltage.
        ambient_temperature: Of the air, and of the servos at the start [°C].
        torque_limit: Largest output, as a share of the full one.
        compliance_margin: Position error up to which the output is nothing [ticks]; a pair stands
            for turning towards smaller and towards larger angles.
        compliance_slope: Error beyond the margin at which the output is full [ticks], or a pair;
            powers of two count, from 2 to 128: of other numbers the one below is taken.
        punch: Output at the margin, in 1/1023 of the full one.
        p_gain: Output per position error of a servo with a PID law, in its maker's units.
        d_gain: Output per change of that error, in its maker's units.
    """

    voltage: Annotated[Voltage, Gt(0), Le(100)] | None = None
    ambient_temperature: Annotated[Temperature, Ge(-50), Le(100)] = 25.0
    torque_limit: Annotated[Number, Gt(0), Le(1)] | None = None
    compliance_margin: Pair = None
    compliance_slope: Pair = None
    punch: Annotated[Number, Ge(0), Le(1023)] | None = None
    p_gain: Annotated[Number, Ge(0), Le(16383)] | None = None
    d_gain: Annotated[Number, Ge(0), Le(16383)] | None = None

    def supply(self, servo: Servo) -> float:
        """Return the voltage at which a servo runs [V]."""
        return servo.rated_voltage if self.voltage is None else self.voltage

    def set_up(self, servo: Servo) -> Servo:
        """Return a servo with these settings in place of its own."""
        outside = {"voltage", "ambient_temperature"}
        return replace(servo, **self.model_dump(exclude=outside, exclude_none=True))
