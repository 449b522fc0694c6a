"""Rules for the numbers of a servo that neither a data sheet nor a measurement gives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from phasmid.servo.servo import FIELD_OF, FULL_PWM, LAW_FIELDS, P_GAIN_UNIT, Servo

ASSUMED = "assumed"
"""Source of a number that follows from a rule, or that the catalogue assumes for other reasons."""

UNKNOWN = "unknown"
"""Source of a number that no rule replaces."""

OWN_FILE = "robot file"
"""Source of a number in a table ``[servo]`` without sources."""

ROTOR_TIME = 0.02
"""Armature times no-load speed over stall torque [s]. Identified servos have 7 to 63 ms: coreless
motors 7 (MX-28) to 17 (XC430), iron rotors 33 (XL-320) to 63 (STS3215 of 7.4 V). This is their
geometric mean, a factor of three from either end."""

FRICTION_SHARE = 0.03
"""Coulomb friction over stall torque. Identified servos have 0.7 % (XC430) to 7 % (XL-320), the
middle one 3 %."""

VISCOUS_SHARE = 0.05
"""Viscous friction at the no-load speed over stall torque. Identified servos have 0.6 to 10 %."""

STALL_EFFICIENCY = 0.5
"""Stall torque times no-load speed over stall current times voltage. Data sheets give 0.43 to 0.86,
the middle one 0.56. A lower value gives a larger current and more heat."""

FULL_OUTPUT_ERROR = 0.1
"""Position error at the stall torque [rad], as analogue servos have it."""

DELAY = 0.01
"""From a command to the answer [s]: half of the period of the usual pulses. Published are 5 ms
(STS3215) to 50 ms (AX-12+)."""

BACKLASH = math.radians(0.5)
"""Backlash [rad]. Published are 0.25 to 1 degree."""

TWIST_AT_STALL = 0.025
"""Twist of the gears at stall [rad]. No measurement was found."""

GEAR_DAMPING_TIME = 1e-3
"""Damping of that twist over its stiffness [s]. No measurement was found."""

TICK = 2 * math.pi / 4096
"""Resolution [rad] of a sensor of 12 bits, and nearly that of a pulse of 1 µs."""

CONTROL_PERIOD = 1e-3
"""From one reading of the position to the next [s]. Not published."""

DERIVATIVE_TIME = 0.01
"""Smoothing of the error's rate [s]: of one tick per period, a D gain of 4000 made 28 % of the
full output."""

OVERLOAD_TIME = 2.0
"""Time at full output before a shutdown [s]. Makers call it a persistent load."""

RATED_VOLTAGE = 12.0
"""Supply [V]: a battery of three cells."""

TEMPERATURE_LIMIT = 70.0
"""Temperature of the shutdown [°C]: initial value of the AX-12A and of the STS3215."""

SPECIFIC_HEAT = 900.0
"""Heat capacity per mass [J/(kg·K)], between copper (400) and plastic (1400)."""

WARMING, OF_MASS = 10.2, 0.0546
"""Thermal resistance [K/W] of an AX-12A: 32 × 50 × 40 mm in still air, 10 W/(m²·K) from all faces;
and its mass [kg]. For cases of one shape it falls with the mass to the power of 2/3."""

STANDBY_CURRENT = 0.05
"""Current of the electronics [A]: the RX-28's in its maker's e-manual; the MX-28 has 0.1."""

CONTINUOUS_SHARE = 1 / 5
"""Continuous over stall torque: the advice of the AX series' maker for its servos."""

Values = Mapping[str, Any]


def _law(servo: Values) -> str:
    """Return the law whose numbers are given, or the proportional one."""
    return "compliance" if any(name in servo for name in LAW_FIELDS["compliance"]) else "pid"


def _stiffness(servo: Values) -> float:
    """Return the stiffness that the position law gives, or the one of `FULL_OUTPUT_ERROR`."""
    torque, tick = servo["stall_torque"], servo["resolution"]
    if servo["law"] == "compliance" and "compliance_slope" in servo:
        return 2 * torque / (sum(servo["compliance_slope"]) * tick)
    if servo["law"] == "pid" and "p_gain" in servo:
        return torque * servo["p_gain"] / (P_GAIN_UNIT * FULL_PWM * tick)
    return torque / FULL_OUTPUT_ERROR


def _p_gain(servo: Values) -> float:
    """Return the gain of a servo's stiffness."""
    output_per_tick = servo["stiffness"] * servo["resolution"] / servo["stall_torque"]
    return P_GAIN_UNIT * FULL_PWM * output_per_tick


def _compliance_slope(servo: Values) -> tuple[float, float]:
    """Return the slope of a servo's stiffness, of which the power of two below counts."""
    ticks = servo["stall_torque"] / (servo["stiffness"] * servo["resolution"])
    return ticks, ticks


def _mass(servo: Values) -> float:
    return servo.get("mass", OF_MASS)


RULES: dict[str, Callable[[Values], Any]] = {
    "rated_voltage": lambda _: RATED_VOLTAGE,
    "maximum_voltage": lambda servo: servo["rated_voltage"],
    "stall_current": lambda servo: (
        servo["stall_torque"] * servo["no_load_speed"] / (STALL_EFFICIENCY * servo["rated_voltage"])
    ),
    "continuous_torque": lambda servo: CONTINUOUS_SHARE * servo["stall_torque"],
    "armature": lambda servo: ROTOR_TIME * servo["stall_torque"] / servo["no_load_speed"],
    "friction": lambda servo: FRICTION_SHARE * servo["stall_torque"],
    "viscous_friction": lambda servo: (
        VISCOUS_SHARE * servo["stall_torque"] / servo["no_load_speed"]
    ),
    # The slope of the torque-speed line: what counter voltage and friction take from a motor.
    "damping": lambda servo: servo["stall_torque"] / servo["no_load_speed"],
    "backlash": lambda _: BACKLASH,
    "gear_stiffness": lambda servo: servo["stall_torque"] / TWIST_AT_STALL,
    "gear_damping_time": lambda _: GEAR_DAMPING_TIME,
    "delay": lambda _: DELAY,
    "resolution": lambda _: TICK,
    "control_period": lambda _: CONTROL_PERIOD,
    "law": _law,
    "stiffness": _stiffness,
    "p_gain": _p_gain,
    "d_gain": lambda _: 0.0,
    "derivative_time": lambda _: DERIVATIVE_TIME,
    "compliance_slope": _compliance_slope,
    "compliance_margin": lambda _: (1.0, 1.0),
    "punch": lambda _: 32.0,
    "torque_limit": lambda _: 1.0,
    "overload_time": lambda _: OVERLOAD_TIME,
    "temperature_limit": lambda _: TEMPERATURE_LIMIT,
    "thermal_resistance": lambda servo: WARMING * (OF_MASS / _mass(servo)) ** (2 / 3),
    "heat_capacity": lambda servo: SPECIFIC_HEAT * _mass(servo),
    "standby_current": lambda _: STANDBY_CURRENT,
}
"""Each number that can be absent, from those before it; SI units."""


def complete_servo(known: Mapping[str, Any], sources: Mapping[str, str] | None = None) -> Servo:
    """Build a servo of the numbers that are known; the rules of this file give the others.

    Args:
        known: Fields of `Servo` in SI units, at least ``name``, ``stall_torque`` and
            ``no_load_speed``; None stands for an unknown number.
        sources: Source of each known number; without one it is the robot's file.

    Returns:
        The servo, with the source of every number that its law uses.

    Raises:
        InvalidRobot: A number is not finite or has the wrong sign.
    """
    values = {name: value for name, value in known.items() if value is not None}
    stated = dict.fromkeys(values.keys() - {"name"}, OWN_FILE) | dict(sources or {})
    law = values.get("law") or _law(values)
    idle = {name for other, names in LAW_FIELDS.items() if other != law for name in names}
    for name, rule in RULES.items():
        if name in values or name in idle or stated.get(name) == UNKNOWN:
            continue
        values[name] = rule(values)
        stated[name] = ASSUMED
    return Servo(**{FIELD_OF.get(name, name): v for name, v in values.items()}, sources=stated)


ALIKE = 0.05
"""Part by which two numbers for one quantity may differ without a remark."""


def contradictions(servo: Servo) -> list[str]:
    """Return a sentence on each given number that some drive does not use.

    Args:
        servo: The servo, with the sources of its numbers.
    """
    given = [name for name in servo.sources if not servo.is_assumed(name)]
    idle = [
        f'{name} has no effect with law "{servo.law}".'
        for law, names in LAW_FIELDS.items()
        for name in names
        if law != servo.law and name in given
    ]
    law = _stiffness(servo.numbers | {"compliance_slope": servo.effective_slope})
    if "stiffness" in given and abs(servo.stiffness / law - 1) > ALIKE:
        idle.append(
            f'stiffness {servo.stiffness:.3g} N·m/rad acts with drive "ideal-servo" alone; the law '
            f"{servo.law} of the table gives {law:.3g} N·m/rad."
        )
    brake = servo.rated_stall_torque / servo.rated_no_load_speed
    if "damping" in given and abs(servo.damping / brake - 1) > ALIKE:
        idle.append(
            f'damping {servo.damping:.3g} N·m·s/rad acts with drive "ideal-servo" alone; stall '
            f"torque and no-load speed give {brake:.3g} N·m·s/rad."
        )
    return idle
