"""Parameter files of Rhoban BAM (Better Actuator Models): JSON, SI units."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from phasmid.errors import InvalidInput, nearest
from phasmid.recording.file import write_whole
from phasmid.servo import Friction
from phasmid.toml import LARGEST_FILE, read_text

MODELS = ("m1", "m2", "m3", "m4", "m5", "m6")

_BASE = {"friction_base": "coulomb", "friction_viscous": "viscous"}
_STRIBECK = {
    "friction_stribeck": "stribeck",
    "dtheta_stribeck": "stribeck_speed",
    "alpha": "stribeck_exponent",
}
_DIRECTIONAL = {
    "load_friction_motor": "load_loss",
    "load_friction_external": "external_loss",
    "load_friction_motor_stribeck": "stribeck_load_loss",
    "load_friction_external_stribeck": "stribeck_external_loss",
}
_QUADRATIC = {
    "load_friction_motor_quad": "quadratic_load_loss",
    "load_friction_external_quad": "quadratic_external_loss",
}
KEYS = {
    "m1": _BASE,
    "m2": _BASE | _STRIBECK,
    "m3": _BASE | {"load_friction_base": "load_loss"},
    "m4": _BASE
    | _STRIBECK
    | {"load_friction_base": "load_loss", "load_friction_stribeck": "stribeck_load_loss"},
    "m5": _BASE | _STRIBECK | _DIRECTIONAL,
    "m6": _BASE | _STRIBECK | _DIRECTIONAL | _QUADRATIC,
}
"""Fields of `Friction` by key of the file, for each model. The load shares of M3 and M4 count for
both torques."""

_TIED = {"load_loss": "external_loss", "stribeck_load_loss": "stribeck_external_loss"}


@dataclass(frozen=True)
class BamParameters:
    """Content of a parameter file.

    Attributes:
        model: Friction model, ``m1`` to ``m6``.
        actuator: BAM's name of the servo, which selects its law there.
        constant: Torque per current at the output [N·m/A].
        resistance: Of the winding [Ω]; None: the file has none, as for some current-controlled
            servos.
        armature: Inertia of the rotor at the output [kg·m²].
        friction: Friction of motor and gears.
        others: Further numbers of the file, such as ``q_offset``.
    """

    model: str
    actuator: str
    constant: float
    resistance: float | None
    armature: float
    friction: Friction
    others: Mapping[str, float] = field(default_factory=dict)


def load_bam(path: str | Path) -> BamParameters:
    """Read a parameter file.

    Raises:
        InvalidInput: The file is absent or not well formed.
    """
    path = Path(path)
    try:
        raw = json.loads(read_text(path, LARGEST_FILE))
    except (ValueError, RecursionError):
        raise InvalidInput(f"{path} is not JSON.") from None
    if not isinstance(raw, dict) or raw.get("model") not in KEYS:
        known = ", ".join(MODELS)
        raise InvalidInput(f"{path} has no friction model of BAM.", hint=f'"model": one of {known}')
    model, actuator = raw.pop("model"), raw.pop("actuator", "")
    if not isinstance(actuator, str):
        raise InvalidInput(f"{path}: actuator must be text.")
    values = {key: _number(path, key, value) for key, value in raw.items()}
    keys = KEYS[model]
    for key in (*keys, "kt", "armature"):
        if key not in values:
            guess = nearest(key, values)
            raise InvalidInput(f"{path} lacks {key}.", hint=f"not {guess}" if guess else "")
    fields = {name: values.pop(key) for key, name in keys.items()}
    if model in ("m3", "m4"):
        fields |= {tied: fields[name] for name, tied in _TIED.items() if name in fields}
    constant, resistance = values.pop("kt"), values.pop("R", None)
    armature, friction = values.pop("armature"), Friction(**fields)
    return BamParameters(model, actuator, constant, resistance, armature, friction, values)


def save_bam(parameters: BamParameters, path: str | Path) -> None:
    """Write a parameter file; one of the same name is replaced.

    Raises:
        OutputError: The file cannot be written.
    """
    resistance, friction = parameters.resistance, parameters.friction
    content: dict[str, Any] = {
        "kt": parameters.constant,
        **({} if resistance is None else {"R": resistance}),
        "armature": parameters.armature,
        **parameters.others,
        **{key: getattr(friction, name) for key, name in KEYS[parameters.model].items()},
        "model": parameters.model,
        "actuator": parameters.actuator,
    }
    write_whole(Path(path), (json.dumps(content, indent=4) + "\n").encode())


def _number(path: Path, key: str, value: Any) -> float:
    """Return a finite number of a file."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value):
        raise InvalidInput(f"{path}: {key} must be a finite number.")
    return float(value)
