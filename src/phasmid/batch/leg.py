"""The equations of one leg, or of several side by side, over any number of samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from jaxtyping import Float

from phasmid import dynamics, kinematics
from phasmid.batch.evaluation import evaluate
from phasmid.batch.result import room
from phasmid.dynamics.matrices import hip_gravity, link_arrays
from phasmid.errors import InvalidInput
from phasmid.kinematics.arguments import check_leg, leading_axes, number, numbers
from phasmid.kinematics.leg import angles_of, unreachable
from phasmid.robot import Leg, LegArrays
from phasmid.units import STANDARD_GRAVITY


def leg_torque(
    leg: Leg | LegArrays,
    q: Float[np.ndarray, "*#batch 3"],
    qd: Float[np.ndarray, "*#batch 3"],
    qdd: Float[np.ndarray, "*#batch 3"],
    *,
    foot_force: Float[np.ndarray, "*#batch 3"] | None = None,
    gravity: float = STANDARD_GRAVITY,
    threads: int | None = 1,
    out: Float[np.ndarray, "*batch 3"] | None = None,
) -> Float[np.ndarray, "*batch 3"]:
    """Joint torques that move a leg as given, as ``dynamics.leg_torque``.

    Args:
        leg: The leg, or a robot's ``arrays`` for all legs along the axis before the last.
        q: Coxa, femur and tibia angles [rad], shape (..., 3).
        qd: Their speeds [rad/s], shape (..., 3).
        qdd: Their accelerations [rad/s²], shape (..., 3).
        foot_force: Force of the ground on the foot in hip axes [N], shape (..., 3);
            none by default.
        gravity: Acceleration of free fall, downwards along the body's z [m/s²].
        threads: Threads to use; None for one per core.
        out: Array to fill and return; it may be one of the inputs.

    Returns:
        Torques of coxa, femur and tibia [N·m], shape (..., 3).

    Raises:
        InvalidInput: It is no leg, an array, ``threads`` or ``out`` does not fit, or gravity is no
            finite number.

    Source: Eq. 11, corrected.
    """
    given = numbers(q=q, qd=qd, qdd=qdd)
    if foot_force is not None:
        given |= numbers(foot_force=foot_force)
    names = ("lengths", "mass", "com", "inertia")
    legs = dict(zip(names, link_arrays(leg), strict=True))
    gravity = number("gravity", gravity)
    along, aside = hip_gravity(leg, gravity)
    kernel = "leg_torque" if foot_force is None else "loaded_leg_torque"
    if aside is None:
        legs = {"gravity": np.full(legs["lengths"].shape[:-1], along), **legs}
    else:
        legs = {"gravity": np.stack([*aside, np.asarray(along)], axis=-1), **legs}
        kernel = f"tilted_{kernel}"
    readable = partial(dynamics.leg_torque, leg, gravity=gravity)
    return _filled(kernel, leg, legs, given, (3,), readable, threads, out)


def foot_position(
    leg: Leg | LegArrays,
    q: Float[np.ndarray, "*#batch 3"],
    *,
    threads: int | None = 1,
    out: Float[np.ndarray, "*batch 3"] | None = None,
) -> Float[np.ndarray, "*batch 3"]:
    """Foot of a leg for given joint angles, as ``kinematics.foot_position``.

    Args:
        leg: The leg, or a robot's ``arrays``.
        q: Coxa, femur and tibia angles [rad], shape (..., 3).
        threads: Threads to use; None for one per core.
        out: Array to fill and return; it may be the input.

    Returns:
        Foot in the leg's hip frame [m], shape (..., 3).

    Raises:
        InvalidInput: It is no leg, or an array, ``threads`` or ``out`` does not fit.
    """
    check_leg(leg, Leg, LegArrays)
    readable = partial(kinematics.foot_position, leg)
    legs = {"lengths": leg.lengths}
    return _filled("foot_position", leg, legs, numbers(q=q), (3,), readable, threads, out)


def jacobian(
    leg: Leg | LegArrays,
    q: Float[np.ndarray, "*#batch 3"],
    *,
    threads: int | None = 1,
    out: Float[np.ndarray, "*batch 3 3"] | None = None,
) -> Float[np.ndarray, "*batch 3 3"]:
    """Jacobian of the foot, as ``kinematics.jacobian``.

    Args:
        leg: The leg, or a robot's ``arrays``.
        q: Joint angles [rad], shape (..., 3).
        threads: Threads to use; None for one per core.
        out: Array to fill and return.

    Returns:
        d foot / d q [m/rad], shape (..., 3, 3): rows x, y, z; columns coxa, femur, tibia.

    Raises:
        InvalidInput: It is no leg, or an array, ``threads`` or ``out`` does not fit.
    """
    check_leg(leg, Leg, LegArrays)
    readable = partial(kinematics.jacobian, leg)
    legs = {"lengths": leg.lengths}
    return _filled("jacobian", leg, legs, numbers(q=q), (3, 3), readable, threads, out)


def joint_angles(
    leg: Leg | LegArrays,
    p_hip_foot: Float[np.ndarray, "*#batch 3"],
    *,
    threads: int | None = 1,
    out: Float[np.ndarray, "*batch 3"] | None = None,
) -> Float[np.ndarray, "*batch 3"]:
    """Joint angles that place the foot at a point, as ``kinematics.joint_angles``.

    Args:
        leg: The leg, or a robot's ``arrays``.
        p_hip_foot: Foot in the leg's hip frame [m], shape (..., 3).
        threads: Threads to use; None for one per core.
        out: Array to fill and return; not the input.

    Returns:
        Coxa, femur and tibia angles [rad], shape (..., 3), knee up and leg outwards.

    Raises:
        Unreachable: A point is nearer or farther than the leg can go; carries the first such
            point. ``out`` is then filled in part.
        InvalidInput: It is no leg, or an array, ``threads`` or ``out`` does not fit.
    """

    def readable(p_hip_foot: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        lengths, p = np.moveaxis(leg.lengths, -1, 0), np.moveaxis(p_hip_foot, -1, 0)
        q, margin = angles_of(lengths, p)
        return np.stack(q, axis=-1), np.asarray(margin)

    check_leg(leg, Leg, LegArrays)
    given = numbers(p_hip_foot=p_hip_foot)
    call = _Call(leg, given, (3,), out)
    # The error tells of the point, which must still be there.
    if np.may_share_memory(call.result, given["p_hip_foot"]):
        raise InvalidInput("out shares memory with p_hip_foot; it must be an array of its own.")
    missed = call.run("joint_angles", {"lengths": leg.lengths}, readable, threads)
    if missed is not None:
        index = np.unravel_index(missed, call.axes or (1,))
        point = tuple(map(int, index))[: len(call.axes)]
        raise unreachable(leg, np.broadcast_to(given["p_hip_foot"], call.result.shape), point)
    return call.result


def _filled(
    kernel: str,
    leg: Leg | LegArrays,
    legs: Mapping[str, np.ndarray],
    given: Mapping[str, np.ndarray],
    entry: tuple[int, ...],
    readable: Callable[..., np.ndarray],
    threads: int | None,
    out: np.ndarray | None,
) -> np.ndarray:
    call = _Call(leg, given, entry, out)
    call.run(kernel, legs, lambda **parts: (readable(**parts),), threads)
    return call.result


class _Call:
    """Arguments of one call, checked, and the array that it fills."""

    def __init__(
        self,
        leg: Leg | LegArrays,
        given: Mapping[str, np.ndarray],
        entry: tuple[int, ...],
        out: np.ndarray | None,
    ) -> None:
        self.axes = leading_axes(given, (3,), leg.lengths.shape[:-1])
        self.result = room(out, (*self.axes, *entry), given)
        self._alone = leg.lengths.ndim == 1
        self._given = given
        self._entry = len(entry)

    def run(
        self,
        kernel: str,
        legs: Mapping[str, np.ndarray],
        readable: Callable[..., tuple[np.ndarray, ...]],
        threads: int | None,
    ) -> int | None:
        """Fill the result; returns the first entry without a solution, if there is one."""
        given, result, lead = self._given, self.result, self.axes[:-1]
        if self._alone:
            # One leg is a row of one.
            legs = {key: values[None] for key, values in legs.items()}
            given = {key: values[..., None, :] for key, values in given.items()}
            result, lead = np.expand_dims(result, -1 - self._entry), self.axes
        return evaluate(kernel, legs, given, [result], lead, readable, threads=threads)
