"""Legs moved by hand while the others stand."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from phasmid.control.command import LegCommand
from phasmid.control.sequences.joint_path import JointMotion, JointPath, path_through
from phasmid.control.sequences.reaching import angles_and_reach, knees_and_feet
from phasmid.control.sequences.settings import SequenceSettings
from phasmid.control.sequences.stance import KNOTS, Stance, Stepper
from phasmid.kinematics import rotation_rpy
from phasmid.robot import Robot

PEAK = 4 * math.exp(-2)
"""Largest acceleration that the follower gives a target of unit speed, per its pole [1]."""

FULL_SPEED = 0.98
"""Share of its speed that the follower's target goes; the rest is for its finite steps."""

ARRIVED = 1e-7
"""A follower nearer to its target than this is there [rad]."""


class SetpointFilter:
    """Joints that follow targets within their speed and acceleration, twice differentiable.

    The target moves on towards what is asked at the largest speed at most, all joints of a leg in
    step, and goes through three equal low-passes: their answer to a step rises without
    overshooting, so speed and range of what comes out are no larger than of what goes in, and
    their pole bounds the acceleration.

    Attributes:
        motion: Where the joints are.
    """

    def __init__(self, motion: JointMotion, speed: float, acceleration: float) -> None:
        self.motion = motion
        self._target = motion.position.copy()
        self._speed = FULL_SPEED * speed
        self._pole = acceleration / (PEAK * speed)

    def follow(self, asked: Float[np.ndarray, "legs 3"], dt: float) -> JointMotion:
        """Go on for some time.

        Args:
            asked: Where the joints shall be [rad], shape (L, 3).
            dt: Time [s].
        """
        way = asked - self._target
        farthest = np.abs(way).max(axis=1, keepdims=True)
        step = self._speed * dt
        self._target = self._target + way * np.where(
            farthest > step, step / np.maximum(farthest, step), 1.0
        )
        w, m = self._pole, self.motion
        e, v, a = m.position - self._target, m.velocity, m.acceleration
        c1, c2 = v + w * e, (a + 2 * w * v + w * w * e) / 2
        fade = math.exp(-w * dt)
        p0, p1, p2 = e + dt * (c1 + dt * c2), c1 + 2 * dt * c2, 2 * c2
        self.motion = JointMotion(
            self._target + fade * p0,
            fade * (p1 - w * p0),
            fade * (p2 - 2 * w * p1 + w * w * p0),
        )
        return self.motion

    def arrived(self, asked: Float[np.ndarray, "legs 3"]) -> bool:
        """Whether the joints are where they shall be, and at rest."""
        return bool(np.abs(self.motion.position - asked).max() < ARRIVED)


class ManualLeg:
    """Some legs off the ground and the body over the others.

    Attributes:
        legs: Indices of the legs.
        paths: Ways to there: the body to where the others hold it, then the feet up.
    """

    def __init__(self, robot: Robot, legs: list[int], stance: Stance, paths: list[JointPath]):
        self.robot, self.legs, self.paths = robot, legs, paths
        self._stance = stance
        self._R = rotation_rpy(*stance.pose[3:, None])[0]

    def asked(
        self, commands: Mapping[int, LegCommand], settings: SequenceSettings
    ) -> tuple[Float[np.ndarray, "legs 3"], list[str]]:
        """Joint angles that are asked for, within reach, joint limits and above the ground.

        Args:
            commands: By leg number from 1.
            settings: Clearance over the ground.

        Returns:
            Angles of all legs [rad], shape (L, 3), and sentences on what cannot be had.
        """
        robot, q, said = self.robot, self._stance.q.copy(), []
        limits = robot.arrays.joint_limits
        for leg in self.legs:
            given = commands.get(leg + 1)
            if given is None:
                continue
            name = robot.leg_names[leg]
            wanted = q.copy()
            if given.joints is not None:
                wanted[leg] = given.joints
                inside = np.clip(wanted[leg], limits[leg, :, 0], limits[leg, :, 1])
                if not np.array_equal(inside, wanted[leg]):
                    said.append(f"leg {name} by hand: an angle is beyond its joint's limits.")
                wanted[leg] = inside
            else:
                _, feet = knees_and_feet(robot, q)
                feet[leg] = given.foot
                solved, reached = angles_and_reach(robot, feet)
                if not reached[leg]:
                    said.append(f"leg {name} by hand: its foot cannot be put there; it waits.")
                    continue
                wanted[leg] = solved[leg]
            if self._lowest(wanted, leg) < settings.clearance / 2:
                said.append(f"leg {name} by hand: that is in the ground; it waits.")
                continue
            q[leg] = wanted[leg]
        return q, said

    def _lowest(self, q: Float[np.ndarray, "legs 3"], leg: int) -> float:
        """Height of a leg's knee or foot over the ground [m]."""
        points = np.stack(knees_and_feet(self.robot, q))[:, leg]
        return float((points @ self._R[2] + self._stance.pose[2]).min())


def plan_manual_leg(
    robot: Robot, stance: Stance, legs: list[int], settings: SequenceSettings, lost: list[int]
) -> ManualLeg | None:
    """Plan to lift some legs of a standing robot.

    The body goes to where the others hold it with the margin whatever the legs in the air do:
    with them as they are, and stretched outwards.

    Args:
        robot: The robot, L legs.
        stance: How it stands.
        legs: Indices of the legs.
        settings: Margins, speeds, heights.
        lost: Indices of legs that are in the air anyway.

    Returns:
        The move; None where the others would not hold the robot.
    """
    plan = Stepper(robot, stance, settings, lifted=lost)
    s = np.linspace(0.0, 1.0, KNOTS)[:, None, None]
    feet = np.repeat(stance.feet[None], KNOTS, axis=0)
    feet[:, legs, 2] += (settings.step_height * s**2 * (3 - 2 * s))[:, 0]
    for pose in plan.shifts(legs):
        q = plan.angles(np.repeat(pose[None], KNOTS, axis=0), feet)
        if q is None:
            continue
        far = q[-1:].copy()
        far[:, legs, 1:] = 0.0
        poses = np.concatenate([q, far])
        if plan.margin(pose[None], poses, legs).min() < settings.support_margin:
            continue
        if not plan.body(pose, "shifts its weight"):
            continue
        q[0] = plan.stance.q
        plan.paths.append(
            path_through("lifts its leg", q, settings.speed(robot), settings.acceleration)
        )
        return ManualLeg(robot, legs, Stance(pose, feet[-1], q[-1]), plan.paths)
    return None
