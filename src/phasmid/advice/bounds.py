"""Static joint torques between two bounds: without help from the floor, and with the best help."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import daqp
import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import block_diag

from phasmid.dynamics import BodyMotion, inverse_dynamics
from phasmid.experiment import Experiment
from phasmid.forces import Contacts, JointLoad, contact_jacobian, contact_points, share_load
from phasmid.forces.load import grasp_matrix
from phasmid.gait import support_margin
from phasmid.gait.cycle import timing
from phasmid.kinematics import (
    body_from_hip,
    body_height,
    foot_position,
    hip_from_body,
    joint_angles,
    neutral_feet,
    trunk_clearance,
    within_reach,
)
from phasmid.motion import LevelCourse, evaluate, has_room_for
from phasmid.motion.feasibility import checked_phases
from phasmid.robot import Robot

PHASES = 5
"""Samples of each interval between two events of the gait."""

SIMPSON = np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 12
"""Weights of these samples in a mean, by Simpson's rule."""

RISES = 1.0, 0.75, 0.5, 0.25, 0.0
"""Postures of standing up: shares of the way from the belly on the ground to the stance."""

LEAST_MARGIN = 1e-9
"""Support margin above which a robot is stable [m]."""

FACES = 16
"""Faces of the pyramid inside each friction cone; it has 2 % less friction along its faces."""

EVEN = 1e-3
"""Weight of half of the sum of squared shares beside the largest share: among distributions with
nearly the same largest share, the one of least heat counts."""

LEAST_FRICTION, MOST_FRICTION = 1e-3, 16.0
"""Least coefficient that counts as help, and that above which friction counts as unlimited."""

BISECTIONS = 12
"""Bisections of the least friction between them: to 0.3 %."""


@dataclass(frozen=True, eq=False)
class Postures:
    """A robot at rest in N postures: those of a cycle of its walk, and of standing up.

    The last posture is the stance.

    Attributes:
        q: Joint angles [rad], shape (N, L, 3).
        qd: Joint velocities of the walk [rad/s]; 0 while standing up, shape (N, L, 3).
        stance: Feet that stand, shape (N, L).
        phase: Part of the cycle; NaN while standing up, shape (N,).
        weight: Share of the cycle for which each posture counts; 0 while standing up, shape (N,).
        fastest: Largest speed of each joint on the walk [rad/s], shape (L, 3); NaN where the legs
            have no room for it.
    """

    q: Float[np.ndarray, "postures legs 3"]
    qd: Float[np.ndarray, "postures legs 3"]
    stance: Bool[np.ndarray, "postures legs"]
    phase: Float[np.ndarray, " postures"]
    weight: Float[np.ndarray, " postures"]
    fastest: Float[np.ndarray, "legs 3"]


def postures(experiment: Experiment) -> Postures:
    """Return the postures of an experiment's robot on level ground.

    A walk for which the legs have no room, which plans refuse, counts as steps on the spot.

    Raises:
        Unreachable: A neutral foot is out of reach.
    """
    robot, gait, stride = experiment.robot, experiment.course.gait, experiment.course.stride
    neutral = neutral_feet(robot)
    standing = joint_angles(robot.arrays, hip_from_body(robot, neutral))
    has_room = has_room_for(robot, gait, stride)
    if not has_room:
        stride = stride.scaled(0.0).model_copy(update={"step_height": 0.0})
    course = LevelCourse(robot, gait, stride)
    cycle = timing(gait, PHASES)
    walk = evaluate(experiment, course, cycle.phase * stride.period)
    fastest = evaluate(experiment, course, checked_phases(gait) * stride.period).qd
    width = np.diff(np.append(gait.events, 1.0 + gait.events[0]))
    # Where even a swaying trunk is out of reach, the angles are not finite.
    q = np.where(np.isfinite(walk.q).all(axis=(1, 2), keepdims=True), walk.q, standing)
    clearance = max(trunk_clearance(robot, body_height(robot), np.zeros(6)), 0.0)
    lower = neutral + clearance * np.array(RISES)[:, None, None] * [0.0, 0.0, 1.0]
    lower = lower[within_reach(robot, hip_from_body(robot, lower)).all(axis=1)]
    rising = joint_angles(robot.arrays, hip_from_body(robot, lower))
    count = len(rising)
    return Postures(
        q=np.concatenate([q, rising]),
        qd=np.concatenate([np.nan_to_num(walk.qd), np.zeros_like(rising)]),
        stance=np.concatenate([cycle.stance, np.ones((count, len(neutral)), dtype=bool)]),
        phase=np.append(cycle.phase, np.full(count, np.nan)),
        weight=np.append((width[:, None] * SIMPSON).ravel(), np.zeros(count)),
        fastest=np.nan_to_num(np.abs(fastest).max(axis=0)) if has_room else np.nan * neutral,
    )


@dataclass(frozen=True, eq=False)
class StaticLoads:
    """Loads of a robot at rest in N postures on level ground.

    Attributes:
        robot: The robot, L legs.
        postures: The postures.
        friction: Least coefficient of friction of the ground; None: it gives no help.
        joints: Jacobians of the standing feet, and torques without ground.
        feet: Points of contact in body axes [m], shape (N, L, 3).
        wrench: Force and moment of the ground [N, N·m], shape (N, 6).
        support_margin: Of each posture [m], shape (N,).
    """

    robot: Robot
    postures: Postures
    friction: float | None
    joints: JointLoad
    feet: Float[np.ndarray, "postures legs 3"]
    wrench: Float[np.ndarray, "postures 6"]
    support_margin: Float[np.ndarray, " postures"]

    @property
    def stable(self) -> Bool[np.ndarray, " postures"]:
        """Postures in which the centre of mass is between the standing feet."""
        return self.support_margin > LEAST_MARGIN

    @property
    def is_stable(self) -> bool:
        """All postures are stable."""
        return bool(self.stable.all())

    @cached_property
    def torque(self) -> Float[np.ndarray, "2 postures legs 3"]:
        """Bounds of the sizes of the torques [N·m], NaN where the robot topples.

        Those of `unaided`, then those of `aided`.
        """
        high = np.abs(self.unaided())
        low = high if self.friction is None else np.abs(self.aided(self.friction))
        return np.stack([high, np.where(np.isnan(low), high, low)])

    @property
    def share(self) -> Float[np.ndarray, "2 postures legs 3"]:
        """Shares of the joints' stall torques."""
        return self.torque / self.robot.arrays.stall_torque

    def unaided(self) -> Float[np.ndarray, "postures legs 3"]:
        """Return the torques of vertical foot forces [N·m], NaN where the robot topples.

        Three feet share the weight by statics, more by least squares.
        """
        stable = self.stable
        torque = np.full(self.joints.torque.shape, np.nan)
        if stable.any():
            contacts = Contacts(self.feet[stable], self.postures.stance[stable], friction=0.0)
            force = share_load(contacts, self.wrench[stable], "friction-cone")
            joints = JointLoad(self.joints.jacobian[stable], self.joints.torque[stable])
            torque[stable] = joints.with_ground(force)
        return torque

    def aided(self, friction: float) -> Float[np.ndarray, "postures legs 3"]:
        """Return the torques [N·m] of smallest largest share of a joint's limit.

        The foot forces are within the friction cones. NaN where the robot topples.

        Args:
            friction: Coefficient of friction; infinite: no foot slips.
        """
        torque = np.full(self.joints.torque.shape, np.nan)
        for i in np.flatnonzero(self.stable).tolist():
            torque[i] = self._least_share(i, friction)
        return torque

    def least_friction(self) -> float:
        """Return the least coefficient of friction with which no joint exceeds its limit.

        0 where no help is needed, else at least `LEAST_FRICTION`; infinite where no friction is
        enough.
        """
        share = np.nan_to_num(self.share[0]).max(axis=(1, 2))
        loaded = sorted(np.flatnonzero(share > 1).tolist(), key=lambda i: -share[i])
        least = LEAST_FRICTION if loaded else 0.0
        # The most loaded posture first: it decides, and the others only need a check.
        for i in loaded:
            if self._share(i, least) <= 1:
                continue
            if self._share(i, MOST_FRICTION) > 1:
                return math.inf
            low, high = least, MOST_FRICTION
            for _ in range(BISECTIONS):
                middle = math.sqrt(low * high)
                low, high = (low, middle) if self._share(i, middle) <= 1 else (middle, high)
            least = high
        return least

    def largest(self, share: Float[np.ndarray, "2 ..."]) -> Float[np.ndarray, "2"]:
        """Return the largest of both bounds, NaN where no posture is stable."""
        rows = share.reshape(2, -1)
        return np.where(np.isfinite(rows).any(axis=1), np.nan_to_num(rows).max(axis=1), np.nan)

    def sustained(
        self, values: Float[np.ndarray, "2 postures legs 3"]
    ) -> Float[np.ndarray, "2 legs 3"]:
        """Return the mean of values over a cycle, or their value in the stance if larger."""
        mean = np.einsum("n,enlj->elj", self.postures.weight, values)
        return np.asarray(np.maximum(mean, values[:, -1]))

    def rms(self) -> Float[np.ndarray, "2 legs 3"]:
        """Return the rms torques of a cycle, or those of the stance if larger [N·m]."""
        return np.asarray(np.sqrt(self.sustained(self.torque**2)))

    def _share(self, i: int, friction: float) -> float:
        share = np.abs(self._least_share(i, friction)) / self.robot.arrays.stall_torque
        return float(np.nan_to_num(share, nan=np.inf).max())

    def _least_share(self, i: int, friction: float) -> Float[np.ndarray, "legs 3"]:
        """Return the joint torques of one posture [N·m] with the smallest largest share."""
        on = self.postures.stance[i]
        feet, wrench, limit = self.feet[i, on], self.wrench[i], self.robot.arrays.stall_torque[on]
        jacobian, torque = self.joints.jacobian[i, on], self.joints.torque[i, on]
        k, load = len(feet), float(np.abs(wrench[:3]).max())
        # Unknowns: forces in units of the load, and the largest share.
        rows = -load * block_diag(*(np.swapaxes(jacobian, 1, 2) / limit[:, :, None]))
        own = (torque / limit).ravel()
        one, none = np.ones((3 * k, 1)), np.zeros((6, 1))
        blocks = [
            (np.hstack([grasp_matrix(feet), none]), wrench / load, wrench / load),
            (np.eye(3 * k, 3 * k + 1)[2::3], np.zeros(k), np.full(k, np.inf)),
            (np.hstack([rows, -one]), np.full(3 * k, -np.inf), -own),
            (np.hstack([rows, one]), -own, np.full(3 * k, np.inf)),
        ]
        if math.isfinite(friction):
            blocks.append(_cones(k, friction))
        A, lower, upper = (np.concatenate(part) for part in zip(*blocks, strict=True))
        cost = np.zeros((3 * k + 1, 3 * k + 1))
        cost[:-1, :-1] = EVEN * rows.T @ rows
        # Strictly convex: with t the least largest share of n joints, the result is at most
        # t + EVEN n t² / 2.
        cost += np.diag(np.append(np.full(3 * k, 1e-9), EVEN))
        slope, kind = np.append(EVEN * own @ rows, 1.0), np.zeros(len(A), dtype=np.int32)
        x, _, flag, _ = daqp.solve(cost, slope, np.ascontiguousarray(A), upper, lower, kind)
        found = self.joints.torque[i].copy()
        # Vertical forces are possible in a stable posture: a solver that gives up is no answer.
        found[on] = (rows @ x[:-1] + own).reshape(k, 3) * limit if flag == 1 else np.nan
        return found


def _cones(feet: int, friction: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the limits of the pyramids inside the friction cones of a number of feet."""
    angles = 2 * np.pi * np.arange(FACES) / FACES
    face = np.stack(
        [np.cos(angles), np.sin(angles), np.full(FACES, -friction * math.cos(math.pi / FACES))],
        axis=1,
    )
    rows = np.hstack([np.kron(np.eye(feet), face), np.zeros((feet * FACES, 1))])
    return rows, np.full(len(rows), -np.inf), np.zeros(len(rows))


def static_loads(
    experiment: Experiment,
    robot: Robot | None = None,
    chosen: Postures | None = None,
    *,
    with_help: bool = True,
) -> StaticLoads:
    """Return the static loads of an experiment's robot on level ground.

    Args:
        experiment: The experiment; the least friction of its ground counts.
        robot: A robot of other masses in its place.
        chosen: Result of `postures` for the experiment.
        with_help: False: both bounds are those without help, which are found sooner.

    Raises:
        Unreachable: A neutral foot is out of reach.
    """
    robot, chosen = robot or experiment.robot, chosen or postures(experiment)
    q, count = chosen.q, len(chosen.q)
    feet = body_from_hip(robot, foot_position(robot.arrays, q))
    still = np.zeros_like(q)
    body = BodyMotion.at_rest(np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3)))
    terrain, gravity = experiment.world.terrain, experiment.world.gravity
    friction = min([terrain.coefficient, *(patch.coefficient for patch in terrain.patches)])
    free, wrench = inverse_dynamics(robot, body, q, still, still, gravity=gravity)
    com = np.stack([-wrench[:, 4], wrench[:, 3]], axis=1) / wrench[:, 2:3]
    up = np.array([0.0, 0.0, 1.0])
    return StaticLoads(
        robot=robot,
        postures=chosen,
        friction=friction if with_help else None,
        joints=JointLoad(contact_jacobian(robot, q, np.eye(3), up), free),
        feet=contact_points(robot, feet, up),
        wrench=wrench,
        support_margin=np.asarray(support_margin(feet[..., :2], chosen.stance, com)),
    )
