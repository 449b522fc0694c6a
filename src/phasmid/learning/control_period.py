"""Compiled functions of one control period: joint targets and rewards of a batch."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.swing import blend, lift
from phasmid.kinematics.leg_kernels import inverse_kinematics
from phasmid.kinematics.vector_kernels import rotate_by
from phasmid.learning.episodes import Constants, Episodes, States, draw_command, uniform
from phasmid.learning.terrain import ground_height

UPRIGHT = math.cos(1.0)
"""Cosine of the tilt beyond which a robot has fallen, 1 rad."""


@compiled
def into_body(q: np.ndarray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a vector of world axes in the axes of a body with orientation q (w x y z)."""
    return rotate_by(q[0], -q[1], -q[2], -q[3], (x, y, z))


@compiled
def reference_leg(
    c: Constants, command: np.ndarray, phase: float, leg: int
) -> tuple[float, float, float]:
    """Return joint angles of a leg that walks as commanded, at a phase of the gait's cycle [rad].

    The foot moves against the body's velocity while it stands, about its neutral place, and swings
    back on the curve of the locomotion engine.
    """
    x, y, z = c.feet[leg]
    vx, vy = command[0] - command[2] * y, command[1] + command[2] * x
    half = (1 - c.swing) * c.task.gait.period / 2
    own = (phase - c.lifts[leg]) % 1.0
    if own < c.swing:
        s = own / c.swing
        along, height = (2 * blend(s, 1.0)[0] - 1) * half, lift(s, 1.0, c.task.gait.step_height)[0]
    else:
        along, height = (1 - 2 * (own - c.swing) / (1 - c.swing)) * half, 0.0
    dx, dy = x + vx * along - c.hips[leg, 0], y + vy * along - c.hips[leg, 1]
    dz, R = z + height - c.hips[leg, 2], c.R_body_hip[leg]
    q1, q2, q3, _ = inverse_kinematics(
        c.lengths[leg],
        c.left[leg],
        R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz,
        R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz,
        R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz,
        1.0,
    )
    return q1, q2, q3


@compiled
def begin_period(c: Constants, e: Episodes, actions: np.ndarray, ids: np.ndarray) -> None:
    """Convert actions to joint targets, and advance the gait's clock.

    Args:
        c: Constants of the task.
        e: Episodes, changed in place.
        actions: Shape (N, 3 L); clipped to [-1, 1].
        ids: The robots.
    """
    for n in ids:
        for j in range(len(c.neutral)):
            action = min(max(actions[n, j], -1.0), 1.0)
            if not math.isfinite(action):
                action = 0.0
            e.previous_action[n, j], e.action[n, j] = e.action[n, j], action
            last = e.target[n, j]
            goal = min(
                max(c.neutral[j] + c.task.action.scale * action, last - c.change), last + c.change
            )
            e.previous_target[n, j] = last
            e.target[n, j] = min(max(goal, c.limits[0, j]), c.limits[1, j])
            e.saturated[n, j] = 0.0
        e.work[n] = 0.0
        command = e.command[n]
        is_moving = command[0] != 0.0 or command[1] != 0.0 or command[2] != 0.0
        if is_moving:
            e.phase[n] = (e.phase[n] + c.dt / c.task.gait.period) % 1.0
        for leg in range(len(c.lifts)):
            q = e.reference[n, 3 * leg : 3 * leg + 3]
            if is_moving:
                q[0], q[1], q[2] = reference_leg(c, command, e.phase[n], leg)
            else:
                q[:] = c.neutral[3 * leg : 3 * leg + 3]


@compiled
def clearance(c: Constants, p: np.ndarray) -> tuple[float, float]:
    """Return the least height of the trunk's underside over the ground, and its mean height [m].

    The underside is taken at its middle and its corners.

    Args:
        c: Constants of the task.
        p: Position of the body, its orientation and joint angles, shape (7 + 3 L,).
    """
    least, mean = math.inf, 0.0
    w, x, y, z = p[3], p[4], p[5], p[6]
    for point in c.underside:
        dx, dy, dz = rotate_by(w, x, y, z, (point[0], point[1], point[2]))
        ground = ground_height(c.terrain, p[0] + dx, p[1] + dy)
        least, mean = min(least, p[2] + dz - ground), mean + ground / 5
    return least, p[2] - mean


@compiled
def end_period(c: Constants, e: Episodes, s: States, ids: np.ndarray) -> None:
    """Compute the rewards of a control period, and which robots fell in it.

    Args:
        c: Constants of the task.
        e: Episodes, changed in place.
        s: States; pushes change velocities.
        ids: The robots.
    """
    weights, rewards, push = c.weights, c.task.rewards, c.task.randomisation.push
    legs = len(c.lifts)
    joints = 3 * legs
    memory = c.dt / (2 * c.task.gait.period)
    for n in ids:
        e.step[n] += 1
        p, v, command = s.qpos[n], s.qvel[n], e.command[n]
        quaternion = p[3:7]
        gx, gy, up = into_body(quaternion, 0.0, 0.0, 1.0)
        # Mean velocity of the period, which a step's rhythm changes less than that of its end.
        x, y, z = (p[0] - e.position[n, 0], p[1] - e.position[n, 1], p[2] - e.position[n, 2])
        vx, vy, _ = into_body(quaternion, x / c.dt, y / c.dt, z / c.dt)
        vz = into_body(quaternion, v[0], v[1], v[2])[2]
        e.position[n] = p[:3]
        is_finite = math.isfinite(up) and math.isfinite(vx) and np.all(np.isfinite(p[7:]))
        least, height = clearance(c, p) if is_finite else (-1.0, 0.0)
        e.fell[n] = not is_finite or up < UPRIGHT or least < 0.0
        if not is_finite:
            e.reward[n] = weights[-1]
            e.sums[n, -1] += weights[-1]
            continue
        is_moving = command[0] != 0.0 or command[1] != 0.0 or command[2] != 0.0

        slip, on_time, uneven = 0.0, 0.0, 0.0
        for leg in range(legs):
            touches = s.sensors[n, 4 * leg] > 0.0
            x, y, z = s.sensors[n, 4 * legs + 3 * leg : 4 * legs + 3 * leg + 3]
            if touches and e.contact[n, leg] > 0.0 and e.step[n] > 1:
                slip += math.hypot(x - e.foot[n, leg, 0], y - e.foot[n, leg, 1]) / c.dt
            e.foot[n, leg, 0], e.foot[n, leg, 1], e.foot[n, leg, 2] = x, y, z
            e.contact[n, leg] = 1.0 if touches else 0.0
            e.force[n, leg] = s.sensors[n, 4 * leg + 3]
            if is_moving:
                e.duty[n, leg] += memory * (e.contact[n, leg] - e.duty[n, leg])
            stands = not is_moving or (e.phase[n] - c.lifts[leg]) % 1.0 >= c.swing
            on_time += 1.0 if stands == touches else 0.0
        for leg in range(legs):
            uneven += (e.duty[n, leg] - e.duty[n, c.mirror[leg]]) ** 2

        torque, change, distance, motion = 0.0, 0.0, 0.0, 0.0
        for j in range(joints):
            torque += (e.torque[n, j] / c.stall) ** 2
            distance += (p[7 + j] - e.reference[n, j]) ** 2
            motion += v[6 + j] ** 2
        for j in range(e.action.shape[1]):
            change += (e.action[n, j] - e.previous_action[n, j]) ** 2
        # Yaw counts by the way of the feet.
        arm = math.hypot(c.feet[0, 0], c.feet[0, 1])
        size = math.sqrt(command[0] ** 2 + command[1] ** 2 + (arm * command[2]) ** 2)
        if is_moving:
            along = vx * command[0] + vy * command[1] + arm * arm * v[5] * command[2]
            e.progress[n] += c.dt * along / size
            e.wanted[n] += c.dt * size
        error = (vx - command[0]) ** 2 + (vy - command[1]) ** 2
        turning = (v[5] - command[2]) ** 2
        terms = (
            math.exp(-error / rewards.velocity_scale**2),
            math.exp(-turning / rewards.yaw_scale**2),
            math.exp(-distance / joints / rewards.reference_scale**2),
            on_time / legs,
            vz * vz,
            v[3] * v[3] + v[4] * v[4],
            gx * gx + gy * gy,
            (height - c.height) ** 2,
            torque / joints,
            e.work[n] / c.dt,
            change / e.action.shape[1],
            slip,
            uneven / legs,
            0.0 if is_moving else motion / joints,
            # Once per fall, whatever the control period.
            1.0 / c.dt if e.fell[n] else 0.0,
        )
        total = 0.0
        for i in range(len(terms)):
            part = weights[i] * terms[i]
            e.sums[n, i] += part
            total += part
        e.reward[n] = total

        if e.step[n] % c.command_steps == 0:
            draw_command(c, e, n)
        if push > 0.0 and e.step[n] % c.push_steps == 0:
            s.qvel[n, 0] += uniform(e.random, n, -push, push)
            s.qvel[n, 1] += uniform(e.random, n, -push, push)
