"""Compiled functions of one control period: targets, rewards and observations of a batch."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled, internal
from phasmid.control.swing import blend, lift
from phasmid.kinematics.leg_kernels import inverse_kinematics
from phasmid.learning.episodes import Constants, Episodes, draw_command, uniform
from phasmid.learning.terrain import ground_height


@internal
def into_body(q: np.ndarray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a vector of world axes in the axes of a body with orientation q (w x y z)."""
    a, b, c, d = q[0], -q[1], -q[2], -q[3]
    tx, ty, tz = 2 * (c * z - d * y), 2 * (d * x - b * z), 2 * (b * y - c * x)
    return x + a * tx + c * tz - d * ty, y + a * ty + d * tx - b * tz, z + a * tz + b * ty - c * tx


@internal
def reference_leg(
    c: Constants, command: np.ndarray, phase: float, leg: int
) -> tuple[float, float, float]:
    """Return joint angles of a leg that walks as commanded, at a phase of the gait's cycle [rad].

    The foot moves against the body's velocity while it stands, about its neutral place, and swings
    back on the curve of the locomotion engine.
    """
    x, y, z = c.feet[leg]
    vx, vy = command[0] - command[2] * y, command[1] + command[2] * x
    half = (1 - c.swing) * c.period / 2
    own = (phase - c.lifts[leg]) % 1.0
    if own < c.swing:
        s = own / c.swing
        along, height = (2 * blend(s, 1.0)[0] - 1) * half, lift(s, 1.0, c.step_height)[0]
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
            goal = min(max(c.neutral[j] + c.scale * action, last - c.change), last + c.change)
            e.previous_target[n, j] = last
            e.target[n, j] = min(max(goal, c.limits[0, j]), c.limits[1, j])
            e.saturated[n, j] = 0.0
        e.work[n] = 0.0
        command = e.command[n]
        is_moving = command[0] != 0.0 or command[1] != 0.0 or command[2] != 0.0
        if is_moving:
            e.phase[n] = (e.phase[n] + c.dt / c.period) % 1.0
        for leg in range(len(c.lifts)):
            q = e.reference[n, 3 * leg : 3 * leg + 3]
            if is_moving:
                q[0], q[1], q[2] = reference_leg(c, command, e.phase[n], leg)
            else:
                q[:] = c.neutral[3 * leg : 3 * leg + 3]


@internal
def clearance(c: Constants, p: np.ndarray) -> tuple[float, float]:
    """Return the least height of the trunk's underside over the ground, and its mean height [m].

    The underside is taken at its middle and its corners.

    Args:
        c: Constants of the task.
        p: Position of the body, its orientation and joint angles, shape (7 + 3 L,).
    """
    least, mean = math.inf, 0.0
    w, x, y, z = p[3], p[4], p[5], p[6]
    for corner in range(5):
        a = 0.0 if corner == 0 else c.trunk[0] * (1.0 if corner % 2 else -1.0)
        b = 0.0 if corner == 0 else c.trunk[1] * (1.0 if corner > 2 else -1.0)
        # The inverse of a rotation turns back.
        dx, dy, dz = into_body(np.array([w, -x, -y, -z]), a, b, c.underside)
        ground = ground_height(c.terrain, p[0] + dx, p[1] + dy)
        least, mean = min(least, p[2] + dz - ground), mean + ground / 5
    return least, p[2] - mean


@compiled
def end_period(
    c: Constants,
    e: Episodes,
    qpos: np.ndarray,
    qvel: np.ndarray,
    sensors: np.ndarray,
    rewards: np.ndarray,
    fell: np.ndarray,
    ids: np.ndarray,
) -> None:
    """Compute the rewards of a control period, and which robots fell in it.

    Args:
        c: Constants of the task.
        e: Episodes, changed in place.
        qpos: Positions of the bodies, orientations and joint angles, shape (N, 7 + 3 L).
        qvel: Velocities, shape (N, 6 + 3 L).
        sensors: Readings of the model of `learning_model`, shape (N, 7 L).
        rewards: Written, shape (N,).
        fell: Written, shape (N,).
        ids: The robots.
    """
    legs = len(c.lifts)
    joints = 3 * legs
    memory = c.dt / (2 * c.period)
    for n in ids:
        e.step[n] += 1
        p, v, command = qpos[n], qvel[n], e.command[n]
        quaternion = p[3:7]
        gx, gy, up = into_body(quaternion, 0.0, 0.0, 1.0)
        vx, vy, vz = into_body(quaternion, v[0], v[1], v[2])
        is_finite = math.isfinite(up) and math.isfinite(vx) and np.all(np.isfinite(p[7:]))
        least, height = clearance(c, p) if is_finite else (-1.0, 0.0)
        fell[n] = not is_finite or up < c.fallen or least < 0.0
        e.fell[n] = fell[n]
        if not is_finite:
            rewards[n] = c.weights[-1]
            e.sums[n, -1] += c.weights[-1]
            continue
        is_moving = command[0] != 0.0 or command[1] != 0.0 or command[2] != 0.0

        slip, on_time, uneven = 0.0, 0.0, 0.0
        for leg in range(legs):
            touches = sensors[n, 4 * leg] > 0.0
            x, y, z = sensors[n, 4 * legs + 3 * leg : 4 * legs + 3 * leg + 3]
            if touches and e.contact[n, leg] > 0.0 and e.step[n] > 1:
                slip += math.hypot(x - e.foot[n, leg, 0], y - e.foot[n, leg, 1]) / c.dt
            e.foot[n, leg, 0], e.foot[n, leg, 1], e.foot[n, leg, 2] = x, y, z
            e.contact[n, leg] = 1.0 if touches else 0.0
            e.force[n, leg] = sensors[n, 4 * leg + 3]
            if is_moving:
                e.duty[n, leg] += memory * (e.contact[n, leg] - e.duty[n, leg])
            stands = not is_moving or (e.phase[n] - c.lifts[leg]) % 1.0 >= c.swing
            on_time += 1.0 if stands == touches else 0.0
        for leg in range(legs):
            uneven += (e.duty[n, leg] - e.duty[n, c.mirror[leg]]) ** 2

        torque, change, distance, motion = 0.0, 0.0, 0.0, 0.0
        for j in range(joints):
            torque += (e.torque[n, j] / c.stall) ** 2
            change += (e.action[n, j] - e.previous_action[n, j]) ** 2
            distance += (p[7 + j] - e.reference[n, j]) ** 2
            motion += v[6 + j] ** 2
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
            math.exp(-error / c.velocity_scale**2),
            math.exp(-turning / c.yaw_scale**2),
            math.exp(-distance / joints / c.reference_scale**2),
            on_time / legs,
            vz * vz,
            v[3] * v[3] + v[4] * v[4],
            gx * gx + gy * gy,
            (height - c.height) ** 2,
            torque / joints,
            e.work[n] / c.dt,
            change / joints,
            slip,
            uneven / legs,
            0.0 if is_moving else motion / joints,
            # Once per fall, whatever the control period.
            1.0 / c.dt if fell[n] else 0.0,
        )
        total = 0.0
        for i in range(len(terms)):
            part = c.weights[i] * terms[i]
            e.sums[n, i] += part
            total += part
        rewards[n] = total

        if e.step[n] % c.command_steps == 0:
            draw_command(c, e, n)
        if c.push > 0.0 and e.step[n] % c.push_steps == 0:
            qvel[n, 0] += uniform(e.random, n, -c.push, c.push)
            qvel[n, 1] += uniform(e.random, n, -c.push, c.push)


@compiled
def observe(
    c: Constants,
    e: Episodes,
    qpos: np.ndarray,
    qvel: np.ndarray,
    has_clock: bool,
    has_contacts: bool,
    actor: np.ndarray,
    privileged: np.ndarray,
    ids: np.ndarray,
) -> None:
    """Write the latest observations.

    Args:
        c: Constants of the task.
        e: Episodes; their random numbers advance.
        qpos: Shape (N, 7 + 3 L).
        qvel: Shape (N, 6 + 3 L).
        has_clock: Whether the actor observes the gait's clock.
        has_contacts: Whether the actor observes the contacts.
        actor: Written as of `observation_names`, shape (N, A).
        privileged: Written as of `privileged_names`, shape (N, P).
        ids: The robots.
    """
    joints, legs = len(c.neutral), len(c.lifts)
    for n in ids:
        quaternion, command = qpos[n, 3:7], e.command[n]
        gravity = into_body(quaternion, 0.0, 0.0, -1.0)
        row, k = actor[n], 0
        for i in range(3):
            noise = uniform(e.random, n, -c.gyro_noise, c.gyro_noise)
            row[k + i] = 0.25 * (qvel[n, 3 + i] + noise)
        k += 3
        for i in range(3):
            row[k + i] = gravity[i] + uniform(e.random, n, -c.gravity_noise, c.gravity_noise)
        k += 3
        for j in range(joints):
            noise = e.joint_offset[n, j] + uniform(e.random, n, -c.joint_noise, c.joint_noise)
            row[k + j] = qpos[n, 7 + j] - c.neutral[j] + noise
            row[k + joints + j] = 0.1 * qvel[n, 6 + j]
            row[k + 2 * joints + j] = e.action[n, j]
        k += 3 * joints
        for i in range(3):
            row[k + i] = command[i] / c.largest[i] if c.largest[i] > 0.0 else 0.0
        k += 3
        if has_clock:
            is_moving = command[0] != 0.0 or command[1] != 0.0 or command[2] != 0.0
            angle = 2 * math.pi * e.phase[n]
            row[k] = math.sin(angle) if is_moving else 0.0
            row[k + 1] = math.cos(angle) if is_moving else 0.0
            k += 2
        if has_contacts:
            row[k : k + legs] = e.contact[n]

        row, k = privileged[n], 9
        row[0], row[1], row[2] = into_body(quaternion, qvel[n, 0], qvel[n, 1], qvel[n, 2])
        row[3] = clearance(c, qpos[n])[1] - c.height
        row[4], row[5], row[6] = e.friction[n], e.mass[n], e.payload[n]
        row[7], row[8] = e.strength[n], e.gain[n]
        row[k : k + legs] = e.force[n]
        row[k + legs : k + 2 * legs] = e.contact[n]
        is_damaged = e.step[n] >= e.damage_step[n]
        for j in range(joints):
            row[k + 2 * legs + j] = e.dies[n, j] if is_damaged else 0.0


def observation_names(joints: list[str], legs: list[str], clock: bool, contacts: bool) -> list[str]:
    """Return the names of the actor's observations, shape (A,)."""
    names = [f"gyro.{axis} / 4" for axis in "xyz"]
    names += [f"gravity.{axis}" for axis in "xyz"]
    names += [f"{joint} position - neutral" for joint in joints]
    names += [f"{joint} velocity / 10" for joint in joints]
    names += [f"{joint} last action" for joint in joints]
    names += [f"command.{axis} / largest" for axis in ("forward", "left", "yaw")]
    names += ["clock.sin", "clock.cos"] if clock else []
    names += [f"{leg} contact" for leg in legs] if contacts else []
    return names


def privileged_names(joints: list[str], legs: list[str]) -> list[str]:
    """Return the names of the critic's privileged observations, shape (P,)."""
    names = [f"velocity.{axis}" for axis in ("forward", "left", "up")]
    names += ["height - neutral", "friction", "mass factor", "payload", "strength", "gain"]
    names += [f"{leg} force" for leg in legs] + [f"{leg} contact" for leg in legs]
    return names + [f"{joint} dead" for joint in joints]
