"""Feed-forward torque: what the joints must give so that the robot moves as it shall."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control.dynamics.cones import (
    NEGLIGIBLE,
    Programme,
    take_solution,
    write_programme,
)
from phasmid.control.dynamics.instant import (
    find_needs,
    needs_in,
    needs_size,
    packed,
    unpack,
)
from phasmid.control.dynamics.settings import EffortSettings
from phasmid.control.dynamics.sharing import (
    demand_of,
    friction_needed,
    load_joints,
    share_forces,
    space_in,
)
from phasmid.control.memory import unwrapped
from phasmid.errors import InvalidInput
from phasmid.robot import JOINTS, Robot
from phasmid.units import STANDARD_GRAVITY

MISSING = 1e-6
"""A part of the load that may be missing without a word."""


class Effort(NamedTuple):
    """What a motion takes.

    Attributes:
        torque: Of the joints [N·m], shape (L, 3).
        force: Of the ground on the feet [N], world axes, shape (L, 3).
        part: How much of the motion can be had, 1: all of it, 0: at rest alone, or not even that.
        friction: Coefficient of friction that these forces need.
        demand: Largest torque as a part of what its servo gives at its speed.
        remark: What cannot be done, in a sentence; empty where all can.
    """

    torque: Float[np.ndarray, "legs 3"]
    force: Float[np.ndarray, "legs 3"]
    part: float
    friction: float
    demand: float
    remark: str


def _find_effort(
    masses: np.ndarray,
    R: np.ndarray,
    w: np.ndarray,
    dw: np.ndarray,
    a: np.ndarray,
    q: np.ndarray,
    qd: np.ndarray,
    qdd: np.ndarray,
    share: np.ndarray,
    normals: np.ndarray,
    numbers: np.ndarray,
    work: np.ndarray,
) -> tuple[float, float, float]:
    legs = q.shape[0]
    needs = needs_in(work, legs)
    D, c, limits, force, torque = space_in(work, legs)
    felt = np.empty(3)
    felt[0], felt[1], felt[2] = a[0], a[1], a[2] + numbers[0]
    stall, drop = numbers[1], numbers[2]
    find_needs(unpack(masses, legs), R, w, dw, felt, q, qd, qdd, needs)
    missing = share_forces(needs, share, normals, int(numbers[3]), numbers[4], D, c, force)
    load_joints(needs, force, torque)
    for leg in range(legs):
        for k in range(3):
            loss = drop * qd[leg, k]
            limits[1, leg, k] = max(stall - max(loss, 0.0), 0.0)
            limits[0, leg, k] = min(-stall - min(loss, 0.0), 0.0)
    return missing, friction_needed(force, normals, share), demand_of(torque, limits)


find_effort = compiled(_find_effort)


class FeedForward:
    """Finds torques and foot forces for one robot, instant by instant.

    Args:
        robot: The robot, L legs.
        settings: How forces are chosen.
        gravity: Acceleration of free fall [m/s²].
        rotor: Inertia of the servos' rotors at the joints [kg·m²]; None: by the robot's servo.

    Attributes:
        settings: The settings.
        friction: Coefficient that the forces may use; it may be changed at any time.
        masses: What `find_effort` has to know of the robot.
        numbers: What it has to know of servos, gravity and cost.
        work: What it works in.
        force: Of the ground on the feet [N], world axes, in `work`, shape (L, 3).
        torque: Of the joints [N·m], in `work`, shape (L, 3).
    """

    def __init__(
        self,
        robot: Robot,
        settings: EffortSettings | None = None,
        *,
        gravity: float = STANDARD_GRAVITY,
        rotor: float | None = None,
    ) -> None:
        self.settings = settings or EffortSettings()
        legs, servo = len(robot.legs), robot.servo
        self.masses = packed(robot, rotor=servo.armature if rotor is None else rotor)
        self.friction = self.settings.friction * self.settings.friction_used
        stall = self.settings.torque_used * servo.stall_torque
        drop = stall / servo.no_load_speed
        self.numbers = np.array([gravity, stall, drop, *self.settings.cost()])
        self.work = np.zeros(unwrapped(needs_size)(legs) + 24 * legs)
        self._needs = unwrapped(needs_in)(self.work, legs)
        _, _, self._limits, self.force, self.torque = unwrapped(space_in)(self.work, legs)
        self._rest = np.zeros(unwrapped(needs_size)(legs))
        self._programmes = [Programme(count) for count in range(legs + 1)]
        self._up = np.tile([0.0, 0.0, 1.0], (legs, 1))
        self._names = [f"{leg.name}.{joint}" for leg in robot.legs for joint in JOINTS]

    def update(
        self,
        rotation: Float[np.ndarray, "3 3"],
        angular_velocity: Float[np.ndarray, "3"],
        angular_acceleration: Float[np.ndarray, "3"],
        acceleration: Float[np.ndarray, "3"],
        q: Float[np.ndarray, "legs 3"],
        qd: Float[np.ndarray, "legs 3"],
        qdd: Float[np.ndarray, "legs 3"],
        share: Float[np.ndarray, " legs"],
        normals: Float[np.ndarray, "legs 3"] | None = None,
    ) -> Effort:
        """What a motion takes at one instant; the world's z points up, against gravity.

        Args:
            rotation: R_world_body, shape (3, 3).
            angular_velocity: Of the trunk, world axes [rad/s].
            angular_acceleration: Of the trunk, world axes [rad/s²].
            acceleration: Of the body's origin, world axes, without gravity [m/s²].
            q: Joint angles [rad], shape (L, 3).
            qd: Joint speeds [rad/s], shape (L, 3).
            qdd: Joint accelerations [rad/s²], shape (L, 3).
            share: Each foot's part of its full share of the load; 0: it does not stand.
            normals: Of the ground under the feet, world axes; None: straight up, shape (L, 3).
        """
        if not q.shape == qd.shape == qdd.shape == self.torque.shape:
            raise InvalidInput(
                f"joints have shapes {q.shape}, {qd.shape} and {qdd.shape}; the robot's is "
                f"{self.torque.shape}."
            )
        normals = self._up if normals is None else normals
        missing, friction, demand = find_effort(
            self.masses,
            rotation,
            angular_velocity,
            angular_acceleration,
            acceleration,
            q,
            qd,
            qdd,
            share,
            normals,
            self.numbers,
            self.work,
        )
        return self.answer(missing, friction, demand, rotation, q, share, normals)

    def answer(
        self,
        missing: float,
        friction: float,
        demand: float,
        rotation: Float[np.ndarray, "3 3"],
        q: Float[np.ndarray, "legs 3"],
        share: Float[np.ndarray, " legs"],
        normals: Float[np.ndarray, "legs 3"],
    ) -> Effort:
        """What a motion takes of which `find_effort` has found this; the others as in `update`.

        Args:
            missing: Part of the load that is missing.
            friction: Coefficient of friction that the forces need.
            demand: Largest torque as a part of what its servo gives.
            rotation: As there.
            q: As there.
            share: As there.
            normals: As there.
        """
        part, remark = 1.0, ""
        # Written so that what is no number keeps no limit.
        if not (friction <= self.friction and demand <= 1.0 and missing <= MISSING):
            x, scale = None, 0.0
            count = int(np.count_nonzero(share >= NEGLIGIBLE))
            own = share, normals, self.work, self._rest, self._programmes[count].row, count
            if missing <= MISSING and count:
                body = self.masses, self.numbers, self.friction, rotation, q
                scale = write_programme(*body, *own)
                x = self._programmes[count].solve() if scale > 0.0 else None
            part = 0.0 if x is None else max(1.0 - float(x[-1]), 0.0)
            # The programme's round-off must not slow the robot down.
            if part >= WHOLE:
                part = 1.0
            else:
                remark = self._reason(normals, friction, demand, missing)
            if x is not None:
                friction, demand = take_solution(x, part, scale, *own)
            elif not remark:
                # The pyramids inside the cones are narrower than these.
                part = 1.0
        return Effort(self.torque.copy(), self.force.copy(), part, friction, demand, remark)

    def _reason(self, normals: np.ndarray, friction: float, demand: float, missing: float) -> str:
        """The limit for which the motion cannot be had, by the cheapest forces."""
        if missing > MISSING:
            return "the standing feet cannot carry the robot: fewer than three, or on one line."
        along, up = self._slope(normals)
        if along > self.friction * up:
            needed = f"{along / up:.2f}" if up > 0.0 else "any amount"
            return f"the feet need a friction of {needed} of {self.friction:.2f}."
        if demand > 1.0:
            torque = self.torque
            limit = np.where(torque > 0.0, self._limits[1], -self._limits[0]).ravel()
            share = np.abs(torque).ravel() / np.maximum(limit, 1e-12)
            worst = int(np.argmax(share))
            needed_torque = abs(float(torque.ravel()[worst]))
            return f"{self._names[worst]} needs {needed_torque:.2f} N·m of {limit[worst]:.2f}."
        if math.isinf(friction):
            return "a foot would have to pull at the ground."
        if friction > self.friction:
            return f"a foot needs a friction of {friction:.2f} of {self.friction:.2f}."
        return ""

    def _slope(self, normals: np.ndarray) -> tuple[float, float]:
        """The load along the ground, and across it, on a plane of the feet's mean normal [N]."""
        n = normals.mean(axis=0)
        load = self._needs.wrench[:3]
        up = float(load @ n) / max(float(np.linalg.norm(n)), 1e-12)
        return math.sqrt(max(float(load @ load) - up * up, 0.0)), up


WHOLE = 1.0 - 1e-6
"""A part of the motion that is taken for all of it."""
