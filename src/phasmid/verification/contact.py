"""Feet on the ground: forces and accelerations, standing, and impact."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.dynamics import BodyMotion, inverse_dynamics, kinetic_energy, potential_energy
from phasmid.kinematics import (
    body_from_hip,
    centre_of_mass,
    foot_position,
    link_frames,
    quaternion_rotation,
    rpy_quaternion,
)
from phasmid.motion import plan
from phasmid.robot import Robot
from phasmid.simulation import Run
from phasmid.verification.engine import (
    Touch,
    contact_points,
    hold,
    joint_state,
    touching,
    trunk_motion,
)
from phasmid.verification.laboratory import Laboratory
from phasmid.verification.row import Row, reading, seen

if TYPE_CHECKING:
    import mujoco

INSTANTS = (0.1, 0.37, 1.05, 1.62)
"""Instants of the walk at which the engine's forces are compared [s]."""

SOLVED = 1e-24
"""The solver's tolerance at which its iterations end in round-off."""

DROPS = 12
"""How often the robot is dropped, from random heights and askew."""

HIGHEST, STEEPEST = 0.15, 0.4
"""From how high at the most [m], and rolled and pitched by how much [rad]."""


def forward_and_inverse(laboratory: Laboratory) -> Iterator[Row]:
    """The engine's accelerations in contact, put into our inverse dynamics and into its own."""
    import mujoco

    torque, wrench, own, as_run = np.zeros((4, len(INSTANTS)))
    points = 0
    for k, instant in enumerate(INSTANTS):
        scenario = laboratory.scenario.replace(duration=instant)
        run = Run(scenario, plan(scenario))
        run.advance()
        model, data = run.model, run.data
        mujoco.mj_inverse(model, data)
        as_run[k] = np.abs(data.qfrc_inverse).max()
        model.opt.tolerance = SOLVED
        mujoco.mj_forward(model, data)
        touch = touching(run.robot, model, data)
        points += len(touch.leg)
        needed, missing = _needs(run.robot, data, touch, scenario.model.gravity)
        torque[k] = np.abs(needed - run.drive.torque()).max()
        wrench[k] = np.abs(missing).max()
        mujoco.mj_inverse(model, data)
        own[k] = np.abs(data.qfrc_inverse).max()
    why = "Sums of some hundred terms below 100 N, rounded by 1e-14 N each; the solver at its end."
    yield reading("torques, our recursion", torque.max(), 1e-9, why, unit="N·m")
    yield reading("left on the trunk, ours", wrench.max(), 1e-9, why, unit="N, N·m")
    yield reading("the engine's own inverse", own.max(), 1e-9, why, unit="N, N·m")
    yield reading(
        "left by the solver in a run",
        as_run.max(),
        None,
        "What the engine's solver leaves unbalanced where it stops by its own tolerance of "
        "1e-8, as in every run.",
        unit="N, N·m",
    )
    yield seen(points, "points that touch, all instants together")


def static_depth(laboratory: Laboratory) -> Iterator[Row]:
    """Mean depth of the points that touch, the robot at rest on six feet.

    The number of points that must share the weight comes from the robot, not from the engine.
    """
    run = laboratory.standing()
    for _ in hold(run, 1000):
        pass
    contact, weight = run.scenario.contact, run.robot.mass * run.scenario.model.gravity
    depth = touching(run.robot, run.model, run.data).depth
    yield reading(
        f"mean of {contact_points(run.robot)} points",
        float(depth.mean()) if len(depth) else math.nan,
        1e-9,
        "Springs are exact at rest; after 2 s what is left of the motion is below 1e-12 m.",
        unit="m",
        expected=weight / (contact_points(run.robot) * contact.stiffness),
    )


def standing(laboratory: Laboratory) -> Iterator[Row]:
    """Sum and moment of the ground's forces about the centre of mass, six feet."""
    run = laboratory.standing()
    robot, data = run.robot, run.data
    for _ in hold(run, 1000):
        pass
    touch = touching(robot, run.model, data)
    body, (q, _, _) = trunk_motion(data), joint_state(data)
    centre = body.position + body.rotation @ centre_of_mass(robot, q)
    force = touch.force.sum(axis=0)
    moment = np.cross(touch.position - centre, touch.force).sum(axis=0)
    weight = robot.mass * run.scenario.model.gravity
    reach = float(np.linalg.norm(robot.legs[0].neutral_foot + robot.legs[0].mount_position))
    why = "Equilibrium; after 2 s what accelerates is below 1e-7 of gravity."
    yield reading("ΣF / mg", force[2] / weight, 1e-6, why, expected=1.0)
    yield reading("ΣM / (mg · reach)", np.abs(moment).max() / (weight * reach), 1e-6, why)
    yield reading("ΣF along the ground / mg", np.abs(force[:2]).max() / weight, 1e-6, why)


def impact_energy(laboratory: Laboratory) -> Iterator[Row]:
    """Energy from the last instant before each touch to the first after it; drops, joints held."""
    gained, rng = [0.0], np.random.default_rng(20)
    for _ in range(DROPS):
        height = rng.uniform(0.01, HIGHEST)
        roll, pitch = rng.uniform(-STEEPEST, STEEPEST, 2)
        run = laboratory.standing()
        data = run.data
        # No foot is farther than 0.3 m from the middle.
        data.qpos[2] += height + 0.3 * (abs(roll) + abs(pitch))
        data.qpos[3:7] = rpy_quaternion(*np.array([roll, pitch, 0.0]))
        data.qpos[7:] = run.walk.q[0].ravel()
        data.qvel[:] = 0.0
        before, touched = _State.of(data), False
        for _ in hold(run, 600):
            # The engine's contacts are those at the step's start, its state that at the end.
            if data.ncon:
                touched = True
                continue
            after = _State.of(data)
            if touched:
                gained.append(_energy(run, after) - _energy(run, before))
            before, touched = after, False
    yield reading(
        "most that any impact gained",
        np.max(gained),
        1e-9,
        "Springs and dampers give back less than they take; round-off of 1 J is 1e-16 J.",
        unit="J",
    )
    yield seen(len(gained) - 1, "impacts")


def _needs(
    robot: Robot, data: mujoco.MjData, touch: Touch, gravity: float
) -> tuple[Float[np.ndarray, " joints"], Float[np.ndarray, "6"]]:
    """Return joint torques, and the missing wrench on the trunk, with forces at the contact points.

    The recursion takes each foot's force at its tip; that the points are beside it makes a moment,
    of which every joint of the leg carries the part along its axis.
    """
    body, (q, qd, qdd) = trunk_motion(data), joint_state(data)
    inside = body_from_hip(robot, foot_position(robot.arrays, q))
    feet = body.position + inside @ body.rotation.T
    force, moment = np.zeros((2, len(robot.legs), 3))
    np.add.at(force, touch.leg, touch.force)
    np.add.at(moment, touch.leg, np.cross(touch.position - feet[touch.leg], touch.force))
    joint, wrench = inverse_dynamics(robot, body, q, qd, qdd, foot_force=force, gravity=gravity)
    axes = body.rotation @ link_frames(robot, q).rotation[..., 2, None]
    beside = np.einsum("ljx,lx->lj", axes[..., 0], moment)
    total = np.concatenate([np.zeros(3), moment.sum(axis=0)])
    return (joint - beside).ravel(), wrench - total


class _State(NamedTuple):
    """Positions and velocities of the engine at one instant."""

    qpos: Float[np.ndarray, " q"]
    qvel: Float[np.ndarray, " v"]

    @classmethod
    def of(cls, data: mujoco.MjData) -> _State:
        return cls(data.qpos.copy(), data.qvel.copy())


def _energy(run: Run, state: _State) -> float:
    rotation = quaternion_rotation(state.qpos[3:7])
    zero = np.zeros(3)
    body = BodyMotion(
        state.qpos[:3], rotation, state.qvel[:3], rotation @ state.qvel[3:6], zero, zero
    )
    q, qd = (row.reshape(-1, 3) for row in (state.qpos[7:], state.qvel[6:]))
    g = run.scenario.model.gravity
    kinetic = kinetic_energy(run.robot, body, q, qd)
    return float(kinetic + potential_energy(run.robot, body, q, gravity=g))
