"""Joint targets of a controller."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.arguments import described, numbers
from phasmid.errors import InvalidInput


@dataclass(frozen=True, slots=True, eq=False)
class JointTargets:
    """Joint targets until the next update.

    Attributes:
        position: Angles [rad], shape (L, 3).
        velocity: Speeds [rad/s], shape (L, 3).
        torque: Feed-forward torque [N·m], shape (L, 3); None for none.
    """

    position: Float[np.ndarray, "legs 3"]
    velocity: Float[np.ndarray, "legs 3"]
    torque: Float[np.ndarray, "legs 3"] | None = None


def checked_targets(targets: object, shape: tuple[int, int]) -> JointTargets:
    """Return what a controller returned, with fields as arrays.

    Args:
        targets: What it returned.
        shape: Of each field: number of legs, and 3.

    Raises:
        InvalidInput: It is none of `JointTargets`, or a field has another shape or no numbers.
    """
    if not isinstance(targets, JointTargets):
        raise InvalidInput(
            f"the controller's update returned {described(targets)}; it must return a "
            "phasmid.experiment.JointTargets with position, velocity and optionally torque, each "
            f"of shape {shape}.",
            hint="return JointTargets(position, velocity)",
        )
    q, v, torque = targets.position, targets.velocity, targets.torque
    if _is_array(q, shape) and _is_array(v, shape) and (torque is None or _is_array(torque, shape)):
        return targets
    q, v = _field("position", q, shape), _field("velocity", v, shape)
    return JointTargets(q, v, None if torque is None else _field("torque", torque, shape))


def _is_array(values: object, shape: tuple[int, int]) -> bool:
    # Quick, because every update is checked.
    return type(values) is np.ndarray and values.shape == shape and values.dtype.kind == "f"


def _field(name: str, values: object, shape: tuple[int, int]) -> Float[np.ndarray, "legs 3"]:
    array = numbers(values, f"{name} of the controller's JointTargets")
    if array.shape != shape:
        raise InvalidInput(
            f"{name} of the controller's JointTargets has shape {array.shape}; it must have shape "
            f"{shape}: a row per leg with coxa, femur and tibia."
        )
    return array
