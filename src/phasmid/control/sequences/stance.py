"""Motions of a standing robot: its body over planted feet, and steps of some feet."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.control.sequences.ground import GroundPlane, knees_and_feet, solve_feet
from phasmid.control.sequences.joint_path import JointPath
from phasmid.gait.support import support_margin
from phasmid.kinematics import body_height, centre_of_mass, neutral_feet, rotation_rpy
from phasmid.robot import Robot

SAMPLES = np.linspace(0.0, 1.0, 41)[:, None, None]
"""Path parameter of the poses of a motion, shaped to scale feet (L, 3)."""

SMOOTH = SAMPLES**2 * (3 - 2 * SAMPLES)
"""Cubic from 0 to 1 at `SAMPLES`, with zero slope at both ends."""

ARC = 16 * SAMPLES**2 * (1 - SAMPLES) ** 2
"""Quartic from 0 up to 1 and back at `SAMPLES`, with zero slope at both ends."""

STEP_HEIGHT = 0.030
"""Height to which a foot lifts for a step [m]."""

SUPPORT_MARGIN = 0.012
"""Least support margin while legs are in the air [m]."""

SHIFTS = np.linspace(0.0, 1.0, 6)[:, None]
"""Shifts of the body to try before legs lift, relative to that of the best support."""

ARRIVED = 1e-9
"""Feet nearer to their places than this need no step [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Stance:
    """A standing robot in the axes of level ground, z up.

    Attributes:
        pose: Body position [m], then roll, pitch and yaw [rad], shape (6,).
        feet: Feet [m], shape (L, 3).
        q: Joint angles [rad], shape (L, 3).
    """

    pose: Float[np.ndarray, "6"]
    feet: Float[np.ndarray, "legs 3"]
    q: Float[np.ndarray, "legs 3"]


def neutral_stance(robot: Robot) -> Stance:
    """Return the robot on its neutral feet, its body above the origin."""
    feet = neutral_feet(robot)
    pose = np.array([0.0, 0.0, body_height(robot), 0.0, 0.0, 0.0])
    return Stance(pose, feet + pose[:3], solve_feet(robot, feet)[0])


def stance_on(robot: Robot, q: Float[np.ndarray, "legs 3"], ground: GroundPlane) -> Stance:
    """Return the stance of joint angles [rad], shape (L, 3), on a ground plane."""
    n = ground.normal
    roll, pitch = math.atan2(n[1], n[2]), -math.asin(float(np.clip(n[0], -1.0, 1.0)))
    pose = np.array([0.0, 0.0, ground.body_height, roll, pitch, 0.0])
    R = rotation_rpy(*pose[3:, None])[0]
    return Stance(pose, knees_and_feet(robot, q)[1] @ R.T + pose[:3], q)


class StancePlanner:
    """Plans motions of a standing robot, one after another.

    Args:
        robot: The robot, L legs.
        stance: Where it begins.
        lost: Indices of legs that stay in the air at their present angles.

    Attributes:
        stance: Stance after the motions planned so far.
        paths: These motions.
    """

    def __init__(
        self,
        robot: Robot,
        stance: Stance,
        lost: Collection[int] = (),
    ) -> None:
        self.robot, self.stance = robot, stance
        self.paths: list[JointPath] = []
        self._lost = list(lost)

    def margin(
        self,
        pose: Float[np.ndarray, "*#batch 6"],
        q: Float[np.ndarray, "*#batch legs 3"],
        lifted: Collection[int] = (),
    ) -> Float[np.ndarray, "*batch"]:
        """Return support margins over the present feet without lifted and lost ones [m]."""
        feet = self.stance.feet[self._standing(lifted), :2]
        return margin_at(feet, self._centre_of_mass(pose, q))

    @property
    def present_margin(self) -> float:
        """Support margin of `stance` [m]."""
        return float(self.margin(self.stance.pose, self.stance.q))

    def move_body(self, pose: Float[np.ndarray, "6"]) -> bool:
        """Plan a straight motion of the body over planted feet; return whether it is feasible."""
        start = self.stance
        if np.array_equal(pose, start.pose):
            return True
        poses = start.pose + SAMPLES[:, 0] * (pose - start.pose)
        q = self._solve(poses, start.feet)
        if q is None or self.margin(poses, q).min() < min(0.0, self.present_margin):
            return False
        self._add(pose, start.feet, q, loaded=True)
        return True

    def step(self, legs: list[int], places: Float[np.ndarray, "legs 3"]) -> bool:
        """Plan a step of some feet to their places [m]; return whether it is feasible."""
        goal = self.stance.feet.copy()
        goal[legs] = places[legs]
        feet = self.stance.feet + SMOOTH * (goal - self.stance.feet)
        feet[:, legs, 2] += STEP_HEIGHT * ARC[:, 0]
        return self.swing(legs, feet)

    def swing(
        self, legs: list[int], feet: Float[np.ndarray, "samples legs 3"], *, stretched: bool = False
    ) -> bool:
        """Plan to move some feet through the air; return whether it is feasible.

        The body shifts before, as little as the support margin needs. It may have to hold with
        these legs stretched outwards, too.
        """
        for pose in self._shifts(legs):
            q = self._solve(pose, feet)
            if q is None:
                continue
            poses = q
            if stretched:
                poses = np.concatenate([q, q[-1:]])
                poses[-1, legs, 1:] = 0.0
            margin = self.margin(pose, poses, legs).min()
            if margin >= SUPPORT_MARGIN and self.move_body(pose):
                self._add(pose, feet[-1], q)
                return True
        return False

    def _shifts(self, legs: list[int]) -> list[Float[np.ndarray, "6"]]:
        """Return body poses from the present one to that of the best support without legs."""
        pose, standing = self.stance.pose, self._standing(legs)
        if standing.sum() < 3:
            return []
        com = self._centre_of_mass(pose, self.stance.q)
        poses = np.repeat(pose[None], len(SHIFTS), axis=0)
        poses[:, :2] += SHIFTS * (best_support(self.stance.feet[standing, :2], com) - com)
        return list(poses)

    def _standing(self, lifted: Collection[int]) -> np.ndarray:
        standing = np.ones(len(self.robot.legs), dtype=bool)
        standing[[*lifted, *self._lost]] = False
        return standing

    def _centre_of_mass(self, pose: np.ndarray, q: np.ndarray) -> Float[np.ndarray, "*batch 2"]:
        R = rotation_rpy(pose[..., 3], pose[..., 4], pose[..., 5])
        com = centre_of_mass(self.robot, q)
        return (R @ com[..., None])[..., :2, 0] + pose[..., :2]

    def _solve(
        self, pose: np.ndarray, feet: np.ndarray
    ) -> Float[np.ndarray, "batch legs 3"] | None:
        """Return joint angles for body poses and feet; None where a foot is out of reach."""
        R = rotation_rpy(pose[..., 3], pose[..., 4], pose[..., 5])
        q, reached = solve_feet(self.robot, (feet - pose[..., None, :3]) @ R)
        reached[..., self._lost] = True
        q[..., self._lost, :] = self.stance.q[self._lost]
        return q if reached.all() else None

    def _add(
        self, pose: np.ndarray, feet: np.ndarray, q: np.ndarray, *, loaded: bool = False
    ) -> None:
        # The present angles differ from the solution by round-off.
        q[0] = self.stance.q
        self.paths.append(JointPath.through(q, self.robot, loaded=loaded))
        self.stance = Stance(pose, feet, q[-1])


def best_support(
    feet: Float[np.ndarray, "feet 2"], start: Float[np.ndarray, "2"]
) -> Float[np.ndarray, "2"]:
    """Return the point of the largest margin in a support polygon, by three nested grids.

    Of several such points it is the one nearest to a start [m].
    """
    low, high = feet.min(axis=0), feet.max(axis=0)
    best, size = np.clip(start, low, high), float((high - low).max())
    for width in (size, size / 8, size / 64):
        line = np.linspace(-width, width, 17)
        grid = best + np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        nearness = -np.linalg.norm(grid - start, axis=1)
        best = grid[int(np.argmax(margin_at(feet, grid) + 1e-6 * nearness))]
    return np.asarray(best)


def margin_at(
    feet: Float[np.ndarray, "feet 2"], points: Float[np.ndarray, "*batch 2"]
) -> Float[np.ndarray, "*batch"]:
    """Return margins of points in the support polygon of feet [m], shape (...)."""
    feet = np.broadcast_to(feet, (*points.shape[:-1], *feet.shape))
    return support_margin(feet, np.ones(feet.shape[:-1], dtype=bool), points)


def to_neutral(
    robot: Robot,
    stance: Stance,
    *,
    lifted: Collection[int] = (),
    lost: Collection[int] = (),
) -> StancePlanner | None:
    """Plan motions to the neutral stance: raise the body, then step foot by foot.

    Feet of lifted legs are put down, lost legs stay in the air. None if it is infeasible.
    """
    plan, neutral = StancePlanner(robot, stance, lost), neutral_stance(robot)
    # Upright above the present place of the body.
    goal = neutral.pose.copy()
    goal[:2] = stance.pose[:2]
    places = neutral.feet.copy()
    places[:, :2] += goal[:2]
    airborne = sorted(set(lifted) - set(lost))
    if airborne and not plan.step(airborne, places):
        return None
    plan.move_body(goal)
    body_is_back = True
    while True:
        distance = np.linalg.norm(plan.stance.feet - places, axis=1)
        distance[list(lost)] = 0.0
        legs = [int(i) for i in np.argsort(-distance) if distance[i] > ARRIVED]
        if not legs:
            return plan if plan.move_body(goal) else None
        # Every second leg at once where the others hold six or more legs, else one by one.
        tripods = [sorted(leg for leg in legs if leg % 2 == side) for side in (0, 1)]
        groups = [group for group in tripods if len(group) > 1 and len(robot.legs) >= 6]
        if any(plan.step(group, places) for group in [*groups, *([leg] for leg in legs)]):
            body_is_back = False
        elif body_is_back or not plan.move_body(goal):
            return None
        else:
            body_is_back = True
