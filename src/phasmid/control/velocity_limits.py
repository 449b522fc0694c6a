"""How fast a gait may go: its steady walk, judged at every part of a cycle."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.control.body_kernels import moment_of, rotation, support_margin, to_hip
from phasmid.control.foothold_region import lift_lag, reaches, region_share, sway_wave
from phasmid.control.reach_bounds import PLANNED
from phasmid.control.swing import blend, lift
from phasmid.control.trunk import integrate_twist
from phasmid.control.types import REACH, SPEED, SUPPORT, Model, Parameters, Reference
from phasmid.kinematics.leg_kernels import joint_motion

SAMPLES = 32
"""Parts of a cycle at which a steady walk is looked at."""

CLOSE = 1e-3
"""Largest velocities are found to this part of them, the scale of a command to four times it."""


@compiled
def gait_is_feasible(
    model: Model,
    parameters: Parameters,
    region: np.ndarray,
    reference: Reference,
    pose: np.ndarray,
    velocity: np.ndarray,
    verdict: np.ndarray,
) -> bool:
    """Whether a robot can walk steadily so; write what keeps it from that first.

    Args:
        model: The robot.
        parameters: The margins.
        region: Where the feet may stand at that pose, shape (L, K, 3).
        reference: Gait and height of a step.
        pose: Of the body beside its path and its neutral height, shape (6,).
        velocity: Of the path, ahead, left and turn, shape (3,).
        verdict: Written: what (`REACH` and so on, 0: nothing), the leg's index, the joint's, and
            the smallest support margin [m] or the largest share of a joint's speed, shape (4,).
    """
    legs, duty, period, lag = (
        model.leg_count,
        reference.duty_factor,
        reference.period,
        lift_lag(reference),
    )
    used, offsets = reference.used, reference.lift_phase
    verdict[0] = 0.0
    origin, home, there = np.zeros(3), np.empty(3), np.empty(3)
    lean = np.empty((3, 3))
    rotation(pose[3], pose[4], pose[5], lean)
    moment = np.empty(3)
    aside = np.empty((3, 2))
    feet, standing = np.zeros((legs, 3)), np.zeros(legs, dtype=np.int64)
    p, v, a, hip, vh = np.empty(3), np.empty(3), np.zeros(3), np.empty(3), np.empty(3)
    q, qd, qdd = np.empty(3), np.empty(3), np.empty(3)
    air = (1 - duty) * period
    fastest = model.joint_speed * parameters.planned_speed
    for leg in range(legs):
        if not used[leg]:
            continue
        nx, ny = model.neutral[leg, 0], model.neutral[leg, 1]
        for sign in (-1.0, 1.0):
            integrate_twist(
                origin, velocity, sign * duty * period / 2 + (lag if sign > 0 else 0.0), there
            )
            c, s = math.cos(there[2]), math.sin(there[2])
            x, y = nx - there[0], ny - there[1]
            dx, dy = c * x + s * y - nx, c * y - s * x - ny
            if reference.sway != 0.0:
                sway_wave(model, reference, offsets[leg] + (1 - duty if sign < 0 else 0.0), aside)
                dx, dy = dx - aside[0, 0], dy - aside[0, 1]
            if region_share(region[leg], dx, dy, 0.0) < 1.0:
                verdict[0], verdict[1], verdict[2] = REACH, leg, -1
                return False
    least, quickest = math.inf, 0.0
    for n in range(SAMPLES):
        phase = n / SAMPLES
        sway_wave(model, reference, phase, aside)
        bx, by = pose[0] + aside[0, 0], pose[1] + aside[0, 1]
        ux, uy = aside[1, 0] / period, aside[1, 1] / period
        for i in range(3):
            moment[i] = model.body_moment[i]
        for leg in range(legs):
            if not used[leg]:
                standing[leg] = 0
                moment_of(model, leg, model.folded[leg], moment)
                continue
            nx, ny = model.neutral[leg, 0], model.neutral[leg, 1]
            own = (phase - offsets[leg]) % 1.0
            # The foot seen from the path: fixed points of the ground pass by it.
            if own >= 1 - duty:
                standing[leg] = 1
                integrate_twist(origin, velocity, (own - 1 + duty / 2) * period, there)
                gx, gy, fx, fy, z, vz = nx, ny, 0.0, 0.0, 0.0, 0.0
            else:
                standing[leg] = 0
                # From the last place to the next, a cycle on; seen amid the last stance.
                integrate_twist(origin, velocity, (own + duty / 2) * period, there)
                integrate_twist(origin, velocity, period, home)
                c, s = math.cos(home[2]), math.sin(home[2])
                wx = home[0] + c * nx - s * ny - nx
                wy = home[1] + s * nx + c * ny - ny
                part = own / (1 - duty)
                way, rate, _ = blend(part, air)
                gx, gy, fx, fy = nx + way * wx, ny + way * wy, rate * wx, rate * wy
                z, vz, _ = lift(part, air, reference.step_height)
            c, s = math.cos(there[2]), math.sin(there[2])
            x, y = gx - there[0], gy - there[1]
            px, py = c * x + s * y, c * y - s * x
            vx = c * fx + s * fy - velocity[0] + velocity[2] * py
            vy = c * fy - s * fx - velocity[1] - velocity[2] * px
            feet[leg, 0], feet[leg, 1] = px, py
            p[0], p[1], p[2] = px - bx, py - by, z - model.height - pose[2]
            v[0], v[1], v[2] = vx - ux, vy - uy, vz
            to_hip(lean, p, hip)
            for i in range(3):
                hip[i] -= model.p_body_hip[leg, i]
            to_hip(model.R_body_hip[leg], hip, p)
            to_hip(lean, v, hip)
            to_hip(model.R_body_hip[leg], hip, vh)
            if not reaches(model, parameters, leg, p, PLANNED, q):
                verdict[0], verdict[1], verdict[2] = REACH, leg, -1
                return False
            joint_motion(model.lengths[leg], model.lengths[leg, 3], q, vh, a, qd, qdd)
            for k in range(3):
                if abs(qd[k]) > quickest:
                    quickest = abs(qd[k])
                    verdict[1], verdict[2] = leg, k
            moment_of(model, leg, q, moment)
        if quickest > fastest:
            verdict[0], verdict[3] = SPEED, quickest / fastest
            return False
        for i in range(3):
            moment[i] /= model.mass
        x = bx + lean[0, 0] * moment[0] + lean[0, 1] * moment[1] + lean[0, 2] * moment[2]
        y = by + lean[1, 0] * moment[0] + lean[1, 1] * moment[1] + lean[1, 2] * moment[2]
        least = min(least, support_margin(feet, standing, x, y))
        if least < parameters.support_margin + parameters.planned_margin:
            verdict[0], verdict[1], verdict[2], verdict[3] = SUPPORT, -1, -1, least
            return False
    verdict[3] = quickest / fastest
    return True


def share_of_velocity(
    model: np.void,
    parameters: np.void,
    region: np.ndarray,
    reference: np.void,
    pose: np.ndarray,
    velocity: np.ndarray,
    most: float,
    verdict: np.ndarray,
) -> float:
    """The largest share of a velocity, up to `most`, at which a steady walk can be made.

    Args:
        model: Record of the robot.
        parameters: Record of the margins.
        region: Where the feet may stand at that pose, shape (L, K, 3).
        reference: Gait and height of a step.
        pose: Of the body, shape (6,).
        velocity: Of the path, shape (3,).
        most: Largest share that is looked for.
        verdict: Written: what keeps it from more, as by `gait_is_feasible`, shape (4,).
    """
    last = np.zeros(4)
    trial = velocity * most
    if gait_is_feasible(model, parameters, region, reference, pose, trial, verdict):
        return most
    low, high = 0.0, most
    close = CLOSE if most > 1.0 else 4 * CLOSE
    while high - low > close * high and high > 1e-6:
        share = (low + high) / 2
        trial = velocity * share
        if gait_is_feasible(model, parameters, region, reference, pose, trial, last):
            low = share
        else:
            high = share
            verdict[:] = last
    return low


def share_of_pose(
    model: np.void,
    parameters: np.void,
    reference: np.void,
    base: np.ndarray,
    pose: np.ndarray,
    verdict: np.ndarray,
) -> float:
    """The largest share of a pose, up to 1, in which a robot can step on the spot.

    Args:
        model: Record of the robot.
        parameters: Record of the margins.
        reference: Record of gait, with a duty factor of 1 for standing, and height of a step.
        base: Pose that it has anyway beside its path and its neutral height, shape (6,).
        pose: What is added to that, shape (6,).
        verdict: Written: what keeps it from more, as by `gait_is_feasible`, shape (4,).
    """
    # On the spot the feet stay at their neutral places, which need no region.
    region = np.zeros((int(model["leg_count"]), 1, 3))
    region[:, :, 2] = 1.0
    rest, last = np.zeros(3), np.zeros(4)
    if gait_is_feasible(model, parameters, region, reference, base + pose, rest, verdict):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(10):
        share = (low + high) / 2
        trial = base + pose * share
        if gait_is_feasible(model, parameters, region, reference, trial, rest, last):
            low = share
        else:
            high = share
            verdict[:] = last
    return low
