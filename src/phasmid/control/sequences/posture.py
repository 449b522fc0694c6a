"""Paths between standing and lying: get up, and fold the legs from any joint angles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from jaxtyping import Float

from phasmid.control.sequences.ground import (
    GroundPlane,
    belly_ground,
    knees_and_feet,
    knees_and_soles,
    solve_feet,
)
from phasmid.control.sequences.joint_path import JointPath
from phasmid.control.sequences.stance import (
    ARC,
    SAMPLES,
    SMOOTH,
    Stance,
    StancePlanner,
    neutral_stance,
    to_neutral,
)
from phasmid.errors import InfeasibleWalk
from phasmid.kinematics import link_frames, neutral_feet
from phasmid.robot import Robot

FOLD_ANGLES = 61
"""Femur and tibia angles each, among which the folded pose is searched."""

PLACES = np.concatenate([[1.0], *([1 + d, 1 - d] for d in np.arange(0.05, 0.65, 0.05))])
"""Distances of a foot from its hip to try for getting up, relative to the neutral one."""

RISE = np.linspace(0.0, 1.0, 25)[:, None]
"""Heights between lying and standing at which a foot must be within reach."""

UP = np.array([0.0, 0.0, 1.0])
"""Normal of the ground under a robot that lies flat, in body axes."""

CLEARANCE = 0.010
"""Height of feet and knees over the ground on their paths [m]."""

LIMIT_MARGIN, KNEE_FOLD = np.radians([2, 35])
"""Distance of resting poses from the joint limits, and least angle of a folded knee [rad]."""

LIFTS = 0.0, 1.0, 2.0, 4.0
"""Heights of the arc to try when feet are put down, relative to the clearance."""

LINE = 25
"""Samples of a straight line in joint space."""

VIA_ANGLES = np.linspace(0.02, 0.98, 13)
"""Femur and tibia angles to try for poses in between, relative to their ranges."""

LEG_GAP = 0.02
"""Distance to keep between centre lines of two legs that are not closer at the ends [m]."""

GRAZE = 5e-4
"""Depth below the ground that is accepted on a path [m]."""

Angles = Float[np.ndarray, "legs 3"]


@dataclass(frozen=True, slots=True, eq=False)
class Packing:
    """Pose of a robot on its belly, and places of its feet for getting up.

    Attributes:
        folded: Joint angles of the folded legs [rad], shape (L, 3).
        feet: Places of the feet beside the lying body, body frame [m], shape (L, 3).
    """

    folded: Angles
    feet: Float[np.ndarray, "legs 3"]


def packing(robot: Robot) -> Packing:
    """Search the pose in which a robot lies: legs folded closely, clear of the ground.

    Raises:
        InfeasibleWalk: A leg cannot be folded beside the lying body, or cannot lift it.
    """
    standing, hips = neutral_feet(robot), robot.arrays.p_body_hip
    lowest = robot.foot_radius - belly_ground(robot).body_height
    feet = standing.copy()
    feet[:, 2] = lowest
    missing = np.ones(len(robot.legs), dtype=bool)
    for place in PLACES:
        p = np.repeat(feet[None], len(RISE), axis=0)
        p[..., :2] = hips[:, :2] + place * (standing - hips)[:, :2]
        p[..., 2] = lowest + RISE * (standing[:, 2] - lowest)
        reached = solve_feet(robot, p, LIMIT_MARGIN / 2)[1].all(axis=0)
        feet[missing & reached] = p[0, missing & reached]
        missing &= ~reached
    if missing.any():
        name = robot.leg_names[int(np.argmax(missing))]
        raise InfeasibleWalk(
            f"leg {name} cannot lift the body from its belly: no place beside its hip is within "
            "reach and joint limits all the way up.",
            where="robot",
        )
    return Packing(_folded(robot), feet)


def resting_limits(robot: Robot) -> tuple[Angles, Angles]:
    """Return lowest and highest joint angles of resting poses [rad], each of shape (L, 3)."""
    limits = robot.arrays.joint_limits
    return limits[..., 0] + LIMIT_MARGIN, limits[..., 1] - LIMIT_MARGIN


def leg_poses(
    robot: Robot, low: Angles, high: Angles, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return poses of all legs on a grid of femur and tibia angles, the coxa near neutral.

    Returns:
        Joint angles [rad], shape (count, count, L, 3); knees and lowest points of the feet in the
        body frame [m], shape (2, count, count, L, 3); and the extent of each pose, as seen from
        above, with a part of its height [m], shape (count, count, L).
    """
    femur, tibia = (np.linspace(low[:, i], high[:, i], count) for i in (1, 2))
    q = np.empty((count, count, len(robot.legs), 3))
    q[..., 0] = np.clip(0.0, low[:, 0], high[:, 0])
    q[..., 1], q[..., 2] = femur[:, None], tibia
    points = np.stack(knees_and_soles(robot, q, UP))
    distance = hip_distance(robot, points).max(axis=0)
    return q, points, distance + 0.5 * points[1, ..., 2] + 0.25 * points[0, ..., 2]


def _folded(robot: Robot) -> Angles:
    """Search the most compact pose of each leg that is clear of ground, trunk and itself."""
    q, points, extent = leg_poses(robot, *resting_limits(robot), FOLD_ANGLES)
    allowed = (belly_ground(robot).height(points) >= CLEARANCE).all(axis=0)
    allowed &= np.abs(q[..., 2]) <= np.pi - KNEE_FOLD
    allowed &= hip_distance(robot, points[1]) >= robot.arrays.lengths[:, 0]
    legs = len(robot.legs)
    cost = np.where(allowed, extent, np.inf).reshape(-1, legs)
    impossible = np.isinf(cost.min(axis=0))
    if impossible.any():
        name = robot.leg_names[int(np.argmax(impossible))]
        raise InfeasibleWalk(
            f"leg {name} cannot be folded: at all its angles knee or foot is in the ground on "
            "which the trunk lies, or in the trunk.",
            where="robot",
        )
    return q.reshape(-1, legs, 3)[np.argmin(cost, axis=0), np.arange(legs)]


def hip_distance(
    robot: Robot, p_body: Float[np.ndarray, "*batch legs 3"]
) -> Float[np.ndarray, "*batch legs"]:
    """Return horizontal distances of points of the legs from their hips [m]."""
    return np.asarray(np.linalg.norm((p_body - robot.arrays.p_body_hip)[..., :2], axis=-1))


def get_up(
    robot: Robot,
    packed: Packing,
    lost: Mapping[int, Float[np.ndarray, "3"]],
) -> list[JointPath]:
    """Plan paths from folded legs on the belly to the neutral stance; lying down reverses them.

    The feet are put down beside the body, the body rises over them, and the feet step to their
    neutral places. Lost legs stay at their joint angles [rad], given by index.

    Raises:
        InfeasibleWalk: The other legs cannot carry the body there.
    """
    if len(lost) == len(robot.legs):
        raise InfeasibleWalk("no leg is left that could raise the body.", where="robot")
    down = _put_down(robot, packed)
    for leg, q in lost.items():
        down[:, leg] = q
    pose = np.array([0.0, 0.0, -float(robot.body.box[0, 2]), 0.0, 0.0, 0.0])
    feet = packed.feet + pose[:3]
    plan = StancePlanner(robot, Stance(pose, feet, down[-1]), lost)
    if not plan.move_body(neutral_stance(robot).pose) or plan.present_margin < 0:
        raise InfeasibleWalk("the legs that are left cannot raise the body.", where="robot")
    rest = to_neutral(robot, plan.stance, lost=lost)
    if rest is None:
        raise InfeasibleWalk("the feet cannot step to their neutral places.", where="robot")
    return [JointPath.through(down, robot), *plan.paths, *rest.paths]


def _put_down(robot: Robot, packed: Packing) -> np.ndarray:
    """Return poses that put the feet down beside the body: over the ground, then straight down."""
    start = knees_and_feet(robot, packed.folded)[1]
    goal = solve_feet(robot, packed.feet)[0]
    best, least = packed.folded + SAMPLES * (goal - packed.folded), np.inf
    for lift in LIFTS:
        feet = start + SMOOTH * (packed.feet - start)
        feet[..., 2] = (packed.feet + SMOOTH[::-1] * (start - packed.feet))[..., 2]
        feet[..., 2] += lift * CLEARANCE * ARC[..., 0]
        q, reached = solve_feet(robot, feet)
        if not reached.all():
            continue
        depth = -float(belly_ground(robot).height(np.stack(knees_and_soles(robot, q, UP))).min())
        if depth < least - 1e-9:
            best, least = q, depth
    best[0], best[-1] = packed.folded, goal
    return best


def fold_legs(robot: Robot, q: Angles, goal: Angles, ground: GroundPlane) -> list[JointPath]:
    """Plan paths from any joint angles to folded legs, past the ground and past each other.

    All joints move straight where nothing is in the way. Otherwise each leg is drawn in with its
    coxa held, by way of two poses that clear the ground; then the coxae turn. Legs that would
    collide move one after another, the freest first.
    """
    if np.array_equal(q, goal):
        return []
    if _depth(robot, ground, q, goal).max() <= GRAZE and _leg_clearance(robot, [q, goal]) >= 0:
        return [JointPath.through([q, goal], robot)]
    drawn = np.concatenate([q[:, :1], goal[:, 1:]], axis=1)
    paths, here = [], q
    for poses in ([q, *_vias(robot, ground, q, drawn), drawn], [drawn, goal]):
        for legs in _groups(robot, poses):
            for pose in poses[1:]:
                there = _with_legs(here, legs, pose)
                if not np.array_equal(here, there):
                    paths.append(JointPath.through([here, there], robot))
                here = there
    return paths


def _with_legs(q: Angles, legs: list[int], pose: Angles) -> Angles:
    """Return joint angles with some legs taken from another pose."""
    changed = q.copy()
    changed[legs] = pose[legs]
    return changed


def _line(q: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Return poses along a straight line in joint space, samples first."""
    s = np.linspace(0.0, 1.0, LINE).reshape(-1, *(1,) * np.broadcast(q, goal).ndim)
    return q + s * (goal - q)


def _depth(
    robot: Robot, ground: GroundPlane, *poses: np.ndarray
) -> Float[np.ndarray, "*batch legs"]:
    """Return how deep knees and feet dip below ground and ends of straight lines of poses [m]."""
    heights = [
        np.minimum(*map(ground.height, knees_and_soles(robot, _line(q, goal), ground.normal)))
        for q, goal in pairwise(poses)
    ]
    ends = np.minimum(heights[0][0], heights[-1][-1])
    return np.minimum(0.0, ends) - np.min([height.min(axis=0) for height in heights], axis=0)


def _vias(robot: Robot, ground: GroundPlane, q: Angles, goal: Angles) -> tuple[Angles, Angles]:
    """Return the two poses of each leg by way of which its path is short and clears the ground.

    Femur and tibia move to the second pose both at once, or one after the other.
    """
    low, high = np.moveaxis(robot.arrays.joint_limits[:, 1:], -1, 0)
    pairs = np.array(list(product(VIA_ANGLES, VIA_ANGLES)))
    both = np.repeat(q[None], len(pairs), axis=0)
    both[..., 1:] = low + pairs[:, None] * (high - low)
    tibia_first, femur_first = both.copy(), both.copy()
    tibia_first[..., 1], femur_first[..., 2] = q[:, 1], q[:, 2]
    # The last one is the straight path.
    first = np.concatenate([both, tibia_first, femur_first, goal[None]])
    second = np.concatenate([both, both, both, goal[None]])
    poses = q, first, second, goal
    length = sum(np.abs(end - start).max(axis=-1) for start, end in pairwise(poses))
    cost = length + 1e4 * np.maximum(_depth(robot, ground, *poses) - GRAZE, 0.0)
    best, legs = np.argmin(cost, axis=0), np.arange(len(q))
    return first[best, legs], second[best, legs]


def _groups(robot: Robot, poses: Sequence[Angles]) -> list[list[int]]:
    """Return groups of legs that follow the poses together, so that no legs collide."""
    left, here = list(range(len(robot.legs))), poses[0]

    def clearance(legs: list[int]) -> float:
        return _leg_clearance(robot, [_with_legs(here, legs, pose) for pose in poses])

    if clearance(left) >= 0:
        return [left]
    groups = []
    while left:
        freest = [left[i] for i in np.argsort([clearance([leg]) for leg in left])[::-1]]
        # The freest leg moves in any case.
        group = freest[:1]
        for leg in freest[1:]:
            if clearance([*group, leg]) >= 0:
                group.append(leg)
        here = _with_legs(here, group, poses[-1])
        groups.append(group)
        left = [leg for leg in left if leg not in group]
    return groups


def _leg_clearance(robot: Robot, poses: Sequence[Angles]) -> float:
    """Return the least distance of neighbouring legs along poses, less the gap to keep [m]."""
    gaps = [leg_gaps(robot, _line(q, goal)) for q, goal in pairwise(poses)]
    return min(
        float((gap - np.minimum(LEG_GAP, 0.95 * np.minimum(gap[0], gap[-1]))).min()) for gap in gaps
    )


def leg_gaps(
    robot: Robot, q: Float[np.ndarray, "*batch legs 3"]
) -> Float[np.ndarray, "*batch pairs"]:
    """Return distances between centre lines of neighbouring legs, in order around the body [m].

    Only femur and tibia count.
    """
    frames = link_frames(robot, q)
    tips = np.array([[link.end for link in leg.links] for leg in robot.legs])
    ends = frames.position + (frames.rotation @ tips[..., None])[..., 0]
    hips = robot.arrays.p_body_hip
    order = np.argsort(np.arctan2(hips[:, 1], hips[:, 0]))
    a, b = frames.position[..., order, 1:, :], ends[..., order, 1:, :]
    c, d = np.roll(a, -1, axis=-3), np.roll(b, -1, axis=-3)
    distances = [
        _segment_distance(a[..., i, :], b[..., i, :], c[..., j, :], d[..., j, :])
        for i, j in product(range(2), repeat=2)
    ]
    return np.min(distances, axis=0)


def _segment_distance(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray
) -> Float[np.ndarray, "*batch"]:
    """Return the least distance of two line segments, a to b and c to d [m]."""
    u, v, w = b - a, d - c, a - c
    uu, uv, vv, uw, vw = (
        np.sum(p * r, axis=-1) for p, r in ((u, u), (u, v), (v, v), (u, w), (v, w))
    )
    # The nearest point of the first line, clipped; that of the second to it; then back.
    determinant = uu * vv - uv * uv
    s = (uv * vw - vv * uw) / np.where(determinant > 0, determinant, 1.0)
    t = np.clip((uv * np.clip(s, 0.0, 1.0) + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    return np.asarray(np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1))
