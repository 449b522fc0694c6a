"""Feed-forward torque of the engine's motion, and slower motion where limits forbid all of it."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.compiled import compiled
from phasmid.control import types as engine
from phasmid.control.feed_forward.contact_force_qp import (
    apply_solution,
    limit_forces,
    write_programme,
)
from phasmid.control.feed_forward.inverse_dynamics import solve_inverse_dynamics
from phasmid.control.feed_forward.load_sharing import load_joints, share_load
from phasmid.control.feed_forward.settings import FeedForwardSettings
from phasmid.control.feed_forward.state import (
    Motion,
    Parameters,
    State,
    parameters_of,
)
from phasmid.control.memory import MEMORY
from phasmid.control.records import fill, view_of
from phasmid.control.types import LegPhase
from phasmid.kinematics.vector_kernels import quintic
from phasmid.robot import JOINTS, Robot

MISSING = 1e-6
"""Part of the load that may be missing without an event."""

LEAST_SHARE = 1e-3
"""Load share of a foot that is about to lift or has just landed. Feet that all have this share
carry the whole load."""

SLOWER, FASTER = 2.0, 0.25
"""Rates at which the velocity is reduced while limits forbid it, and restored [1/s]."""


@compiled
def update_load_shares(
    engine_state: engine.State, reference: engine.Reference, state: State, robot: Parameters
) -> None:
    """Advance the load shares, which move smoothly after touchdown and before lift-off.

    Args:
        engine_state: Gait phase and stance of the engine.
        reference: Phases at which the legs lift, and the ground's plane.
        state: `load_share`, `time_since_touchdown` and `normals` are written.
        robot: Transfer time and update period.
    """
    clock, transfer, dt = engine_state.clock, robot.load_transfer, robot.update_period
    for leg in range(state.leg_count):
        state.normals[leg] = reference.ground_normal
        if engine_state.leg_phase[leg] != LegPhase.STANCE:
            state.time_since_touchdown[leg] = state.load_share[leg] = 0.0
            continue
        state.time_since_touchdown[leg] += dt
        share = 1.0
        if transfer > 0.0:
            time = min(state.time_since_touchdown[leg], transfer)
            if clock.gait_running == 1 and reference.walks == 1:
                time = min(time, (reference.lift_phase[leg] - clock.phase) % 1.0 * reference.period)
            share, _, _ = quintic(time / transfer)
            # A lift may come earlier or later than the gait schedules it.
            most, before = 2.0 * dt / transfer, state.load_share[leg]
            share = min(max(share, before - most), before + most)
        state.load_share[leg] = max(share, LEAST_SHARE)


@compiled
def set_motion(engine_state: engine.State, motion: Motion) -> None:
    """Write the engine's motion, whose time may run slower than the clock."""
    rate = engine_state.clock.time_scale
    motion.R_world_body[:] = engine_state.R_odom_body
    motion.angular_velocity[:] = rate * engine_state.angular_velocity
    motion.angular_acceleration[:] = rate**2 * engine_state.angular_acceleration
    motion.acceleration[:] = rate**2 * engine_state.body_acceleration
    motion.q[:] = engine_state.q
    motion.qd[:] = rate * engine_state.qd
    motion.qdd[:] = rate**2 * engine_state.qdd


@compiled
def solve(state: State, robot: Parameters) -> None:
    """Write the cheapest foot forces of the motion, torques, friction and torque utilisation."""
    solve_inverse_dynamics(robot, state.motion, state.normals, state.required)
    # Torque falls with the speed in its own direction.
    loss = robot.torque_drop * state.motion.qd
    state.torque_limits[1] = np.maximum(robot.stall_torque - np.maximum(loss, 0.0), 0.0)
    state.torque_limits[0] = np.minimum(-robot.stall_torque - np.minimum(loss, 0.0), 0.0)
    share_load(state)
    load_joints(state)
    state.motion_scale = 1.0


@compiled
def release_pulling_feet(state: State) -> bool:
    """Set the share of feet to 0 that have the least share and would pull; True if any does."""
    pulls = False
    for leg in range(state.leg_count):
        normal_force = state.foot_force[leg] @ state.normals[leg]
        if state.load_share[leg] == LEAST_SHARE and normal_force < 0.0:
            state.load_share[leg] = 0.0
            pulls = True
    return pulls


@compiled
def compute_feed_forward(
    engine_state: engine.State, reference: engine.Reference, state: State, robot: Parameters
) -> None:
    """Write the feed-forward of the engine's present motion.

    Args:
        engine_state: State of the locomotion engine.
        reference: Its reference.
        state: Changed.
        robot: Parameters of the robot.
    """
    update_load_shares(engine_state, reference, state, robot)
    set_motion(engine_state, state.motion)
    solve(state, robot)
    if math.isinf(state.friction):
        shares = state.load_share.copy()
        if not release_pulling_feet(state):
            return
        share_load(state)
        load_joints(state)
        if (
            not state.missing <= MISSING
            or math.isinf(state.friction)
            or state.torque_utilisation > 1.0
        ):
            # The other feet cannot carry the robot, pull themselves, or need too much torque.
            state.load_share[:] = shares
            share_load(state)
            load_joints(state)


class FeedForward:
    """Feed-forward torques of a motion, with foot forces within friction and torque limits.

    Args:
        robot: The robot, L legs.
        settings: Limits.
        update_period: Time from one update to the next [s].
        memory: Record of one engine, shape (1,); None for a new one.

    Attributes:
        state: Motion, loads and result of the last update.
        parameters: Parameters of the robot; limits may be changed at any time.
        velocity_scale: Part of the feasible velocity that limits have allowed so far.
        limit_reason: Sentence on the limit that the last motion exceeds; empty where none.
    """

    def __init__(
        self,
        robot: Robot,
        settings: FeedForwardSettings | None = None,
        update_period: float = 0.005,
        *,
        gravity: float,
        memory: np.ndarray | None = None,
    ) -> None:
        legs = len(robot.legs)
        memory = np.zeros(1, MEMORY) if memory is None else memory
        self._states, self._robots = memory["feed_forward"], memory["feed_forward_parameters"]
        self.state: State = view_of(self._states, State, legs)
        self.parameters: Parameters = view_of(self._robots, Parameters, legs)
        settings = settings or FeedForwardSettings()
        fill(self.parameters, parameters_of(robot, settings, update_period, gravity))
        self._names = [f"{leg}.{joint}" for leg in robot.leg_names for joint in JOINTS]
        self._states["leg_count"] = legs
        self.reset()

    def reset(self) -> None:
        """Begin with all feet on the ground and carrying."""
        self.state.load_share[:] = 1.0
        self.state.time_since_touchdown[:] = self.parameters.load_transfer
        self.velocity_scale, self.limit_reason = 1.0, ""
        # This compiles both, for which no update has time.
        write_programme(self._states, self._robots)
        apply_solution(self._states, np.zeros(3 * self.state.leg_count + 1))

    def apply_limits(self) -> Float[np.ndarray, "legs 3"]:
        """Return the joint torques [N·m] within the limits; adapt the velocity scale to them.

        Call it after `compute_feed_forward`.
        """
        self._limit_motion()
        dt = self.parameters.update_period
        if self.state.motion_scale < 1.0:
            self.velocity_scale *= 1.0 - SLOWER * dt
        else:
            self.velocity_scale = min(1.0, self.velocity_scale + FASTER * dt)
        return self.state.joint_torque.copy()

    def _limit_motion(self) -> None:
        """Reduce motion and forces to the limits of friction and servos, and write the reason."""
        state, robot = self.state, self.parameters
        self.limit_reason = ""
        # Written so that NaN exceeds every limit.
        if (
            state.friction <= robot.friction
            and state.torque_utilisation <= 1.0
            and state.missing <= MISSING
        ):
            return
        self.limit_reason = self._reason()
        if state.missing <= MISSING and limit_forces(self._states, self._robots):
            if state.motion_scale == 1.0:
                self.limit_reason = ""
            return
        # Where no limit but the pyramid inside the cone is exceeded, the motion is feasible.
        state.motion_scale = 0.0 if self.limit_reason else 1.0

    def _reason(self) -> str:
        """Return a sentence on the limit that the cheapest forces exceed."""
        state, most = self.state, self.parameters.friction
        if state.missing > MISSING:
            return "the standing feet cannot carry the robot: fewer than three, or on one line."
        # Load along the ground and across it, on a plane with the feet's mean normal.
        n, load = state.normals.mean(axis=0), state.required.wrench[:3]
        up = float(load @ n) / max(float(np.linalg.norm(n)), 1e-12)
        along = math.sqrt(max(float(load @ load) - up * up, 0.0))
        if along > most * up:
            needed = f"{along / up:.2f}" if up > 0.0 else "any amount"
            return f"the feet need a friction of {needed} of {most:.2f}."
        torque, limits = state.joint_torque, state.torque_limits
        if state.torque_utilisation > 1.0:
            limit = np.where(torque > 0.0, limits[1], -limits[0]).ravel()
            worst = int(np.argmax(np.abs(torque).ravel() / np.maximum(limit, 1e-12)))
            needed = f"{abs(float(torque.flat[worst])):.2f}"
            return f"{self._names[worst]} needs {needed} N·m of {limit[worst]:.2f}."
        if math.isinf(state.friction):
            return "a foot would have to pull at the ground."
        if state.friction > most:
            return f"a foot needs a friction of {state.friction:.2f} of {most:.2f}."
        return ""
