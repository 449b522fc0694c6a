"""One leg by itself: its frames, its Jacobian, and what a force on its foot asks of its servos."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from phasmid.dynamics import LegMatrices, leg_matrices
from phasmid.errors import InvalidInput, Unreachable
from phasmid.kinematics import (
    dh_transform,
    foot_position,
    jacobian,
    joint_angles,
    leg_frames,
)
from phasmid.kinematics.workspace import LIMIT_TOLERANCE
from phasmid.robot import JOINTS, Leg, Robot, with_mass_model
from phasmid.studio.messages import Answer, Bench
from phasmid.studio.outline import at_height, workspace
from phasmid.units import STANDARD_GRAVITY

NEARLY_SINGULAR = 0.1
"""Below this ratio of the Jacobian's singular values the bench names what is wrong."""


def bench(robot: Robot, request: Bench) -> Answer:
    """All that the paper's Eqs. 1 to 11 say of one leg at one pose, at rest.

    Args:
        robot: The robot.
        request: The leg, its angles or its foot (neither: its neutral foot), and a force.

    Returns:
        As JSON holds it, in SI, in the hip frame: the pose with its limits, frames and DH table,
        Jacobian with its singular values, torques beside the servo's, the reachable region, the
        equations as printed beside the right ones, and ``remarks``: what is not possible so, in
        sentences. A foot out of reach gives its sentence and the nearest pose.

    Raises:
        InvalidInput: There is no such leg, or both angles and foot are given.
    """
    leg = robot.leg(request.leg)
    force = np.array(request.force)
    q, remarks = _pose(leg, request)
    foot = foot_position(leg, q)
    z = float(foot[2])
    pose = {
        "leg": request.leg,
        "name": leg.name.replace("_", " "),
        "angles": q.tolist(),
        "foot": foot.tolist(),
        "limits": leg.joint_limits.tolist(),
        "room": _room(leg, q).tolist(),
        "lengths": leg.lengths.tolist(),
        "weight": robot.mass * STANDARD_GRAVITY,
        "reach": _reach(leg, foot),
        "level": [s for curve in workspace(robot, request.leg).side for s in at_height(curve, z)],
    }
    moved, statics = _jacobian(leg, q, robot), _statics(leg, q, force, robot)
    printed = _printed(leg, q, foot, force, _mid_length(robot).legs[request.leg - 1])
    remarks += [*_beyond_limits(leg, q), *moved.pop("remarks"), *statics.pop("remarks")]
    answer = pose | _frames(leg, q) | moved | statics | {"printed": printed, "remarks": remarks}
    return _plain(answer) | {"workspace": _drawn(robot, request.leg)}


def _pose(leg: Leg, request: Bench) -> tuple[np.ndarray, list[str]]:
    """The angles to show, and a sentence where they are not what was asked for."""
    if request.angles is not None:
        if request.foot is not None:
            raise InvalidInput("angles and foot are both given; it must be one of them.")
        return np.array(request.angles), []
    if request.foot is None:
        return joint_angles(leg, leg.neutral_foot), []
    foot = np.array(request.foot)
    try:
        return joint_angles(leg, foot), []
    except Unreachable as error:
        return joint_angles(leg, nearest_reachable(leg, foot)), [error.what]


def nearest_reachable(leg: Leg, foot: np.ndarray) -> np.ndarray:
    """Return the point nearest to a foot that the leg reaches outwards, joint limits aside.

    For a leg with lateral offsets it is the nearest in the leg's plane.

    Args:
        leg: The leg.
        foot: In the hip frame [m], shape (3,).

    Returns:
        In the hip frame [m], shape (3,); the foot itself where the leg reaches it.
    """
    coxa, femur, tibia = leg.lengths.tolist()
    nearest, farthest = abs(femur - tibia), femur + tibia
    away, z = math.hypot(foot[0], foot[1]), float(foot[2])
    beside = float(leg.lateral_offsets.sum())
    out = _in_plane(leg, foot) - coxa
    distance = math.hypot(out, z)
    wanted = min(max(distance, nearest), farthest)
    # The femur axis itself is as near to all that can be reached; so is the coxa axis around it.
    along, up = (out / distance, z / distance) if distance > 0 else (1.0, 0.0)
    r, height = coxa + wanted * along, wanted * up
    if r < 0:
        r, height = 0.0, math.copysign(math.sqrt(nearest**2 - coxa**2), z)
    ahead, left = (foot[0] / away, foot[1] / away) if away > 0 else (1.0, 0.0)
    r = math.hypot(r, beside)
    return np.array([r * ahead, r * left, height])


def _in_plane(leg: Leg, foot: np.ndarray) -> float:
    """Return the distance of a foot from the coxa axis along the leg's plane [m]."""
    beside = leg.lateral_offsets.sum()
    return math.sqrt(max(float(foot[0] ** 2 + foot[1] ** 2 - beside**2), 0.0))


def _room(leg: Leg, q: np.ndarray) -> np.ndarray:
    """How far each joint is from its nearer limit [rad]; below zero beyond it."""
    return np.minimum(q - leg.joint_limits[:, 0], leg.joint_limits[:, 1] - q)


def _beyond_limits(leg: Leg, q: np.ndarray) -> list[str]:
    degrees = np.degrees(leg.joint_limits).tolist()
    return [
        f"{leg.name}.{joint} stands at {math.degrees(angle):z.1f}°; its limits are "
        f"{low:.4g}° to {high:.4g}°."
        for joint, angle, room, (low, high) in zip(JOINTS, q, _room(leg, q), degrees, strict=True)
        if room < -LIMIT_TOLERANCE
    ]


def _reach(leg: Leg, foot: np.ndarray) -> dict[str, float]:
    """Distance of the foot from the femur axis, and between which it can be [m]."""
    coxa, femur, tibia = leg.lengths.tolist()
    distance = math.hypot(_in_plane(leg, foot) - coxa, foot[2])
    return {"distance": distance, "nearest": abs(femur - tibia), "farthest": femur + tibia}


def _frames(leg: Leg, q: np.ndarray) -> dict[str, Any]:
    """Frames 0 to 4 in the hip frame, axes as columns, and Table 1 with the present angles."""
    poses = np.concatenate([np.eye(4)[None], leg_frames(leg, q)])
    names = ("hip", *JOINTS, "foot")
    return {
        "frames": [
            {"name": name, "origin": X[:3, 3].tolist(), "axes": X[:3, :3].T.tolist()}
            for name, X in zip(names, poses, strict=True)
        ],
        "dh": [list(row) for row in _dh(leg, q)],
    }


def _dh(leg: Leg, q: np.ndarray) -> list[tuple[float, float, float, float]]:
    """Rows of Table 1: alpha [rad] and a [m] of the link before, d [m] and theta [rad]."""
    coxa, femur, tibia = leg.lengths.tolist()
    q1, q2, q3 = q.tolist()
    # The femur's axis points to the leg's right.
    right = (-leg.lateral_offsets).tolist()
    return [
        (0.0, 0.0, 0.0, q1),
        (math.pi / 2, coxa, right[0], q2),
        (0.0, femur, right[1], q3),
        (0.0, tibia, right[2], 0.0),
    ]


def _jacobian(leg: Leg, q: np.ndarray, robot: Robot) -> dict[str, Any]:
    """The Jacobian, its ellipsoids and how near it is to a singularity.

    Joint speeds of unit norm move the foot on an ellipsoid with the half axes s_i u_i of
    J = U S Vᵀ; joint torques of unit norm hold forces on one with the half axes u_i / s_i.
    """
    J = jacobian(leg, q)
    U, values, Vt = np.linalg.svd(J)
    with np.errstate(divide="ignore"):
        force = np.where(values > 1e-12, 1 / values, np.inf)
    nearness = float(values[2] / values[0]) if values[0] > 0 else 0.0
    remarks = []
    if nearness < NEARLY_SINGULAR:
        coxa, femur, tibia = leg.lengths.tolist()
        r = coxa + femur * math.cos(q[1]) + tibia * math.cos(q[1] + q[2])
        # The determinant is r femur tibia sin(q3): it vanishes with either of the two.
        over_axis = abs(r) / (coxa + femur + tibia) < abs(math.sin(q[2]))
        flat = "stretched" if math.cos(q[2]) > 0 else "folded flat"
        why = "the foot is close to the coxa axis" if over_axis else f"the knee is nearly {flat}"
        remarks = [f"{leg.name} is nearly singular: {why}, and some motion takes joints at speed."]
    return {
        "jacobian": J.tolist(),
        "singular_values": values.tolist(),
        "directions": U.T.tolist(),
        "joint_speeds": Vt.tolist(),
        "manipulability": abs(float(np.linalg.det(J))),
        "nearness": nearness,
        "force_axes": force.tolist(),
        "fastest": (values * robot.servo.no_load_speed).tolist(),
        "remarks": remarks,
    }


def _statics(leg: Leg, q: np.ndarray, force: np.ndarray, robot: Robot) -> dict[str, Any]:
    """Eq. 11 at rest, torque = G - Jᵀ F, beside what the servo gives.

    ``most`` is the largest force along the given one that no servo gives up under [N].
    """
    servo, J = robot.servo, jacobian(leg, q)
    matrices = leg_matrices(leg, q)
    load = -J.T @ force
    torque, limit = matrices.G + load, servo.stall_torque
    share = np.abs(torque) / limit
    remarks = [
        f"{leg.name}.{joint} takes {abs(t):.2f} N·m to hold; the servo {servo.name} gives "
        f"{limit:.4g} N·m at most."
        for joint, t in zip(JOINTS, torque, strict=True)
        if abs(t) > limit
    ]
    return {
        "force": force.tolist(),
        "matrices": _matrices(matrices),
        "torque": {"load": load.tolist(), "gravity": matrices.G.tolist(), "sum": torque.tolist()},
        "share": share.tolist(),
        "most": _most(matrices.G, load, limit) * float(np.linalg.norm(force)),
        "servo": {"name": servo.name, "torque": limit, "speed": servo.no_load_speed},
        "remarks": remarks,
    }


def _most(gravity: np.ndarray, load: np.ndarray, limit: float) -> float:
    """How many times a load each servo bears beside gravity; NaN where nothing bounds it."""
    if np.any(np.abs(gravity) > limit):
        return 0.0
    pulls = [pull for pull in zip(gravity.tolist(), load.tolist(), strict=True) if pull[1]]
    return min(((limit - g if t > 0 else limit + g) / abs(t) for g, t in pulls), default=math.nan)


def _printed(
    leg: Leg, q: np.ndarray, foot: np.ndarray, force: np.ndarray, middle: Leg
) -> dict[str, Any]:
    """The same by the equations as the paper prints them; Eq. 10 knows masses at mid-length only.

    ``foot`` is where the chain of Eq. 1 ends, ``angles`` what Eqs. 3 to 9 give for the foot and
    ``reached`` where these angles put it, ``torque`` is Eq. 11 at rest.
    """
    chain = np.linalg.multi_dot(dh_transform(*np.array(_dh(leg, q)).T, form="as-printed"))
    angles = joint_angles(leg, foot, form="as-printed")
    reached = foot_position(leg, angles) if np.isfinite(angles).all() else np.full(3, math.nan)
    return {
        "foot": chain[:3, 3].tolist(),
        "angles": angles.tolist(),
        "reached": reached.tolist(),
        "torque": (leg_matrices(leg, q).G + jacobian(leg, q).T @ force).tolist(),
        "matrices": _matrices(leg_matrices(middle, q, form="as-printed")),
        "matrices_right": _matrices(leg_matrices(middle, q)),
    }


def _matrices(found: LegMatrices) -> dict[str, Any]:
    return {name: matrix.tolist() for name, matrix in found._asdict().items()}


@lru_cache(32)
def _drawn(robot: Robot, leg: int) -> dict[str, Any]:
    """The outlines as JSON holds them, kept since they are most of an answer."""
    side, above = workspace(robot, leg)
    return {
        "side": [np.round(curve, 5).tolist() for curve in side],
        "above": np.round(above, 5).tolist(),
    }


@lru_cache(4)
def _mid_length(robot: Robot) -> Robot:
    return with_mass_model(robot, "mid-length")


def _plain(value: Any) -> Any:
    """As JSON holds it: what is not finite is null."""
    if isinstance(value, dict):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
