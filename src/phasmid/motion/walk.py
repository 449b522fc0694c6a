"""From a scenario to a walk: the motion of every joint, and whether the robot can make it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.gait import Gait, support_margin
from phasmid.kinematics import (
    body_from_hip,
    centre_of_mass,
    foot_position,
    hip_from_body,
    joint_angles,
    joint_motion,
    neutral_feet,
    reach,
    within_reach,
)
from phasmid.motion.curves import Path
from phasmid.motion.feet import coxa_only_feet, straight_feet
from phasmid.motion.trunk import TrunkMotion, progress, trunk_motion
from phasmid.robot import JOINTS, Robot
from phasmid.scenario import Scenario

CHECKED_SAMPLES = 60
"""Instants between two events of a gait at which a plan is checked, and its swings' middles."""


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

    def sample(self, time: Float[np.ndarray, " times"]) -> Walk:
        """This walk, evaluated exactly at other times.

        Args:
            time: Times [s], from 0, shape (M,).
        """
        return _evaluate(self.scenario, self.robot, self.gait, np.asarray(time, dtype=float))

    @property
    def foot_position(self) -> Float[np.ndarray, "time legs 3"]:
        """Feet in world axes [m], shape (N, L, 3)."""
        p = body_from_hip(self.robot, foot_position(self.robot.arrays, self.q))
        c, s = np.cos(self.trunk.yaw)[:, None], np.sin(self.trunk.yaw)[:, None]
        x, y = c * p[..., 0] - s * p[..., 1], s * p[..., 0] + c * p[..., 1]
        return np.stack([x, y, p[..., 2]], axis=-1) + self.trunk.position[:, None]

    def check_planned_for(self, scenario: Scenario) -> None:
        """Refuse a scenario with another robot, gait or stride than this walk was planned for.

        Raises:
            InvalidInput: What differs.
        """
        ours, theirs = self.scenario, scenario
        differs = {
            "robot": ours.robot != theirs.robot,
            "gait": ours.gait != theirs.gait,
            "stride": ours.stride != theirs.stride,
            "mass_model": ours.model.mass_model != theirs.model.mass_model,
            "mounts": ours.model.mounts != theirs.model.mounts,
        }
        for name, differ in differs.items():
            if differ:
                raise InvalidInput(
                    f"the walk was planned with another {name} than the scenario has.",
                    hint="walk = phasmid.plan(scenario)",
                )

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
        return support_margin(feet[..., :2], self.stance, com[..., :2])


def plan(scenario: Scenario) -> Walk:
    """Plan the walk of a scenario: positions, velocities and accelerations of all joints.

    Args:
        scenario: The experiment. Its walk begins amid the gait: the legs whose phase is 0 lift at
            once, and all feet stand where the gait has them.

    Returns:
        The walk, sampled as the scenario says, both ends of each cycle included.

    Raises:
        InfeasibleWalk: The stride is too long for a leg or too fast for its servos, or the robot
            would topple.
        InvalidRobot: The robot is impossible.
        InvalidGait: The gait does not fit the robot.
    """
    robot = scenario.load_robot()
    gait = scenario.load_gait(len(robot.legs))
    _check_reach(scenario, robot, gait)
    _check_cycle(scenario, robot, gait)
    interval = scenario.stride.period / (scenario.stride.samples - 1)
    count = math.floor(scenario.duration / interval + 1e-9) + 1
    return _evaluate(scenario, robot, gait, np.arange(count) * interval)


def _step(scenario: Scenario) -> Float[np.ndarray, "3"]:
    stride = scenario.stride
    return np.array([stride.step_length, stride.step_sideways, stride.step_turn])


def _feet(
    scenario: Scenario,
    robot: Robot,
    gait: Gait,
    step: Float[np.ndarray, "3"],
    time: Float[np.ndarray, " time"],
) -> tuple[TrunkMotion, Path]:
    """The trunk's motion, and the feet's in the body frame."""
    stride = scenario.stride
    # Level ground lies under the mean of the neutral feet.
    height = -float(neutral_feet(robot)[:, 2].mean())
    trunk = trunk_motion(step, height, progress(gait, stride, time))
    if stride.stance_law == "straight":
        return trunk, straight_feet(robot, gait, stride, step, time, trunk)
    return trunk, coxa_only_feet(robot, gait, stride, step, time, height)


def _evaluate(
    scenario: Scenario, robot: Robot, gait: Gait, time: Float[np.ndarray, " time"]
) -> Walk:
    trunk, feet = _feet(scenario, robot, gait, _step(scenario), time)
    R = robot.arrays.R_body_hip
    q = joint_angles(robot.arrays, hip_from_body(robot, feet.position))
    v, a = (np.einsum("lji,tlj->tli", R, x) for x in (feet.velocity, feet.acceleration))
    qd, qdd = joint_motion(robot.arrays, q, v, a)
    stance = gait.stance(time / scenario.stride.period)
    return Walk(scenario, robot, gait, time, q, qd, qdd, stance, trunk)


def _cycle_times(scenario: Scenario, gait: Gait) -> Float[np.ndarray, " time"]:
    """Instants of one cycle that miss nothing: seen from the body, all cycles are alike.

    Between two neighbours of the gait's events and the tops of its lifts all motions are
    polynomials, however short the swing is.
    """
    tops = (np.asarray(gait.offsets) + gait.swing_fraction / 2) % 1.0
    edges = np.unique(np.concatenate([gait.events, tops, [1.0]]))
    shares = np.arange(CHECKED_SAMPLES) / CHECKED_SAMPLES
    phases = edges[:-1, None] + np.diff(edges)[:, None] * shares
    return phases.ravel() * scenario.stride.period


def _first_largest(values: Float[np.ndarray, "*shape"], axis: int) -> tuple[int, ...]:
    """Index of the largest value; of equals but for round-off, the first along an axis.

    Robots are symmetric: without this, round-off would choose the leg that a message names.
    """
    near = values >= values.max() - 1e-9 * abs(values.max())
    found = np.argwhere(near)
    return tuple(int(i) for i in found[np.argmin(found[:, axis])])


def _check_reach(scenario: Scenario, robot: Robot, gait: Gait) -> None:
    time = _cycle_times(scenario, gait)

    def targets(share: float) -> Float[np.ndarray, "time legs 3"]:
        _, feet = _feet(scenario, robot, gait, share * _step(scenario), time)
        return hip_from_body(robot, feet.position)

    wanted = targets(1.0)
    if within_reach(robot, wanted).all():
        return
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = (low + high) / 2
        good = bool(within_reach(robot, targets(middle)).all())
        low, high = (middle, high) if good else (low, middle)
    _raise_out_of_reach(scenario, robot, wanted, low)


def _raise_out_of_reach(
    scenario: Scenario, robot: Robot, p: Float[np.ndarray, "time legs 3"], possible: float
) -> None:
    """Say which leg goes where, what it reaches, and the longest stride that it could make."""
    far = np.hypot(p[..., 0], p[..., 1])
    bad = within_reach(robot, p) == 0
    # Of the targets out of reach the one farthest out tells most.
    t, leg = _first_largest(np.where(bad, far, -1.0), axis=1)
    which, target = robot.legs[leg], p[t, leg]
    nearest, farthest = reach(which, float(target[2]))
    step = _step(scenario)
    if possible > 0:
        hint = f"Longest stride here: {_stride_words(step * possible, down=True)}."
    else:
        hint = (
            "No stride is possible from this stance and step height; change step_height, "
            "stance_radius or body_height."
        )
    if nearest <= far[t, leg] <= farthest:
        q = np.degrees(joint_angles(which, target))
        limits = np.degrees(which.joint_limits)
        joint = int(np.argmax((q < limits[:, 0]) | (q > limits[:, 1])))
        reason = (
            f"turns {which.name}.{JOINTS[joint]} to {q[joint]:.1f}°; its limits are "
            f"{limits[joint, 0]:.4g}° to {limits[joint, 1]:.4g}°"
        )
    elif math.isnan(farthest):
        reason = f"puts {which.name} {-target[2]:.3f} m below its hip; it reaches less deep"
    else:
        bound = farthest if far[t, leg] > farthest else nearest
        reason = f"puts {which.name} at {far[t, leg]:.3f} m; it reaches {bound:.3f} m"
    raise InfeasibleWalk(f"stride of {_stride_words(step)} {reason}. {hint}")


def _stride_words(step: np.ndarray, *, down: bool = False) -> str:
    """A stride in words; a bound is rounded down, so that it can be walked."""
    rounded = np.trunc if down else np.round
    length, turn = 1000 * math.hypot(step[0], step[1]), abs(math.degrees(step[2]))
    words = []
    if length > 0 or turn == 0:
        words.append(f"{float(rounded(length)):g} mm")
    if turn > 0:
        words.append(f"{float(rounded(10 * turn)) / 10:g}°")
    return " and ".join(words)


def _check_cycle(scenario: Scenario, robot: Robot, gait: Gait) -> None:
    """Refuse joint speeds beyond the servo, and a centre of mass beyond the feet."""
    walk = _evaluate(scenario, robot, gait, _cycle_times(scenario, gait))
    speed = np.abs(walk.qd)
    peak, limit = float(speed.max()), robot.servo.no_load_speed
    if peak > limit:
        _, leg, joint = _first_largest(speed, axis=1)
        shortest = math.ceil(100 * scenario.stride.period * peak / limit) / 100
        raise InfeasibleWalk(
            f"joint {robot.legs[leg].name}.{JOINTS[joint]} would turn at {peak:.3g} rad/s; "
            f"the servo {robot.servo.name} allows {limit:.3g} rad/s. "
            f"Shortest period: {shortest:.2f} s."
        )
    margin = walk.support_margin
    (worst,) = _first_largest(-margin, axis=0)
    if margin[worst] <= 0:
        raise InfeasibleWalk(
            f"at phase {walk.time[worst] / scenario.stride.period:.2f} the centre of mass is "
            f"{-1000 * margin[worst]:.3g} mm outside the support polygon.",
            hint="a gait with a larger duty factor, a shorter stride, or a wider stance",
        )
