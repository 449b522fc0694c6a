"""From any joint angles to folded legs, past the ground and past each other."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
from jaxtyping import Float

from phasmid.control.sequences.path import JointPath, path_through
from phasmid.control.sequences.reaching import knees_and_feet
from phasmid.control.sequences.resting import Resting
from phasmid.control.sequences.settings import SequenceSettings
from phasmid.kinematics import link_frames
from phasmid.robot import Robot

LOOKS = 25
"""Places of a straight way in the joints at which it is looked at."""

VIAS = 13
"""Angles of femur and tibia each by way of which a leg may go."""

LEG_GAP = 0.02
"""Distance that the middle lines of two legs keep, unless they are closer to begin with [m]."""

GRAZE = 5e-4
"""Depth of a way below the ground that is not worth a way round [m]."""

Angles = Float[np.ndarray, "legs 3"]


def folding(
    robot: Robot,
    q: Angles,
    goal: Angles,
    ground: Resting,
    settings: SequenceSettings,
) -> tuple[JointPath, ...]:
    """Ways from any joint angles to those of folded legs.

    Straight where nothing is in the way. Otherwise each leg is drawn in with its coxa held, past
    the ground by way of two more poses, legs that cross one after the other, the free one first;
    then the coxae turn.

    Args:
        robot: The robot, L legs.
        q: Joint angles at present [rad], shape (L, 3).
        goal: Those of the folded legs [rad], shape (L, 3).
        ground: Where the ground is.
        settings: Speeds and accelerations.
    """
    if np.array_equal(q, goal):
        return ()
    if _depth(robot, ground, q, goal).max() <= GRAZE and _clear(robot, q, goal):
        return (_straight(robot, "folds its legs", q, goal, settings),)
    drawn = np.concatenate([q[:, :1], goal[:, 1:]], axis=1)
    ways: list[JointPath] = []
    for name, stops in (
        ("draws in its legs", [q, *_vias(robot, ground, q, drawn), drawn]),
        ("turns its legs to their places", [drawn, goal]),
    ):
        for legs in _groups(robot, stops):
            here = ways[-1].end if ways else q
            for stop in stops[1:]:
                there = here.copy()
                there[legs] = stop[legs]
                if not np.array_equal(here, there):
                    ways.append(_straight(robot, name, here, there, settings))
                here = there
    return tuple(ways)


def _straight(
    robot: Robot, name: str, q: Angles, goal: Angles, settings: SequenceSettings
) -> JointPath:
    return path_through(name, np.stack([q, goal]), settings.speed(robot), settings.acceleration)


def _between(q: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Angles along a straight way, its looks in front."""
    share = np.linspace(0.0, 1.0, LOOKS).reshape(-1, *(1,) * np.broadcast(q, goal).ndim)
    return q + share * (goal - q)


def _depth(robot: Robot, ground: Resting, *stops: np.ndarray) -> Float[np.ndarray, "*batch legs"]:
    """How far knees and feet dip below the ground on the way, and below both its ends [m].

    Args:
        robot: The robot, L legs.
        ground: Where the ground is.
        stops: Angles between which the way is straight [rad], each of shape (..., L, 3).
    """
    heights = []
    for q, goal in pairwise(stops):
        points = knees_and_feet(robot, _between(q, goal))
        heights.append(np.minimum(*(ground.over(p) for p in points)))
    ends = np.minimum(heights[0][0], heights[-1][-1])
    return np.minimum(0.0, ends) - np.min([height.min(axis=0) for height in heights], axis=0)


def _vias(robot: Robot, ground: Resting, q: Angles, goal: Angles) -> tuple[Angles, Angles]:
    """Two poses of each leg by way of which it goes deep into the ground least, and not far.

    Of the two one joint of femur and tibia moves first, or both at once; then the other follows.
    """
    limits = robot.arrays.joint_limits
    share = np.linspace(0.02, 0.98, VIAS)
    pairs = np.array(list(product(share, share)))
    second = np.repeat(q[None], len(pairs), axis=0)
    second[..., 1:] = limits[:, 1:, 0] + pairs[:, None] * (limits[:, 1:, 1] - limits[:, 1:, 0])
    firsts = [second]
    for joint in (1, 2):
        first = second.copy()
        first[..., joint] = q[:, joint]
        firsts.append(first)
    # The last of them is the straight way.
    first = np.concatenate([*firsts, goal[None]])
    second = np.concatenate([second, second, second, goal[None]])
    stops = (q, first, second, goal)
    depth = _depth(robot, ground, *stops)
    length = sum(np.abs(end - start).max(axis=-1) for start, end in pairwise(stops))
    cost = length + 1e4 * np.maximum(depth - GRAZE, 0.0)
    best = np.argmin(cost, axis=0)
    legs = np.arange(len(q))
    return first[best, legs], second[best, legs]


def _groups(robot: Robot, stops: list[Angles]) -> list[list[int]]:
    """Legs that go their ways together, group after group, so that none runs into another."""
    everyone = list(range(len(robot.legs)))
    if all(_clear(robot, a, b) for a, b in pairwise(stops)):
        return [everyone]
    groups, left, here = [], everyone, stops[0].copy()
    while left:
        spare = [_spare_of(robot, stops, here, [leg]) for leg in left]
        order = [left[i] for i in np.argsort(spare)[::-1]]
        # The freest leg goes in any case, with all those that stay clear of it and of the others.
        chosen = order[:1]
        for leg in order[1:]:
            if _spare_of(robot, stops, here, [*chosen, leg]) >= 0:
                chosen.append(leg)
        here[chosen] = stops[-1][chosen]
        groups.append(chosen)
        left = [leg for leg in left if leg not in chosen]
    return groups


def _spare_of(robot: Robot, stops: list[Angles], here: Angles, legs: list[int]) -> float:
    """What `_spare` says where some legs go by way of the stops and the others wait."""
    poses = []
    for stop in stops:
        pose = here.copy()
        pose[legs] = stop[legs]
        poses.append(pose)
    return min(_spare(robot, a, b) for a, b in pairwise(poses))


def _clear(robot: Robot, q: Angles, goal: Angles) -> bool:
    """Whether no two neighbouring legs come close on a straight way."""
    return _spare(robot, q, goal) >= 0


def _spare(robot: Robot, q: Angles, goal: Angles) -> float:
    """Least distance of neighbouring legs on a straight way, beyond what they keep [m]."""
    gap = leg_gaps(robot, _between(q, goal))
    needed = np.minimum(LEG_GAP, 0.95 * np.minimum(gap[0], gap[-1]))
    return float((gap - needed).min())


def leg_gaps(
    robot: Robot, q: Float[np.ndarray, "*batch legs 3"]
) -> Float[np.ndarray, "*batch pairs"]:
    """Distances of the middle lines of neighbouring legs, going round the body [m].

    Args:
        robot: The robot, L legs.
        q: Joint angles [rad], shape (..., L, 3).

    Returns:
        Of each leg and the next one round the body, coxae left out, shape (..., L).
    """
    frames = link_frames(robot, q)
    tips = np.array([[link.end for link in leg.links] for leg in robot.legs])
    ends = frames.position + (frames.rotation @ tips[..., None])[..., 0]
    hips = robot.arrays.p_body_hip
    order = np.argsort(np.arctan2(hips[:, 1], hips[:, 0]))
    start, end = frames.position[..., order, 1:, :], ends[..., order, 1:, :]
    other, beyond = np.roll(start, -1, axis=-3), np.roll(end, -1, axis=-3)
    distances = [
        _segment_distance(start[..., i, :], end[..., i, :], other[..., j, :], beyond[..., j, :])
        for i, j in product(range(2), repeat=2)
    ]
    return np.min(distances, axis=0)


def _segment_distance(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray
) -> Float[np.ndarray, "*batch"]:
    """Least distance of two straight pieces, a to b and c to d [m]."""
    u, v, w = b - a, d - c, a - c
    uu, uv, vv = (np.sum(p * r, axis=-1) for p, r in ((u, u), (u, v), (v, v)))
    uw, vw = np.sum(u * w, axis=-1), np.sum(v * w, axis=-1)
    # The nearest point of the first line, clipped; then that of the second to it; then back.
    across = uu * vv - uv * uv
    s = np.clip((uv * vw - vv * uw) / np.where(across > 0, across, 1.0), 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    away = w + s[..., None] * u - t[..., None] * v
    return np.asarray(np.linalg.norm(away, axis=-1))
