"""Leg bench: frames, Jacobian, torques and workspace of one leg at rest."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.dynamics import leg_matrices
from phasmid.dynamics.printed import printed_leg_matrices
from phasmid.errors import InvalidInput
from phasmid.kinematics import explain_foot, foot_position, jacobian, leg_frames
from phasmid.kinematics.printed import printed_dh_transform, printed_joint_angles
from phasmid.kinematics.workspace import LIMIT_TOLERANCE, arc, plane_outline
from phasmid.robot import JOINTS, Leg, Robot, with_mass_model
from phasmid.servo.words import servo_label, servo_words
from phasmid.studio.messages import Answer, Bench

NEARLY_SINGULAR = 0.1
"""Ratio of the Jacobian's singular values below which a remark names the singularity."""


def bench(robot: Robot, request: Bench, gravity: float) -> Answer:
    """Evaluate the paper's Eqs. 1 to 11 for one leg in one pose, at rest.

    Joint speeds of unit norm move the foot on an ellipsoid with the half axes s_i u_i of the
    Jacobian J = U S Vᵀ; joint torques of unit norm hold forces on one with the half axes u_i / s_i.
    Eq. 11 at rest is torque = G - Jᵀ F.

    Args:
        robot: Robot.
        request: Leg, its angles or its foot (default: the neutral foot), and a force.
        gravity: Gravitational acceleration [m/s²].

    Returns:
        Table for JSON, SI, in the hip frame: pose and joint limits, frames and DH table, Jacobian
        and singular values, torques and servo limits, reachable region, the equations as printed,
        and ``remarks``, sentences on infeasible inputs. A foot out of reach gives the pose of
        the nearest possible one. ``most`` is the largest force along the present one within the
        servo limits [N].

    Raises:
        InvalidInput: There is no such leg, its joint limits permit no foot, or the pose has both
            angles and foot.
    """
    leg, force, servo = robot.leg(request.leg), np.array(request.force), robot.servo
    q, remarks = _pose(leg, request)
    foot, J = foot_position(leg, q), jacobian(leg, q)
    low, high = leg.joint_limits.T
    room = np.minimum(q - low, high - q)
    U, axes, _ = np.linalg.svd(J)
    nearness = float(axes[2] / axes[0]) if axes[0] > 0 else 0.0
    weight, load = leg_matrices(leg, q, gravity=gravity).G, -J.T @ force
    own = robot.legs.index(leg)
    torque, limit = weight + load, robot.arrays.stall_torque[own]
    if request.angles is not None:
        remarks += _beyond_limits(leg, q, room)
    if nearness < NEARLY_SINGULAR:
        remarks.append(_singularity(leg, q))
    remarks += [
        f"{leg.name}.{joint} takes {abs(t):.2f} N·m to hold; the {servo_words(servo.name)} gives "
        f"{most:.4g} N·m at most."
        for joint, t, most in zip(JOINTS, torque, limit, strict=True)
        if abs(t) > most
    ]
    coxa, femur, tibia = leg.lengths.tolist()
    side, above = workspace(leg)
    answer = {
        "leg": request.leg,
        "angles": q,
        "foot": foot,
        "limits": leg.joint_limits,
        "room": room,
        "lengths": leg.lengths,
        "weight": robot.mass * gravity,
        "reach": {
            "distance": math.hypot(_in_plane(leg, foot) - coxa, foot[2]),
            "nearest": abs(femur - tibia),
            "farthest": femur + tibia,
        },
        "frames": _frames(leg, q),
        "dh": _dh(leg, q),
        "jacobian": J,
        "singular_values": axes,
        "directions": U.T,
        "manipulability": abs(float(np.linalg.det(J))),
        "nearness": nearness,
        "force_axes": np.divide(1.0, axes, out=np.full(3, np.inf), where=axes > 1e-12),
        # The slowest joint's, so that no direction is promised more.
        "fastest": axes * robot.arrays.no_load_speed[own].min(),
        "force": force,
        "torque": {"load": load, "gravity": weight, "sum": torque},
        "share": np.abs(torque) / limit,
        "most": _most(weight, load, limit) * float(np.linalg.norm(force)),
        "servo": {
            "name": servo_label(servo.name),
            "torque": limit.min(),
            "speed": servo.no_load_speed,
        },
        "printed": _printed(leg, q, foot, force, _mid_length(robot).leg(request.leg), gravity),
        "workspace": {"side": [np.round(curve, 5) for curve in side], "above": np.round(above, 5)},
        "remarks": remarks,
    }
    plain: Answer = _plain(answer)
    return plain


def _pose(leg: Leg, request: Bench) -> tuple[np.ndarray, list[str]]:
    """Return the joint angles, and the explanation of a foot that the leg cannot place.

    A foot beyond joint limits is shown as it is, one out of reach at the nearest possible position.
    """
    if request.angles is not None:
        if request.foot is not None:
            raise InvalidInput("the pose has both angles and foot; it must have one of them.")
        return np.array(request.angles), []
    foot = leg.neutral_foot if request.foot is None else np.array(request.foot)
    found = explain_foot(leg, foot)
    if np.isfinite(found.q).all():
        return found.q, [found.sentence] * (not found.is_possible)
    if np.isnan(found.nearest_q).any():
        raise InvalidInput(found.sentence)
    return found.nearest_q, [found.sentence]


def _in_plane(leg: Leg, foot: np.ndarray) -> float:
    """Return the distance of a foot from the coxa axis along the leg's plane [m]."""
    offset = leg.lateral_offsets.sum()
    return math.sqrt(max(float(foot[0] ** 2 + foot[1] ** 2 - offset**2), 0.0))


def _beyond_limits(leg: Leg, q: np.ndarray, room: np.ndarray) -> list[str]:
    degrees = np.degrees(leg.joint_limits).tolist()
    return [
        f"{leg.name}.{joint} stands at {math.degrees(angle):z.1f}°; its limits are "
        f"{low:.4g}° to {high:.4g}°."
        for joint, angle, margin, (low, high) in zip(JOINTS, q, room, degrees, strict=True)
        if margin < -LIMIT_TOLERANCE
    ]


def _singularity(leg: Leg, q: np.ndarray) -> str:
    """Return the cause of a singularity; det J = r femur tibia sin(q3) vanishes in two ways."""
    coxa, femur, tibia = leg.lengths.tolist()
    r = coxa + femur * math.cos(q[1]) + tibia * math.cos(q[1] + q[2])
    flat = "stretched" if math.cos(q[2]) > 0 else "folded flat"
    why = f"the knee is nearly {flat}"
    if abs(r) / (coxa + femur + tibia) < abs(math.sin(q[2])):
        why = "the foot is close to the coxa axis"
    return f"{leg.name} is nearly singular: {why}, and some motion takes joints at speed."


def _frames(leg: Leg, q: np.ndarray) -> list[dict[str, Any]]:
    """Return frames 0 to 4 in the hip frame."""
    poses = np.concatenate([np.eye(4)[None], leg_frames(leg, q)])
    return [
        {"name": name, "origin": X[:3, 3], "axes": X[:3, :3].T}
        for name, X in zip(("hip", *JOINTS, "foot"), poses, strict=True)
    ]


def _dh(leg: Leg, q: np.ndarray) -> np.ndarray:
    """Return the rows of Table 1: alpha [rad], a [m], d [m] and theta [rad]."""
    coxa, femur, tibia = leg.lengths
    # The femur's axis points to the leg's right.
    right = -leg.lateral_offsets
    return np.array(
        [
            (0.0, 0.0, 0.0, q[0]),
            (math.pi / 2, coxa, right[0], q[1]),
            (0.0, femur, right[1], q[2]),
            (0.0, tibia, right[2], 0.0),
        ]
    )


def _most(gravity: np.ndarray, load: np.ndarray, limit: np.ndarray) -> float:
    """Return the largest feasible multiple of a load beside gravity; NaN if unbounded."""
    if np.any(np.abs(gravity) > limit):
        return 0.0
    pulls = zip(gravity.tolist(), load.tolist(), limit.tolist(), strict=True)
    return min(
        ((most - g if t > 0 else most + g) / abs(t) for g, t, most in pulls if t), default=math.nan
    )


def _printed(
    leg: Leg, q: np.ndarray, foot: np.ndarray, force: np.ndarray, middle: Leg, gravity: float
) -> dict[str, Any]:
    """Evaluate the equations as printed; Eq. 10 assumes masses at mid-length.

    ``foot`` is the end of the chain of Eq. 1, ``angles`` the solution of Eqs. 3 to 9 for the foot,
    ``reached`` the foot at these angles, and ``torque`` Eq. 11 at rest.
    """
    chain = np.linalg.multi_dot(printed_dh_transform(*_dh(leg, q).T))
    angles = printed_joint_angles(leg, foot)
    return {
        "foot": chain[:3, 3],
        "angles": angles,
        "reached": foot_position(leg, angles) if np.isfinite(angles).all() else np.full(3, np.nan),
        "torque": leg_matrices(leg, q, gravity=gravity).G + jacobian(leg, q).T @ force,
        "matrices": printed_leg_matrices(middle, q, gravity=gravity)._asdict(),
        "matrices_right": leg_matrices(middle, q, gravity=gravity)._asdict(),
    }


@lru_cache(4)
def _mid_length(robot: Robot) -> Robot:
    return with_mass_model(robot, "mid-length")


def _plain(value: Any) -> Any:
    """Return a table for JSON: lists for arrays, and None for numbers that are not finite."""
    if isinstance(value, dict):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


# Workspace --------------------------------------------------------------------------------------


@lru_cache(32)
def workspace(
    leg: Leg,
) -> tuple[tuple[Float[np.ndarray, "points 2"], ...], Float[np.ndarray, "points 2"]]:
    """Return the reachable region of a foot within the joint limits, outwards of the coxa axis.

    Returns:
        Closed curves in the leg's plane, whose union is the region: distance from the coxa axis
        and height over the hip [m], each of shape (N, 2); one for each bend of the knee. Then its
        projection along the coxa axis, a closed curve of x and y in the hip frame [m].
    """
    (coxa_low, coxa_high), (low, high), (bent, straight) = leg.joint_limits.tolist()
    # A knee that passes the stretched leg makes two regions.
    flat = np.pi * np.arange(np.ceil(bent / np.pi), np.floor(straight / np.pi) + 1)
    bends = np.unique([bent, *flat, straight])
    side = tuple(plane_outline(leg, (low, high), pair) for pair in pairwise(bends.tolist()))
    out = np.concatenate(side)[:, 0]
    turn = arc(coxa_low, coxa_high)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return side, np.concatenate([out.max() * circle, out.min() * circle[::-1]])
