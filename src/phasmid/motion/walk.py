"""From a scenario to a walk: the motion of every joint, and whether the robot can make it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from phasmid.errors import InvalidInput
from phasmid.gait import Gait, support_margin
from phasmid.kinematics import (
    body_from_hip,
    centre_of_mass,
    foot_position,
    hip_from_body,
    joint_angles,
    joint_motion,
    rotation_rpy,
)
from phasmid.motion.course import Course, plan_course
from phasmid.motion.feasibility import (
    check_reach,
    check_speed,
    check_support,
    checked_times,
    fastest,
)
from phasmid.motion.feet import rotated
from phasmid.motion.level import LevelCourse
from phasmid.motion.trunk import TrunkMotion
from phasmid.robot import Robot, robot_to_toml
from phasmid.scenario import Scenario, check_scenario
from phasmid.terrain import Ground


@dataclass(frozen=True, eq=False)
class Walk:
    """A planned walk, sampled; `sample` evaluates the same plan at any other times.

    Attributes:
        scenario: What is walked.
        robot: The robot with the scenario's variants, L legs.
        gait: Which legs stand, when.
        time: Times [s], shape (N,).
        q: Joint angles [rad], shape (N, L, 3).
        qd: Joint velocities [rad/s], shape (N, L, 3).
        qdd: Joint accelerations [rad/s²], shape (N, L, 3).
        stance: Which feet stand, shape (N, L).
        trunk: The body's planned motion.
        course: How trunk and feet travel, at any time; a `Course` where the planner knows that
            the ground is uneven.
    """

    scenario: Scenario
    robot: Robot
    gait: Gait
    time: Float[np.ndarray, " time"]
    q: Float[np.ndarray, "time legs 3"]
    qd: Float[np.ndarray, "time legs 3"]
    qdd: Float[np.ndarray, "time legs 3"]
    stance: Bool[np.ndarray, "time legs"]
    trunk: TrunkMotion
    course: LevelCourse | Course

    def sample(self, time: Float[np.ndarray, " times"]) -> Walk:
        """This walk, evaluated exactly at other times.

        Args:
            time: Times [s], from 0, shape (M,).
        """
        time, course = np.asarray(time, dtype=float), self.course
        latest = float(time.max(initial=0.0))
        # A whole number of time steps may be longer than the walk by half of one.
        if isinstance(course, Course) and latest > course.end + self.scenario.simulation.dt:
            terrain = self.scenario.planned_terrain()
            course = plan_course(self.scenario, self.robot, self.gait, terrain, latest)
        return _evaluate(self.scenario, course, time)

    @property
    def is_periodic(self) -> bool:
        """Whether all its cycles are alike, seen from the body: on ground taken for level."""
        return isinstance(self.course, LevelCourse)

    @property
    def keeps_heading(self) -> bool:
        """Whether all its cycles are alike in the world's axes too, but for the way made."""
        return isinstance(self.course, LevelCourse) and float(self.course.step[2]) == 0.0

    @property
    def foot_position(self) -> Float[np.ndarray, "time legs 3"]:
        """Feet in world axes [m], shape (N, L, 3)."""
        p = body_from_hip(self.robot, foot_position(self.robot.arrays, self.q))
        return rotated(self.trunk.rotation[:, None], p) + self.trunk.position[:, None]

    def check_planned_for(self, scenario: Scenario) -> None:
        """Refuse a scenario with another robot, gait or stride than this walk was planned for.

        Where it was planned for uneven ground, that must be the same too. Its drive and voltage may
        differ as long as its servos are quick enough.

        Raises:
            InvalidInput: What differs.
            InfeasibleWalk: A joint would turn faster than that scenario's servos without load.
        """
        ours, theirs = self.scenario, scenario
        differs = {
            "robot": not _are_one(ours, theirs),
            "gait": ours.gait != theirs.gait,
            "stride": ours.stride != theirs.stride,
            "mass_model": ours.model.mass_model != theirs.model.mass_model,
            "mounts": ours.model.mounts != theirs.model.mounts,
        }
        if not (self.is_periodic and _is_plain(theirs.planned_terrain())):
            differs |= {
                "terrain": ours.terrain != theirs.terrain,
                "footing": ours.footing != theirs.footing,
            }
        for name, differ in differs.items():
            if differ:
                raise InvalidInput(
                    f"the walk was planned with another {name} than the scenario has.",
                    hint="walk = phasmid.plan(scenario)",
                )
        servo = self.robot.servo
        if fastest(theirs, servo)[0] < fastest(ours, servo)[0]:
            for times in checked_times(ours, self.course):
                check_speed(theirs, self.course, times, self.sample(times).qd)

    def __repr__(self) -> str:
        return (
            f"Walk({self.robot.name}, {self.gait.name} gait, {len(self.time)} samples, "
            f"{self.time[-1] if len(self.time) else 0:g} s)"
        )

    @property
    def support_margin(self) -> Float[np.ndarray, " time"]:
        """Distance of the centre of mass from the edge of the support polygon [m], shape (N,)."""
        feet = body_from_hip(self.robot, foot_position(self.robot.arrays, self.q))
        com = centre_of_mass(self.robot, self.q)
        # Seen from above, with the body's heading ahead.
        level = self.trunk.attitude * [1.0, 1.0, 0.0]
        R_heading_body = rotation_rpy(*np.moveaxis(level, -1, 0))
        feet, com = rotated(R_heading_body[:, None], feet), rotated(R_heading_body, com)
        return support_margin(feet[..., :2], self.stance, com[..., :2])


def plan(scenario: Scenario) -> Walk:
    """Plan the walk of a scenario: positions, velocities and accelerations of all joints.

    Args:
        scenario: The experiment. Its walk begins amid the gait: the legs whose phase is 0 lift at
            once, and all feet stand where the gait has them.

    Returns:
        The walk, sampled as the scenario says, both ends of each cycle included.

    Raises:
        InvalidInput: That is no scenario.
        InfeasibleWalk: The stride is too long for a leg or too fast for its servos, or the robot
            would topple; or on uneven ground a leg finds no foothold.
        InvalidRobot: The robot is impossible.
        InvalidGait: The gait does not fit the robot.
    """
    check_scenario(scenario)
    robot = scenario.load_robot()
    gait = scenario.load_gait(len(robot.legs), [leg.name for leg in robot.legs])
    terrain = scenario.planned_terrain()
    course: LevelCourse | Course = LevelCourse(robot, gait, scenario.stride, scenario.stride.step)
    if not _is_plain(terrain):
        course = plan_course(scenario, robot, gait, terrain, scenario.duration)
    for times in checked_times(scenario, course):
        check_reach(scenario, course, times)
        walk = _evaluate(scenario, course, times)
        check_speed(scenario, course, times, walk.qd)
        check_support(scenario, course, times, walk.support_margin)
    interval = scenario.stride.period / (scenario.stride.samples - 1)
    count = math.floor(scenario.duration / interval + 1e-9) + 1
    return _evaluate(scenario, course, np.arange(count) * interval)


def _are_one(ours: Scenario, theirs: Scenario) -> bool:
    """Whether the robots of two scenarios are the same, however each is given."""
    if ours.robot == theirs.robot:
        return True
    return robot_to_toml(ours.base_robot()) == robot_to_toml(theirs.base_robot())


def _is_plain(terrain: Ground) -> bool:
    """Whether ground is level and everywhere of one friction."""
    return terrain.is_level and not terrain.patches


def _evaluate(
    scenario: Scenario, course: LevelCourse | Course, time: Float[np.ndarray, " time"]
) -> Walk:
    trunk, feet = course.motion(time)
    robot, gait = course.robot, course.gait
    R = robot.arrays.R_body_hip
    q = joint_angles(robot.arrays, hip_from_body(robot, feet.position))
    v, a = (np.einsum("lji,tlj->tli", R, x) for x in (feet.velocity, feet.acceleration))
    qd, qdd = joint_motion(robot.arrays, q, v, a)
    stance = gait.stance(time / scenario.stride.period)
    return Walk(scenario, robot, gait, time, q, qd, qdd, stance, trunk, course)
