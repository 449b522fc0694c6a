"""Moves of a robot that stands: its body over planted feet, and feet that step."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.control.sequences.joint_path import JointPath, path_through
from phasmid.control.sequences.reaching import angles_and_reach, knees_and_feet
from phasmid.control.sequences.resting import Resting
from phasmid.control.sequences.settings import SequenceSettings
from phasmid.gait.support import support_margin
from phasmid.kinematics import centre_of_mass, neutral_feet, rotation_rpy
from phasmid.robot import Robot

KNOTS = 41
"""Poses along a move through which the joints' way is laid."""

SHIFTS = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
"""Shares of the way to the best-held place by which the body is moved before legs lift."""

SAME = 1e-9
"""Feet nearer to their places than this are there [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Stance:
    """A robot that stands, seen from the ground under it, whose z is up.

    Attributes:
        pose: Of the body: position [m], then roll, pitch and yaw [rad], shape (6,).
        feet: Feet on the ground [m], shape (L, 3).
        q: Joint angles [rad], shape (L, 3).
    """

    pose: Float[np.ndarray, "6"]
    feet: Float[np.ndarray, "legs 3"]
    q: Float[np.ndarray, "legs 3"]


def neutral_stance(robot: Robot) -> Stance:
    """The robot at rest on its neutral feet, its body's origin above the ground's.

    Args:
        robot: The robot, L legs.
    """
    feet = neutral_feet(robot)
    height = -float(feet[:, 2].mean())
    q, _ = angles_and_reach(robot, feet)
    return Stance(
        np.array([0.0, 0.0, height, 0.0, 0.0, 0.0]), feet + np.array([0.0, 0.0, height]), q
    )


def stance_on(robot: Robot, q: Float[np.ndarray, "legs 3"], ground: Resting) -> Stance:
    """How a robot stands on the ground that it rests on.

    Args:
        robot: The robot, L legs.
        q: Joint angles [rad], shape (L, 3).
        ground: On what it rests.
    """
    n = ground.normal
    roll, pitch = math.atan2(n[1], n[2]), -math.asin(float(np.clip(n[0], -1.0, 1.0)))
    pose = np.array([0.0, 0.0, ground.height, roll, pitch, 0.0])
    R = rotation_rpy(*pose[3:, None])[0]
    _, feet = knees_and_feet(robot, q)
    return Stance(pose, feet @ R.T + pose[:3], q)


class Stepper:
    """Plans moves of a standing robot, one after the other.

    Attributes:
        stance: Where the moves so far lead.
        paths: The moves.
    """

    def __init__(
        self,
        robot: Robot,
        stance: Stance,
        settings: SequenceSettings,
        *,
        lifted: Collection[int] = (),
    ) -> None:
        self.robot, self.stance, self.settings = robot, stance, settings
        self.paths: list[JointPath] = []
        self._lifted = list(lifted)

    def margin(
        self,
        pose: Float[np.ndarray, "*#batch 6"],
        q: Float[np.ndarray, "*#batch legs 3"],
        up: Iterable[int],
    ) -> Float[np.ndarray, "*batch"]:
        """Distance of the centre of mass from the edge of the support of all legs but some [m].

        Args:
            pose: Of the body, shape (..., 6).
            q: Joint angles [rad], shape (..., L, 3).
            up: Indices of legs that do not stand, beside those that never do.
        """
        standing = np.ones(len(self.robot.legs), dtype=bool)
        standing[[*up, *self._lifted]] = False
        com = centre_of_mass(self.robot, q)
        R = rotation_rpy(pose[..., 3], pose[..., 4], pose[..., 5])
        place = (R @ com[..., None])[..., :2, 0] + pose[..., :2]
        feet = np.broadcast_to(self.stance.feet[:, :2], (*place.shape[:-1], *standing.shape, 2))
        return support_margin(feet, np.broadcast_to(standing, feet.shape[:-1]), place)

    def angles(
        self, pose: Float[np.ndarray, "*#batch 6"], feet: Float[np.ndarray, "*#batch legs 3"]
    ) -> Float[np.ndarray, "*#batch legs 3"] | None:
        """Joint angles for a pose of the body and feet on the ground; None where out of reach."""
        R = rotation_rpy(pose[..., 3], pose[..., 4], pose[..., 5])
        p_body = (feet - pose[..., None, :3]) @ R
        q, reached = angles_and_reach(self.robot, p_body)
        reached[..., self._lifted] = True
        if not reached.all():
            return None
        q[..., self._lifted, :] = self.stance.q[self._lifted]
        return q

    def body(self, pose: Float[np.ndarray, "6"], name: str, *, up: Iterable[int] = ()) -> bool:
        """Move the body over planted feet.

        Args:
            pose: Where it goes.
            name: What the robot does.
            up: Legs that do not stand meanwhile.

        Returns:
            Whether that can be done; nothing is planned where it cannot.
        """
        start = self.stance
        if np.array_equal(pose, start.pose):
            return True
        way = start.pose + np.linspace(0.0, 1.0, KNOTS)[:, None] * (pose - start.pose)
        feet = np.repeat(start.feet[None], KNOTS, axis=0)
        q = self.angles(way, feet)
        if q is None or self.margin(way, q, up).min() < min(0.0, self.held(up)):
            return False
        # Where the joints are at present, which differs by round-off.
        q[0] = start.q
        self._add(name, q, loaded=True)
        self.stance = Stance(pose, start.feet, q[-1])
        return True

    def held(self, up: Iterable[int] = ()) -> float:
        """The margin at present [m], were some legs not there."""
        return float(self.margin(self.stance.pose, self.stance.q, up))

    def step(self, legs: list[int], places: Float[np.ndarray, "legs 3"], name: str) -> bool:
        """Move some feet to their places, the body as far aside before as that needs.

        Args:
            legs: Their indices.
            places: Places of all feet on the ground [m], shape (L, 3).
            name: What the robot does.

        Returns:
            Whether that can be done; nothing is planned where it cannot.
        """
        start = self.stance
        goal = start.feet.copy()
        goal[legs] = places[legs]
        s = np.linspace(0.0, 1.0, KNOTS)[:, None, None]
        feet = start.feet + s * s * (3 - 2 * s) * (goal - start.feet)
        # Without slope at both ends, so that feet lift and land upright.
        feet[:, legs, 2] += 16 * self.settings.step_height * (s * s * (1 - s) ** 2)[:, 0]
        for pose in self.shifts(legs):
            q = self.angles(np.repeat(pose[None], KNOTS, axis=0), feet)
            if q is None:
                continue
            if self.margin(pose[None], q, legs).min() < self.settings.support_margin:
                continue
            before = len(self.paths)
            if not self.body(pose, "shifts its weight"):
                del self.paths[before:]
                continue
            q[0] = self.stance.q
            self._add(name, q, loaded=False)
            self.stance = Stance(pose, goal, q[-1])
            return True
        return False

    def shifts(self, legs: list[int]) -> list[Float[np.ndarray, "6"]]:
        """Poses of the body from the present one to where the others than some legs hold it best.

        Args:
            legs: Indices of the legs that lift.
        """
        start = self.stance
        standing = np.ones(len(self.robot.legs), dtype=bool)
        standing[[*legs, *self._lifted]] = False
        if standing.sum() < 3:
            return []
        com = centre_of_mass(self.robot, start.q)
        here = (rotation_rpy(*start.pose[3:, None])[0] @ com)[:2] + start.pose[:2]
        best = _deepest(start.feet[:, :2], standing, here)
        poses = np.repeat(start.pose[None], len(SHIFTS), axis=0)
        poses[:, :2] += SHIFTS[:, None] * (best - here)
        return list(poses)

    def _add(self, name: str, q: Float[np.ndarray, "knots legs 3"], *, loaded: bool) -> None:
        speed = self.settings.speed(self.robot, loaded=loaded)
        self.paths.append(path_through(name, q, speed, self.settings.acceleration))


def _deepest(
    feet: Float[np.ndarray, "legs 2"], standing: np.ndarray, here: Float[np.ndarray, "2"]
) -> Float[np.ndarray, "2"]:
    """The place in the polygon of standing feet that is farthest from its edges.

    Of a grid about it; of places equally good the one nearest to the present one.
    """
    held = feet[standing]
    low, high = held.min(axis=0), held.max(axis=0)
    best = np.clip(here, low, high)
    size = float((high - low).max())
    for width in (size, size / 8, size / 64):
        line = np.linspace(-width, width, 17)
        grid = best + np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        many = np.broadcast_to(feet, (len(grid), *feet.shape))
        depth = support_margin(many, np.broadcast_to(standing, many.shape[:2]), grid)
        best = grid[int(np.argmax(depth - 1e-6 * np.linalg.norm(grid - here, axis=1)))]
    return np.asarray(best)


def to_neutral(
    robot: Robot,
    stance: Stance,
    settings: SequenceSettings,
    *,
    air: Collection[int] = (),
    lost: Collection[int] = (),
) -> Stepper | None:
    """Moves from standing anyhow to the neutral stance: body above its feet, then foot by foot.

    Args:
        robot: The robot, L legs.
        stance: How it stands; feet in the air are where they are.
        settings: Margins, speeds, heights.
        air: Indices of legs whose feet are in the air.
        lost: Indices of legs that stay as they are, in the air.

    Returns:
        The moves; None where there is no safe way.
    """
    plan = Stepper(robot, stance, settings, lifted=lost)
    home = neutral_stance(robot)
    # Upright above where the body is; the ground's frame is the robot's own.
    goal = home.pose.copy()
    goal[:2] = stance.pose[:2]
    goal[5] = stance.pose[5]
    c, s = np.cos(goal[5]), np.sin(goal[5])
    places = home.feet @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    places[:, :2] += goal[:2]
    waiting = sorted(set(air) - set(lost))
    if waiting and not plan.step(waiting, places, "puts down its feet"):
        return None
    plan.body(goal, "rises")
    legs, returned = len(robot.legs), True
    while True:
        away = np.linalg.norm(plan.stance.feet - places, axis=1)
        away[list(lost)] = 0.0
        left = [int(i) for i in np.argsort(-away) if away[i] > SAME]
        if not left:
            return plan if plan.body(goal, "rises") else None
        # Every second leg at once where the others hold the robot, else one at a time.
        groups = [[i for i in left if i % 2 == k] for k in (0, 1)] if legs >= 6 else []
        groups = [group for group in groups if len(group) > 1] + [[i] for i in left]
        if any(plan.step(sorted(group), places, "steps to its places") for group in groups):
            returned = False
        elif returned or not plan.body(goal, "rises"):
            return None
        else:
            returned = True
