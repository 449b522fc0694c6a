"""Explanation of postures and walks: what forbids them, and the largest share."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.arguments import numbers
from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.experiment import Experiment, ScenarioLike, Stride, built
from phasmid.gait import shortfall, support_margin
from phasmid.kinematics import (
    FootExplanation,
    body_height,
    centre_of_mass,
    explain_foot,
    hip_from_body,
    joint_angles,
    neutral_feet,
    posture_feet,
    rotation_rpy,
    trunk_clearance,
)
from phasmid.kinematics.leg import angles_and_margin
from phasmid.kinematics.workspace import usable_limits, within_reach
from phasmid.motion.course import LevelCourse, UnevenCourse
from phasmid.motion.feasibility import checked_times, largest_possible
from phasmid.motion.remedies import plan
from phasmid.motion.walk import Walk, course_of
from phasmid.robot import Robot

POSTURE_SHARES = 200
"""Shares of a posture that are tried from the neutral one, before the last is refined."""

NEAR = 1e-3
"""Clearance or support margin that is named before the limits of the joints [m]."""


@dataclass(frozen=True, eq=False)
class PostureExplanation:
    """Whether a robot can stand in a posture on its neutral feet, and what keeps it from it.

    Attributes:
        robot: The robot, L legs.
        pose: Displacement of the body from its neutral pose: forward, left, up [m], roll, pitch,
            yaw [rad], shape (6,).
        feet: Explanation of each foot.
        clearance: Height of the trunk's lowest corner over the ground [m].
        support_margin: Distance of the centre of mass from the edge of the support polygon [m]; NaN
            where a foot is out of reach.
        share: Largest possible share of the pose, from 0 to 1.
    """

    robot: Robot
    pose: Float[np.ndarray, "6"]
    feet: tuple[FootExplanation, ...]
    clearance: float
    support_margin: float
    share: float

    @property
    def obstacles(self) -> tuple[FootExplanation, ...]:
        """The legs that cannot keep their feet in place, the farthest out of reach first."""
        found = [foot for foot in self.feet if not foot.is_possible]
        return tuple(sorted(found, key=lambda foot: -round(foot.distance, 9)))

    @property
    def is_possible(self) -> bool:
        """All feet are within reach, the trunk is free of the ground, and the robot is stable."""
        return not self.obstacles and self.clearance > 0 and self.support_margin > 0

    @property
    def tightest(self) -> FootExplanation:
        """The leg nearest to a limit."""
        return min(self.feet, key=lambda foot: round(foot.margin[1], 9))

    @property
    def margin_words(self) -> str:
        """What is nearest to forbidding the posture, in words."""
        if self.clearance < NEAR:
            return f"the trunk is {1000 * self.clearance:z.1f} mm over the ground"
        if self.support_margin < NEAR:
            margin = f"{1000 * self.support_margin:z.1f} mm"
            return f"the centre of mass is {margin} inside the support polygon"
        return _margin_words(self.tightest)

    @property
    def sentence(self) -> str:
        """The explanation in one sentence or two."""
        if self.is_possible:
            return f"the posture is possible; {self.margin_words}."
        reasons = []
        if self.obstacles:
            first, others = self.obstacles[0], len(self.obstacles) - 1
            more = f" (and {others} more)" if others else ""
            reasons.append(f"{first.leg.name}{more}: {first.violations[0].reason}")
        if not self.clearance > 0:
            reasons.append(f"the trunk would be {-1000 * self.clearance:.1f} mm in the ground")
        if self.support_margin <= 0:
            reasons.append(shortfall(self.support_margin))
        return (
            f"the posture is impossible: {'; '.join(reasons)}. "
            f"The largest possible share of it is {math.floor(1000 * self.share) / 10:.1f} %."
        )


def explain_posture(robot: Robot, pose: object) -> PostureExplanation:
    """Explain whether a robot can stand in a posture on its neutral feet.

    Args:
        robot: The robot, L legs.
        pose: Displacement of the body from its neutral pose: forward, left, up [m], roll, pitch,
            yaw [rad], shape (6,).

    Raises:
        InvalidInput: The pose is not six finite numbers.
    """
    wanted = numbers(pose, "pose")
    if wanted.shape != (6,) or not np.isfinite(wanted).all():
        raise InvalidInput(f"pose is {pose}; it must be six finite numbers.")
    feet = tuple(map(explain_foot, robot.legs, posture_feet(robot, wanted)))
    clearance, margin = _clearance_and_margin(robot, wanted)

    def is_possible(share: float) -> bool:
        if not within_reach(robot, posture_feet(robot, share * wanted)).all():
            return False
        return min(_clearance_and_margin(robot, share * wanted)) > 0

    share = largest_possible(is_possible, np.linspace(0.0, 1.0, POSTURE_SHARES + 1))
    return PostureExplanation(robot, wanted, feet, clearance, margin, share)


def _clearance_and_margin(robot: Robot, pose: np.ndarray) -> tuple[float, float]:
    """Return trunk clearance and support margin [m]; the latter NaN with a foot out of reach."""
    feet, hip_feet = neutral_feet(robot), posture_feet(robot, pose)
    clearance = trunk_clearance(robot, body_height(robot), pose)
    if not within_reach(robot, hip_feet).all():
        return clearance, math.nan
    com = centre_of_mass(robot, joint_angles(robot.arrays, hip_feet))
    com = rotation_rpy(*pose[3:, None])[0] @ com + pose[:3]
    stance = np.ones(len(feet), dtype=bool)
    return clearance, float(support_margin(feet[:, :2], stance, com[:2]))


def _margin_words(foot: FootExplanation) -> str:
    return f"nearest to a limit is {foot.leg.name}.{foot.margin_words}"


@dataclass(frozen=True, eq=False)
class WalkExplanation:
    """Whether a walk can be planned, and what forbids it.

    Attributes:
        experiment: What was to be planned.
        walk: The walk; None where it is impossible.
        refusal: The refusal of the plan; None where the walk is possible.
        feet: Where the walk is impossible, one foot position for each leg that leaves its reach,
            the farthest out of it, the worst leg first. Else the foot position nearest to a limit.
        stride: Longest possible stride of this direction, gait and period; None where there is
            none, or the walk is possible.
        limit: The refusal of a slightly longer stride, a clause; empty where the walk is possible.
    """

    experiment: Experiment
    walk: Walk | None
    refusal: InfeasibleWalk | None
    feet: tuple[FootExplanation, ...]
    stride: Stride | None
    limit: str

    @property
    def is_possible(self) -> bool:
        """The walk can be planned."""
        return self.walk is not None

    @property
    def sentence(self) -> str:
        """The explanation in one sentence or two."""
        if self.refusal is not None:
            return self.refusal.what
        return f"the walk is possible; {_margin_words(self.feet[0])}."


def explain_walk(scenario: ScenarioLike | Experiment) -> WalkExplanation:
    """Explain whether the walk of a scenario can be planned.

    Raises:
        InvalidInput: Robot, gait or terrain of the scenario is refused.
    """
    experiment = built(scenario)
    try:
        walk = plan(experiment)
    except InfeasibleWalk as error:
        refusal = error
    else:
        low, high = np.moveaxis(np.array([usable_limits(leg) for leg in walk.robot.legs]), -1, 0)
        room = np.minimum(walk.q - low, high - walk.q).min(axis=-1)
        t, leg = np.unravel_index(int(np.argmin(np.round(room, 9))), room.shape)
        hip_foot = hip_from_body(walk.robot, walk.course.motion(walk.time)[1].position)[t, leg]
        foot = explain_foot(walk.robot.legs[leg], hip_foot)
        return WalkExplanation(experiment, walk, None, (foot,), None, "")
    feet: tuple[FootExplanation, ...] = ()
    # On uneven ground the feet may have no course at all.
    with suppress(InfeasibleWalk):
        feet = _feet(experiment, course_of(experiment))
    return WalkExplanation(experiment, None, refusal, feet, *_longest(experiment))


def _feet(
    experiment: Experiment, course: LevelCourse | UnevenCourse
) -> tuple[FootExplanation, ...]:
    """Return for each leg that leaves its reach the foot position farthest out of it."""
    robot = course.robot
    low, high = np.moveaxis(robot.arrays.joint_limits, -1, 0)
    worst: dict[int, tuple[float, np.ndarray]] = {}
    for times in checked_times(experiment, course):
        feet = hip_from_body(robot, course.motion(times)[1].position)
        q, margin = angles_and_margin(robot.arrays, feet)
        # Positions that no angles reach come first, then those of the largest excess of an angle.
        excess = np.maximum(low - q, q - high).max(axis=-1)
        badness = np.where(margin > 0, excess, 2 * np.pi + np.abs(margin))
        outside = within_reach(robot, feet) == 0
        for leg in np.flatnonzero(outside.any(axis=0)).tolist():
            t = int(np.argmax(np.where(outside[:, leg], badness[:, leg], -np.inf)))
            if leg not in worst or badness[t, leg] > worst[leg][0]:
                worst[leg] = float(badness[t, leg]), feet[t, leg]
    found = [explain_foot(robot.legs[leg], foot) for leg, (_, foot) in sorted(worst.items())]
    return tuple(sorted(found, key=lambda foot: -round(foot.distance, 9)))


def _longest(experiment: Experiment) -> tuple[Stride | None, str]:
    """Return the longest possible stride of a direction, or None, and what forbids a longer one."""
    limit, stride = "", experiment.course.stride

    def is_possible(share: float) -> bool:
        nonlocal limit
        try:
            plan(experiment.replace(stride=stride.scaled(share)))
        except InfeasibleWalk as error:
            # Without the hints that may follow.
            limit = error.what.split(". ")[0].rstrip(".")
            return False
        return True

    share = largest_possible(is_possible, np.array([0.0, 1.0]))
    return (stride.scaled(share) if share > 0 else None), limit
