"""Parameters of a servo that logs may determine, by model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, nearest
from phasmid.servo import Friction, Motor, Servo, complete_servo
from phasmid.servo.law import servo_parameters
from phasmid.servo.servo import (
    FLATTEST_SLOPE,
    FULL_PUNCH,
    STEEPEST_SLOPE,
)
from phasmid.servo.words import servo_label

Model: TypeAlias = Literal["own", "m1", "m2", "m3", "m4", "m5", "m6"]

MODELS: tuple[str, ...] = get_args(Model)


@dataclass(frozen=True)
class Parameter:
    """A parameter of a servo on a bench.

    Attributes:
        name: As in a servo table where it has it.
        unit: Unit in which it is printed.
        per_si: How many of that unit make the internal one.
        scale: Typical size, which counts where the value is smaller [internal unit].
        low: Lowest value.
        high: Highest value.
    """

    name: str
    unit: str
    scale: float
    low: float
    high: float
    per_si: float = 1.0


PARAMETERS = {
    one.name: one
    for one in (
        Parameter("motor_constant", "N·m/A", 1.0, 0.02, 50.0),
        Parameter("resistance", "Ω", 5.0, 0.05, 200.0),
        Parameter("armature", "g·m²", 1e-3, 1e-5, 1.0, 1e3),
        Parameter("friction", "N·m", 0.03, 0.0, 20.0),
        Parameter("viscous_friction", "mN·m·s/rad", 5e-3, 0.0, 20.0, 1e3),
        Parameter("load_loss", "%", 0.2, 0.0, 0.95, 100.0),
        Parameter("external_loss", "%", 0.2, 0.0, 5.0, 100.0),
        Parameter("stribeck_friction", "N·m", 0.03, 0.0, 20.0),
        Parameter("stribeck_load_loss", "%", 0.2, 0.0, 0.95, 100.0),
        Parameter("stribeck_external_loss", "%", 0.2, 0.0, 5.0, 100.0),
        Parameter("quadratic_load_loss", "1/(kN·m)", 0.05, 0.0, 10.0, 1e3),
        Parameter("quadratic_external_loss", "1/(kN·m)", 0.05, 0.0, 10.0, 1e3),
        Parameter("stribeck_speed", "rad/s", 0.5, 0.02, 20.0),
        Parameter("stribeck_exponent", "", 1.0, 0.3, 5.0),
        Parameter("compliance_margin", "ticks", 1.0, 0.0, 50.0),
        Parameter("compliance_slope", "ticks", 32.0, 1.0, 512.0),
        Parameter("punch", "/1023", 32.0, 0.0, 600.0),
        Parameter("p_gain", "", 100.0, 1.0, 20000.0),
        Parameter("backlash", "°", math.radians(0.3), 0.0, math.radians(10), math.degrees(1)),
        Parameter("delay", "ms", 5e-3, 0.0, 0.2, 1e3),
        Parameter("hanging", "°", math.radians(1), -math.pi, math.pi, math.degrees(1)),
    )
}
"""All parameters. `hanging` belongs to the bench: the reported angle of the hanging pendulum."""

_STRIBECK = ("stribeck_friction", "stribeck_speed", "stribeck_exponent")
_LOSSES = {
    "own": ("load_loss",),
    "m1": (),
    "m2": _STRIBECK,
    "m3": ("load_loss",),
    "m4": ("load_loss", *_STRIBECK, "stribeck_load_loss"),
    "m5": (
        "load_loss",
        "external_loss",
        *_STRIBECK,
        "stribeck_load_loss",
        "stribeck_external_loss",
    ),
}
_LOSSES["m6"] = (*_LOSSES["m5"], "quadratic_load_loss", "quadratic_external_loss")
_LAWS = {"compliance": ("compliance_margin", "compliance_slope", "punch"), "pid": ("p_gain",)}

START = {
    "load_loss": 0.1,
    "external_loss": 0.1,
    "stribeck_load_loss": 0.05,
    "stribeck_external_loss": 0.05,
    "quadratic_load_loss": 0.01,
    "quadratic_external_loss": 0.01,
    "stribeck_speed": 0.5,
}
"""First guesses where the servo has none."""


def parameter_names(servo: Servo, model: Model) -> list[str]:
    """Return the parameters of a servo and a friction model, and of the bench, the last."""
    common = ["motor_constant", "resistance", "armature", "friction", "viscous_friction"]
    return [*common, *_LOSSES[model], *_LAWS[servo.law], "backlash", "delay", "hanging"]


def check_names(names: Sequence[str], known: Sequence[str]) -> None:
    """Refuse names that are no parameters of a model.

    Raises:
        InvalidInput: One of them is none.
    """
    for name in names:
        if name not in known:
            guess = nearest(name, known)
            raise InvalidInput(
                f'no parameter "{name}" here.',
                hint=f'"{guess}"' if guess else f"one of {', '.join(known)}",
            )


def start_values(servo: Servo, model: Model, hanging: float) -> dict[str, float]:
    """Return the values of a servo's table, with guesses for what it lacks.

    A model without the load loss of the data sheet gets a motor of the same stall torque.
    """
    motor = servo.motor
    values: dict[str, float] = {
        **{name: getattr(servo, name) for name in PARAMETERS if hasattr(servo, name)},
        "motor_constant": motor.constant,
        "resistance": motor.resistance,
        "load_loss": motor.load_loss,
        "compliance_margin": sum(servo.compliance_margin) / 2,
        "compliance_slope": sum(servo.effective_slope) / 2,
        "p_gain": servo.gain_scale * servo.p_gain,
        "hanging": hanging,
    }
    names = parameter_names(servo, model)
    for name, guess in START.items():
        if name in names and not values[name]:
            values[name] = guess
    values = {name: values[name] for name in names}
    stall = motor.stall_torque(servo.rated_voltage)
    lifted = identified_motor(model, values).stall_torque(servo.rated_voltage)
    values["resistance"] *= (lifted + servo.friction) / (stall + servo.friction)
    return values


def identified_motor(model: Model, values: Mapping[str, float]) -> Motor:
    """Return the motor and friction of a model with these values."""
    loss, still = values.get("load_loss", 0.0), values.get("stribeck_load_loss", 0.0)
    tied = model in ("m3", "m4")
    friction = Friction(
        values["friction"],
        values["viscous_friction"],
        loss,
        loss if tied else values.get("external_loss", 0.0),
        values.get("stribeck_friction", 0.0),
        still,
        still if tied else values.get("stribeck_external_loss", 0.0),
        values.get("quadratic_load_loss", 0.0),
        values.get("quadratic_external_loss", 0.0),
        values.get("stribeck_speed", 0.0),
        values.get("stribeck_exponent", 1.0),
    )
    return Motor(values["resistance"], values["motor_constant"], friction)


def servo_records(
    servo: Servo, model: Model, values: Mapping[str, float], voltages: Sequence[float], dt: float
) -> np.ndarray:
    """Return the parameters of `servo_step` for a servo at several voltages.

    The servo is cold and never shuts down.

    Args:
        servo: Where all else is from.
        model: Friction model.
        values: Of its parameters.
        voltages: Supplies [V].
        dt: Time step [s].
    """
    motor = identified_motor(model, values)
    servo = replace(servo, p_gain=values.get("p_gain", servo.p_gain), gain_scale=1.0)
    records = np.concatenate([servo_parameters(servo.at(voltage), dt) for voltage in voltages])
    changes = {
        **vars(motor.friction),
        "constant": motor.constant,
        "resistance": motor.resistance,
        "inertia": values["armature"],
        "play": values["backlash"] / 2,
        "hottest": math.inf,
        "patience": math.inf,
        "warming": 0.0,
    }
    if servo.law == "compliance":
        changes["margin"] = values["compliance_margin"]
        changes["slope"] = values["compliance_slope"]
        changes["punch"] = values["punch"] / FULL_PUNCH
    for name, value in changes.items():
        records[name] = value
    records["limit"] = [motor.stall_torque(servo.torque_limit * voltage) for voltage in voltages]
    return records


def identified_servo(servo: Servo, model: Model, values: Mapping[str, float]) -> Servo:
    """Return a servo with identified values, by the points of its data sheet.

    The servo's compliance slope is the power of two nearest to the identified one.

    Args:
        servo: Where all else is from.
        model: Friction model.
        values: Identified values.

    Raises:
        InvalidRobot: With these values the servo does not move.
    """
    motor, voltage = identified_motor(model, values), servo.rated_voltage
    friction = motor.friction
    law: dict[str, Any] = {"p_gain": values.get("p_gain", servo.p_gain)}
    if servo.law == "compliance":
        law["compliance_slope"] = (table_slope(values["compliance_slope"]),) * 2
        law["compliance_margin"] = (values["compliance_margin"],) * 2
        law["punch"] = values["punch"]
    identified: dict[str, Any] = dict(
        stall_torque=motor.stall_torque(voltage),
        stall_current=voltage / motor.resistance,
        no_load_speed=motor.no_load_speed(voltage),
        armature=values["armature"],
        friction=friction.coulomb,
        viscous_friction=friction.viscous,
        external_loss=friction.external_loss,
        stribeck_friction=friction.stribeck,
        stribeck_load_loss=friction.stribeck_load_loss,
        stribeck_external_loss=friction.stribeck_external_loss,
        quadratic_load_loss=friction.quadratic_load_loss,
        quadratic_external_loss=friction.quadratic_external_loss,
        stribeck_speed=friction.stribeck_speed,
        stribeck_exponent=friction.stribeck_exponent,
        backlash=values["backlash"],
        delay=values["delay"],
        **law,
    )
    follow = {"stiffness", "damping", "continuous_torque"}
    kept = {
        key: value
        for key, value in servo.numbers.items()
        if key in {"name", *servo.sources} and not (key in follow and servo.is_assumed(key))
    }
    name = f"{servo_label(servo.name)} identified"
    return complete_servo(
        kept | identified | {"name": name, "gain_scale": 1.0},
        dict(servo.sources) | dict.fromkeys(identified, "identified"),
    )


def table_slope(slope: float) -> float:
    """Return the power of two nearest to a compliance slope, as servo tables have it."""
    return min(max(2.0 ** round(math.log2(slope)), STEEPEST_SLOPE), FLATTEST_SLOPE)


def parameter_sizes(
    names: Sequence[str], values: Float[np.ndarray, " p"]
) -> Float[np.ndarray, " p"]:
    """Return the sizes of P parameters: their values, or their scales where these are larger."""
    scales = [PARAMETERS[name].scale for name in names]
    sizes: np.ndarray = np.maximum(np.abs(values), scales)
    return sizes
