"""Leg bench: frames, Jacobian, torques and workspace of one leg at rest."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.dynamics import LegMatrices, leg_matrices
from phasmid.dynamics.printed import printed_leg_matrices
from phasmid.errors import InvalidInput, Unreachable
from phasmid.kinematics import (
    foot_position,
    jacobian,
    joint_angles,
    leg_frames,
)
from phasmid.kinematics.printed import printed_dh_transform, printed_joint_angles
from phasmid.kinematics.workspace import LIMIT_TOLERANCE
from phasmid.robot import JOINTS, Leg, Robot, with_mass_model
from phasmid.studio.messages import Answer, Bench
from phasmid.units import STANDARD_GRAVITY

ARC_STEP = np.radians(3.0)
"""Angle between neighbouring points of an arc: a chord on a leg of 0.25 m deviates by 0.1 mm."""

NEARLY_SINGULAR = 0.1
"""Ratio of the Jacobian's singular values below which a remark names the singularity."""


def bench(robot: Robot, request: Bench) -> Answer:
    """Evaluate the paper's Eqs. 1 to 11 for one leg in one pose, at rest.

    Args:
        robot: Robot.
        request: Leg, its angles or its foot (default: the neutral foot), and a force.

    Returns:
        Table for JSON, SI, in the hip frame: pose and joint limits, frames and DH table, Jacobian
        and singular values, torques and servo limits, reachable region, the equations as printed,
        and ``remarks``, sentences on infeasible inputs. A foot out of reach gives the nearest
        pose.

    Raises:
        InvalidInput: There is no such leg, or the pose has both angles and foot.
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
    motion, statics = _jacobian(leg, q, robot), _statics(leg, q, force, robot)
    printed = _printed(leg, q, foot, force, _mid_length(robot).legs[request.leg - 1])
    remarks += [*_beyond_limits(leg, q), *motion.pop("remarks"), *statics.pop("remarks")]
    answer = pose | _frames(leg, q) | motion | statics | {"printed": printed, "remarks": remarks}
    return _plain(answer) | {"workspace": _outlines(robot, request.leg)}


def _pose(leg: Leg, request: Bench) -> tuple[np.ndarray, list[str]]:
    """Return the joint angles, and a remark if the foot is out of reach."""
    if request.angles is not None:
        if request.foot is not None:
            raise InvalidInput("the pose has both angles and foot; it must have one of them.")
        return np.array(request.angles), []
    if request.foot is None:
        return joint_angles(leg, leg.neutral_foot), []
    foot = np.array(request.foot)
    try:
        return joint_angles(leg, foot), []
    except Unreachable as error:
        return joint_angles(leg, nearest_reachable(leg, foot)), [error.what]


def nearest_reachable(leg: Leg, foot: np.ndarray) -> np.ndarray:
    """Return the reachable point nearest to a foot, without joint limits.

    For a leg with lateral offsets it is the nearest in the leg's plane.

    Args:
        leg: Leg.
        foot: Foot position in the hip frame [m], shape (3,).

    Returns:
        Position in the hip frame [m], shape (3,).
    """
    coxa, femur, tibia = leg.lengths.tolist()
    nearest, farthest = abs(femur - tibia), femur + tibia
    radius, z = math.hypot(foot[0], foot[1]), float(foot[2])
    offset = float(leg.lateral_offsets.sum())
    out = _in_plane(leg, foot) - coxa
    distance = math.hypot(out, z)
    target = min(max(distance, nearest), farthest)
    # All directions from the femur axis are equally near; so are those around the coxa axis.
    along, up = (out / distance, z / distance) if distance > 0 else (1.0, 0.0)
    r, height = coxa + target * along, target * up
    if r < 0:
        r, height = 0.0, math.copysign(math.sqrt(nearest**2 - coxa**2), z)
    x, y = (foot[0] / radius, foot[1] / radius) if radius > 0 else (1.0, 0.0)
    r = math.hypot(r, offset)
    return np.array([r * x, r * y, height])


def _in_plane(leg: Leg, foot: np.ndarray) -> float:
    """Return the distance of a foot from the coxa axis along the leg's plane [m]."""
    offset = leg.lateral_offsets.sum()
    return math.sqrt(max(float(foot[0] ** 2 + foot[1] ** 2 - offset**2), 0.0))


def _room(leg: Leg, q: np.ndarray) -> np.ndarray:
    """Return the margin of each joint to its nearer limit [rad]."""
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
    """Return the distance of the foot from the femur axis, and its bounds [m]."""
    coxa, femur, tibia = leg.lengths.tolist()
    distance = math.hypot(_in_plane(leg, foot) - coxa, foot[2])
    return {"distance": distance, "nearest": abs(femur - tibia), "farthest": femur + tibia}


def _frames(leg: Leg, q: np.ndarray) -> dict[str, Any]:
    """Return frames 0 to 4 in the hip frame, and Table 1 with the present angles."""
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
    """Return the rows of Table 1: alpha [rad], a [m], d [m] and theta [rad]."""
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
    """Return the Jacobian, its ellipsoids and its distance from a singularity.

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
    """Evaluate Eq. 11 at rest, torque = G - Jᵀ F.

    ``most`` is the largest force along the present one within the servo limits [N].
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
    """Return the largest feasible multiple of a load beside gravity; NaN if unbounded."""
    if np.any(np.abs(gravity) > limit):
        return 0.0
    pulls = [pull for pull in zip(gravity.tolist(), load.tolist(), strict=True) if pull[1]]
    return min(((limit - g if t > 0 else limit + g) / abs(t) for g, t in pulls), default=math.nan)


def _printed(
    leg: Leg, q: np.ndarray, foot: np.ndarray, force: np.ndarray, middle: Leg
) -> dict[str, Any]:
    """Evaluate the equations as printed; Eq. 10 assumes masses at mid-length.

    ``foot`` is the end of the chain of Eq. 1, ``angles`` the solution of Eqs. 3 to 9 for the foot,
    ``reached`` the foot at these angles, and ``torque`` Eq. 11 at rest.
    """
    chain = np.linalg.multi_dot(printed_dh_transform(*np.array(_dh(leg, q)).T))
    angles = printed_joint_angles(leg, foot)
    reached = foot_position(leg, angles) if np.isfinite(angles).all() else np.full(3, math.nan)
    return {
        "foot": chain[:3, 3].tolist(),
        "angles": angles.tolist(),
        "reached": reached.tolist(),
        "torque": (leg_matrices(leg, q).G + jacobian(leg, q).T @ force).tolist(),
        "matrices": _matrices(printed_leg_matrices(middle, q)),
        "matrices_right": _matrices(leg_matrices(middle, q)),
    }


def _matrices(found: LegMatrices) -> dict[str, Any]:
    return {name: matrix.tolist() for name, matrix in found._asdict().items()}


def _outlines(robot: Robot, leg: int) -> dict[str, Any]:
    side, above = workspace(robot, leg)
    return {
        "side": [np.round(curve, 5).tolist() for curve in side],
        "above": np.round(above, 5).tolist(),
    }


@lru_cache(4)
def _mid_length(robot: Robot) -> Robot:
    return with_mass_model(robot, "mid-length")


def _plain(value: Any) -> Any:
    """Replace numbers that are not finite by None, for JSON."""
    if isinstance(value, dict):
        return {name: _plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


# Workspace --------------------------------------------------------------------------------------


class Workspace(NamedTuple):
    """Reachable region of a foot.

    Attributes:
        side: Closed curves in the leg's plane, whose union is the region: distance from the coxa
            axis and height over the hip [m], each of shape (N, 2); one for each bend of the knee.
        above: Its projection along the coxa axis, a closed curve of x and y in the hip frame [m],
            shape (N, 2).
    """

    side: tuple[Float[np.ndarray, "points 2"], ...]
    above: Float[np.ndarray, "points 2"]


def workspace(robot: Robot, leg: int) -> Workspace:
    """Return the region within the joint limits, outwards of the coxa axis.

    Args:
        robot: Robot.
        leg: Number of the leg, from 1.

    Raises:
        InvalidRobot: There is no such leg.
    """
    return _workspace(robot.leg(leg))


@lru_cache(32)
def _workspace(leg: Leg) -> Workspace:
    (coxa_low, coxa_high), (low, high), (bent, straight) = leg.joint_limits.tolist()
    # With the knee bent to one side the foot is a one-to-one function of the angles: the edges of
    # the limits are the edges of the region. A knee that passes the stretched leg makes two.
    flat = np.pi * np.arange(np.ceil(bent / np.pi), np.floor(straight / np.pi) + 1)
    bends = np.unique([bent, *flat, straight])
    side = tuple(_sheet(leg, (low, high), pair) for pair in pairwise(bends.tolist()))
    out = np.concatenate(side)[:, 0]
    turn = _between(coxa_low, coxa_high)
    arc = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return Workspace(side, np.concatenate([out.max() * arc, out.min() * arc[::-1]]))


def _sheet(leg: Leg, femur: tuple[float, float], tibia: tuple[float, float]) -> np.ndarray:
    """Return distance and height of the foot along the edges of a rectangle of angles [m]."""
    up, bend = _between(*femur), _between(*tibia)
    edges = [
        (up, np.full_like(up, tibia[0])),
        (np.full_like(bend, femur[1]), bend),
        (up[::-1], np.full_like(up, tibia[1])),
        (np.full_like(bend, femur[0]), bend[::-1]),
    ]
    q2, q3 = (np.concatenate(each) for each in zip(*edges, strict=True))
    foot = foot_position(leg, np.stack([np.zeros_like(q2), q2, q3], axis=-1))[:, [0, 2]]
    # What lies behind the coxa axis folds onto it.
    return np.column_stack([np.maximum(foot[:, 0], 0.0), foot[:, 1]])


def _between(low: float, high: float) -> np.ndarray:
    return np.linspace(low, high, 2 + int((high - low) / ARC_STEP))


def at_height(side: Float[np.ndarray, "points 2"], height: float) -> list[tuple[float, float]]:
    """Return the stretches of a closed curve at a height.

    Args:
        side: One of `Workspace.side`.
        height: Height over the hip [m].

    Returns:
        Nearest and farthest distance of each stretch from the coxa axis [m].
    """
    (r0, z0), (r1, z1) = side.T, np.roll(side, -1, axis=0).T
    crosses = (z0 <= height) != (z1 <= height)
    share = (height - z0[crosses]) / (z1 - z0)[crosses]
    crossings = np.sort(r0[crosses] + share * (r1 - r0)[crosses]).tolist()
    pairs = zip(crossings[::2], crossings[1::2], strict=True)
    return [(near, far) for near, far in pairs if far > near]
