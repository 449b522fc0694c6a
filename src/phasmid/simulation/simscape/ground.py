"""What the ground does to the feet in one state of the trunk, and the functions that this takes."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.simulation.contact import CONTACT_POINTS
from phasmid.simulation.simscape.law import friction_coefficient, normal_force
from phasmid.simulation.simscape.legs import COM, INERTIA, LEG, LEGS, MOMENTUM, TURNING


@compiled
def cubic(row: np.ndarray, at: int, s: float) -> float:
    """Value of the cubic that begins at a place of a row."""
    return row[at] + s * (row[at + 1] + s * (row[at + 2] + s * row[at + 3]))


@compiled
def cubic_rate(row: np.ndarray, at: int, s: float) -> float:
    """Its derivative by the share of the step."""
    return row[at + 1] + s * (2.0 * row[at + 2] + s * 3.0 * row[at + 3])


@compiled
def rotation(quaternion: np.ndarray, R: np.ndarray) -> None:
    """Fill the rotation matrix of a quaternion (w, x, y, z), of unit length or nearly."""
    w, x, y, z = quaternion
    n = 2.0 / (w * w + x * x + y * y + z * z)
    R[0, 0], R[0, 1], R[0, 2] = 1 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)
    R[1, 0], R[1, 1], R[1, 2] = n * (x * y + w * z), 1 - n * (x * x + z * z), n * (y * z - w * x)
    R[2, 0], R[2, 1], R[2, 2] = n * (x * z - w * y), n * (y * z + w * x), 1 - n * (x * x + y * y)


@compiled
def inertia_at(row: np.ndarray, s: float, J: np.ndarray) -> None:
    """Fill the inertia about the centre of mass, body axes."""
    J[0, 0], J[1, 1] = cubic(row, INERTIA, s), cubic(row, INERTIA + 4, s)
    J[2, 2], J[0, 1] = cubic(row, INERTIA + 8, s), cubic(row, INERTIA + 12, s)
    J[0, 2], J[1, 2] = cubic(row, INERTIA + 16, s), cubic(row, INERTIA + 20, s)
    J[1, 0], J[2, 0], J[2, 1] = J[0, 1], J[0, 2], J[1, 2]


@compiled
def solved(J: np.ndarray, b: np.ndarray, x: np.ndarray) -> None:
    """Fill x of J x = b for a symmetric 3 by 3 matrix."""
    c00 = J[1, 1] * J[2, 2] - J[1, 2] * J[1, 2]
    c01 = J[0, 2] * J[1, 2] - J[0, 1] * J[2, 2]
    c02 = J[0, 1] * J[1, 2] - J[0, 2] * J[1, 1]
    c11 = J[0, 0] * J[2, 2] - J[0, 2] * J[0, 2]
    c12 = J[0, 1] * J[0, 2] - J[0, 0] * J[1, 2]
    c22 = J[0, 0] * J[1, 1] - J[0, 1] * J[0, 1]
    d = 1.0 / (J[0, 0] * c00 + J[0, 1] * c01 + J[0, 2] * c02)
    x[0] = d * (c00 * b[0] + c01 * b[1] + c02 * b[2])
    x[1] = d * (c01 * b[0] + c11 * b[1] + c12 * b[2])
    x[2] = d * (c02 * b[0] + c12 * b[1] + c22 * b[2])


@compiled
def ground(
    row: np.ndarray,
    s: float,
    dt: float,
    state: np.ndarray,
    R: np.ndarray,
    J: np.ndarray,
    w: np.ndarray,
    mass: float,
    planes: np.ndarray,
    law: np.ndarray,
    feet: np.ndarray,
    wrench: np.ndarray,
    dampers: np.ndarray,
) -> None:
    """What the ground does in a state; all vectors in body axes.

    Args:
        row: The legs in this step.
        s: Share of the step that is over.
        dt: Length of the step [s].
        state: Centre of mass, quaternion, momentum, angular momentum (13).
        R: Filled with the body's rotation.
        J: Filled with the inertia about the centre of mass.
        w: Filled with the angular velocity.
        mass: Of the robot [kg].
        planes: The ground under each leg: normal in world axes, its distance from the origin along
            it, and static coefficient of friction, shape (L, 5).
        law: Stiffness, damping, kinetic coefficient and threshold speed of a point, its radius,
            and the greatest distance of two points of a foot.
        feet: Filled with the number of points that touch, and force and moment on each foot, the
            moment about the centre of mass, shape (L, 7).
        wrench: Filled with the feet's sum (6).
        dampers: Filled with the wrench that a unit twist of the body takes from it, lower
            triangle (6, 6); without rows where no one wants it.
    """
    stiffness, damping, kinetic, threshold, radius, size = law
    rotation(state[3:7], R)
    inertia_at(row, s, J)
    for a in range(3):
        inner = R[0, a] * state[10] + R[1, a] * state[11] + R[2, a] * state[12]
        wrench[a] = inner - cubic(row, MOMENTUM + 4 * a, s)
    solved(J, wrench, w)
    w0, w1, w2 = w
    com0, com1, com2 = cubic(row, COM, s), cubic(row, COM + 4, s), cubic(row, COM + 8, s)
    p0, p1, p2 = state[7] / mass, state[8] / mass, state[9] / mass
    # Velocity of the body's frame where the centre of mass is, without the turning.
    u0 = R[0, 0] * p0 + R[1, 0] * p1 + R[2, 0] * p2 - cubic_rate(row, COM, s) / dt
    u1 = R[0, 1] * p0 + R[1, 1] * p1 + R[2, 1] * p2 - cubic_rate(row, COM + 4, s) / dt
    u2 = R[0, 2] * p0 + R[1, 2] * p1 + R[2, 2] * p2 - cubic_rate(row, COM + 8, s) / dt
    feet[:] = 0.0
    wrench[:] = 0.0
    dampers[:] = 0.0
    for leg in range(len(planes)):
        at = LEGS + leg * LEG
        nx, ny, nz, offset, static = planes[leg]
        n0 = R[0, 0] * nx + R[1, 0] * ny + R[2, 0] * nz
        n1 = R[0, 1] * nx + R[1, 1] * ny + R[2, 1] * nz
        n2 = R[0, 2] * nx + R[1, 2] * ny + R[2, 2] * nz
        over = nx * state[0] + ny * state[1] + nz * state[2] - offset - radius
        for point in range(CONTACT_POINTS):
            k = at + 12 * point
            r0 = cubic(row, k, s) - com0
            r1 = cubic(row, k + 4, s) - com1
            r2 = cubic(row, k + 8, s) - com2
            depth = -(over + n0 * r0 + n1 * r1 + n2 * r2)
            if depth <= 0.0:
                # No other point of this foot can reach the ground.
                if depth < -size:
                    break
                continue
            # The point of the tibia that touches, halfway into the ground.
            below = radius - depth / 2.0
            d0, d1, d2 = below * n0, below * n1, below * n2
            r0, r1, r2 = r0 - d0, r1 - d1, r2 - d2
            k_turn = at + TURNING
            t0 = row[k_turn] + s * (row[k_turn + 3] - row[k_turn])
            t1 = row[k_turn + 1] + s * (row[k_turn + 4] - row[k_turn + 1])
            t2 = row[k_turn + 2] + s * (row[k_turn + 5] - row[k_turn + 2])
            v0 = u0 + w1 * r2 - w2 * r1 + cubic_rate(row, k, s) / dt - (t1 * d2 - t2 * d1)
            v1 = u1 + w2 * r0 - w0 * r2 + cubic_rate(row, k + 4, s) / dt - (t2 * d0 - t0 * d2)
            v2 = u2 + w0 * r1 - w1 * r0 + cubic_rate(row, k + 8, s) / dt - (t0 * d1 - t1 * d0)
            rising = n0 * v0 + n1 * v1 + n2 * v2
            v0, v1, v2 = v0 - rising * n0, v1 - rising * n1, v2 - rising * n2
            slip = math.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
            normal = normal_force(depth, -rising, stiffness, damping)
            held = min(kinetic, static)
            drag = static * normal / threshold
            if slip > threshold:
                drag = friction_coefficient(slip, static, held, threshold) * normal / slip
            f0, f1, f2 = normal * n0 - drag * v0, normal * n1 - drag * v1, normal * n2 - drag * v2
            foot = feet[leg]
            foot[0] += 1.0
            foot[1] += f0
            foot[2] += f1
            foot[3] += f2
            foot[4] += r1 * f2 - r2 * f1
            foot[5] += r2 * f0 - r0 * f2
            foot[6] += r0 * f1 - r1 * f0
            if len(dampers) == 0:
                continue
            # Both dampers: the drag in all directions, and along the normal what differs from it.
            D = dampers
            D[0, 0] += drag
            D[1, 1] += drag
            D[2, 2] += drag
            D[3, 1] -= drag * r2
            D[3, 2] += drag * r1
            D[4, 0] += drag * r2
            D[4, 2] -= drag * r0
            D[5, 0] -= drag * r1
            D[5, 1] += drag * r0
            D[3, 3] += drag * (r1 * r1 + r2 * r2)
            D[4, 4] += drag * (r0 * r0 + r2 * r2)
            D[5, 5] += drag * (r0 * r0 + r1 * r1)
            D[4, 3] -= drag * r0 * r1
            D[5, 3] -= drag * r0 * r2
            D[5, 4] -= drag * r1 * r2
            more = (damping if rising < 0.0 else 0.0) - drag
            b3, b4, b5 = r1 * n2 - r2 * n1, r2 * n0 - r0 * n2, r0 * n1 - r1 * n0
            b = (n0, n1, n2, b3, b4, b5)
            for i in range(6):
                for j in range(i + 1):
                    D[i, j] += more * b[i] * b[j]
        for a in range(6):
            wrench[a] += feet[leg, 1 + a]
