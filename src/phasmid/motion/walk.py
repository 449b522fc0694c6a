"""Planned walks: the motion of every joint, checked for feasibility."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from phasmid.arguments import explained
from phasmid.errors import InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, built
from phasmid.gait import Gait, support_margin
from phasmid.kinematics import (
    body_from_hip,
    centre_of_mass,
    foot_position,
    hip_from_body,
    joint_angles,
    joint_motion,
    rotated,
    rotation_rpy,
)
from phasmid.motion.course import LevelCourse, UnevenCourse, plan_course
from phasmid.motion.feasibility import (
    check_reach,
    check_speed,
    check_support,
    checked_times,
)
from phasmid.motion.trunk import TrunkMotion
from phasmid.robot import Robot, robot_to_toml, with_servo
from phasmid.terrain import Ground


@dataclass(frozen=True, eq=False)
class Walk:
    """Planned walk at sample times; `sample` evaluates the plan at other times.

    Attributes:
        experiment: What it was planned for.
        robot: The robot as supplied, L legs.
        gait: The gait.
        time: Times [s], shape (N,).
        q: Joint angles [rad], shape (N, L, 3).
        qd: Joint velocities [rad/s], shape (N, L, 3).
        qdd: Joint accelerations [rad/s²], shape (N, L, 3).
        stance: Feet that stand, shape (N, L).
        trunk: Planned motion of the body.
        course: Motion of trunk and feet at any time; an `UnevenCourse` on planned uneven ground.
    """

    experiment: Experiment
    robot: Robot
    gait: Gait
    time: Float[np.ndarray, " time"]
    q: Float[np.ndarray, "time legs 3"]
    qd: Float[np.ndarray, "time legs 3"]
    qdd: Float[np.ndarray, "time legs 3"]
    stance: Bool[np.ndarray, "time legs"]
    trunk: TrunkMotion
    course: LevelCourse | UnevenCourse

    @explained
    def sample(self, time: Float[np.ndarray, " times"]) -> Walk:
        """Return this walk at other times, without interpolation.

        Args:
            time: Times [s], from 0, shape (M,).
        """
        time, course = np.asarray(time, dtype=float), self.course
        latest = float(time.max(initial=0.0))
        # A whole number of time steps may exceed the walk by half a step.
        if (
            isinstance(course, UnevenCourse)
            and latest > course.end + self.experiment.solver.time_step
        ):
            course = replace(plan_course(self.experiment, latest), robot=self.robot)
        return evaluate(self.experiment, course, time)

    @property
    def is_periodic(self) -> bool:
        """All cycles are equal in the body frame: the plan is on level ground."""
        return isinstance(self.course, LevelCourse)

    @property
    def keeps_heading(self) -> bool:
        """All cycles are equal in world axes, too, except for translation."""
        return isinstance(self.course, LevelCourse) and self.course.stride.step_turn == 0.0

    @property
    def foot_position(self) -> Float[np.ndarray, "time legs 3"]:
        """Feet in world axes [m], shape (N, L, 3)."""
        p = body_from_hip(self.robot, foot_position(self.robot.arrays, self.q))
        return rotated(self.trunk.rotation[:, None], p) + self.trunk.position[:, None]

    def for_experiment(self, experiment: ScenarioLike | Experiment) -> Walk:
        """Return this walk of the robot as another experiment supplies it.

        Robot, gait and stride must be equal, on planned uneven ground terrain and footing, too.
        Payload, the trunk's mass, mass model, drive, the servos, their settings and supply may
        differ where the servos are fast enough.

        Raises:
            InvalidInput: They differ; the message names the first difference.
            InfeasibleWalk: A joint is faster than the no-load speed of that experiment's servos.
        """
        ours, theirs = self.experiment, built(experiment)
        differs = {
            "robot": not _are_one(ours.file_robot, theirs.file_robot),
            "gait": self.gait != theirs.course.gait,
            "stride": ours.course.stride != theirs.course.stride,
            "mounts": not np.array_equal(
                self.robot.arrays.R_body_hip, theirs.robot.arrays.R_body_hip
            ),
        }
        if not (self.is_periodic and is_plain(theirs.world.planned_terrain)):
            differs |= {
                "terrain": ours.world.planned_terrain != theirs.world.planned_terrain,
                "footing": ours.course.footing != theirs.course.footing,
            }
        for name, differ in differs.items():
            if differ:
                raise InvalidInput(
                    f"the walk was planned with another {name} than the scenario has.",
                    hint="walk = phasmid.plan(scenario)",
                )
        robot = theirs.robot
        walk = replace(self, robot=robot, course=replace(self.course, robot=robot))
        if (robot.arrays.no_load_speed < self.robot.arrays.no_load_speed).any():
            for times in checked_times(ours, walk.course):
                check_speed(theirs, walk.course, times, walk.sample(times).qd)
        return walk

    @property
    def support_margin(self) -> Float[np.ndarray, " time"]:
        """Distance of the centre of mass from the edge of the support polygon [m], shape (N,)."""
        feet = body_from_hip(self.robot, foot_position(self.robot.arrays, self.q))
        com = centre_of_mass(self.robot, self.q)
        # In the horizontal plane, along the body's heading.
        level = self.trunk.attitude * [1.0, 1.0, 0.0]
        R_heading_body = rotation_rpy(*np.moveaxis(level, -1, 0))
        feet, com = rotated(R_heading_body[:, None], feet), rotated(R_heading_body, com)
        return support_margin(feet[..., :2], self.stance, com[..., :2])


def plan(experiment: Experiment) -> Walk:
    """Plan as `phasmid.motion.remedies.plan` does, without a remedy where a walk is refused."""
    course = checked_course(experiment)
    interval = experiment.course.stride.period / (experiment.course.stride.samples - 1)
    count = math.floor(experiment.duration / interval + 1e-9) + 1
    return evaluate(experiment, course, np.arange(count) * interval)


def checked_course(experiment: Experiment) -> LevelCourse | UnevenCourse:
    """Return the motion of trunk and feet of an experiment.

    Raises:
        InfeasibleWalk: It is refused.
    """
    course = course_of(experiment)
    for times in checked_times(experiment, course):
        check_reach(experiment, course, times)
        walk = evaluate(experiment, course, times)
        check_speed(experiment, course, times, walk.qd)
        check_support(experiment, course, times, walk.support_margin)
    return course


def course_of(experiment: Experiment) -> LevelCourse | UnevenCourse:
    """Return the motion of trunk and feet of an experiment, which may be out of the legs' reach.

    Raises:
        InfeasibleWalk: A leg finds no foothold on uneven ground.
    """
    if is_plain(experiment.world.planned_terrain):
        return LevelCourse(experiment.robot, experiment.course.gait, experiment.course.stride)
    return plan_course(experiment, experiment.duration)


def _are_one(ours: Robot, theirs: Robot) -> bool:
    """Return whether two robots are equal, apart from their servos and the mass of the trunk."""
    if ours is theirs:
        return True

    def compared(robot: Robot) -> str:
        # Heavier servos have changed the mass of the trunk.
        alike = with_servo(robot, ours.servo)
        return robot_to_toml(replace(alike, body=replace(alike.body, mass=1.0)))

    return compared(ours) == compared(theirs)


def is_plain(terrain: Ground) -> bool:
    """Return whether ground is level and of one friction."""
    return terrain.is_level and not terrain.patches


def evaluate(
    experiment: Experiment, course: LevelCourse | UnevenCourse, time: Float[np.ndarray, " time"]
) -> Walk:
    """Return the motion of an experiment's robot on a course, unchecked.

    Args:
        experiment: The experiment.
        course: Motion of trunk and feet.
        time: Times [s], shape (N,).
    """
    trunk, feet = course.motion(time)
    robot, gait = course.robot, course.gait
    R = robot.arrays.R_body_hip
    q = joint_angles(robot.arrays, hip_from_body(robot, feet.position))
    v, a = (np.einsum("lji,tlj->tli", R, x) for x in (feet.velocity, feet.acceleration))
    qd, qdd = joint_motion(robot.arrays, q, v, a)
    stance = gait.stance(time / experiment.course.stride.period)
    return Walk(experiment, robot, gait, time, q, qd, qdd, stance, trunk, course)
