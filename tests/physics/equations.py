"""Kinematics and dynamics against themselves, conservation laws and other ways to one number."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from phasmid.dynamics import (
    BodyMotion,
    inverse_dynamics,
    kinetic_energy,
    leg_matrices,
    leg_torque,
    mass_matrix,
    potential_energy,
)
from phasmid.kinematics import (
    foot_position,
    jacobian,
    joint_angles,
    leg_frames,
    quaternion_rotation,
)
from phasmid.robot import load_robot, preset_names
from phasmid.units import STANDARD_GRAVITY
from physics.rows import row

STATES = 200  # random states
SLOPE = (4 / 5, -1 / 5, 4 / 105, -1 / 280)  # weights of the central difference of eighth order


def power(bench):
    """Compare the power of joints and trunk wrench with the rate of energy, in flight."""
    robot, rng = bench.scenario.load_robot(), np.random.default_rng(9)
    legs = (len(robot.legs), 3)
    size, rate, start = (
        rng.uniform(low, high, legs) for low, high in ((0.3, 1), (0.5, 2), (-3, 3))
    )
    axis = rng.normal(size=3)

    def joints(t):
        phase = start + rate * t
        s, c = np.sin(phase), np.cos(phase)
        return size * s, size * rate * c, -size * rate**2 * s

    def trunk(t):
        # Turning at a constant rate about one axis; drifting to and fro.
        return BodyMotion(
            position=np.array([np.sin(t), np.cos(1.3 * t), 0.4 * np.sin(0.7 * t)]),
            rotation=Rotation.from_rotvec(axis * t).as_matrix(),
            velocity=np.array([np.cos(t), -1.3 * np.sin(1.3 * t), 0.28 * np.cos(0.7 * t)]),
            angular_velocity=axis,
            acceleration=np.array([-np.sin(t), -1.69 * np.cos(1.3 * t), -0.196 * np.sin(0.7 * t)]),
            angular_acceleration=np.zeros(3),
        )

    def energy(t):
        body, (q, qd, _) = trunk(t), joints(t)
        return np.asarray(
            kinetic_energy(robot, body, q, qd)
            + potential_energy(robot, body, q, gravity=STANDARD_GRAVITY)
        )

    given, gained = [], []
    for t in np.linspace(0.1, 3.0, 20):
        body, (q, qd, qdd) = trunk(float(t)), joints(float(t))
        torque, wrench = inverse_dynamics(robot, body, q, qd, qdd, gravity=STANDARD_GRAVITY)
        twist = np.concatenate([body.velocity, body.angular_velocity])
        given.append(float(np.sum(torque * qd) + wrench @ twist))
        gained.append(float(derivative(energy, float(t))))
    scale = np.abs(gained).max()
    why = (
        "The difference quotient errs by (ω h)⁸/630 = 2e-11 at ω = 10 rad/s and h = 0.01 s, "
        "and by 1e-12 W of round-off."
    )
    yield row("of the largest power", np.abs(np.subtract(given, gained)).max() / scale, 1e-9, why)


def agreement(bench):
    """Joint torques at random states: Eqs. 10-11, corrected, our recursion, and the engine."""
    robot, rng = bench.scenario.load_robot(), np.random.default_rng(10)
    shape = (STATES, len(robot.legs), 3)
    q = rng.uniform(-np.pi, np.pi, shape)
    qd, qdd, force = (scale * rng.normal(size=shape) for scale in (5.0, 20.0, 10.0))
    in_world = np.einsum("lij,nlj->nli", robot.arrays.R_body_hip, force)
    closed = leg_torque(robot.arrays, q, qd, qdd, foot_force=force, gravity=STANDARD_GRAVITY)
    still = BodyMotion.at_rest()
    recursive, _ = inverse_dynamics(
        robot, still, q, qd, qdd, foot_force=in_world, gravity=STANDARD_GRAVITY
    )
    p, v, w, a, dw = rng.normal(size=(5, STATES, 3)) * np.reshape([1, 1, 3, 5, 20], (5, 1, 1))
    quaternion = rng.normal(size=(STATES, 4))
    quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
    body = BodyMotion(p, quaternion_rotation(quaternion), v, w, a, dw)
    gravity = bench.scenario.model.gravity
    torque, wrench = inverse_dynamics(robot, body, q, qd, qdd, gravity=gravity)
    ours = np.concatenate([wrench, torque.reshape(STATES, -1)], axis=1)
    theirs = _engine_inverse(bench, robot, body, quaternion, q, qd, qdd)
    why = "Sums of a thousand terms up to 200 N, rounded at random: 30 · 2e-16 · 200 = 1e-12."
    yield row("closed form - recursion", closed - recursive, 1e-10, why, unit="N·m")
    yield row("recursion - engine, in flight", ours - theirs, 1e-10, why, unit="N, N·m")


def structure(bench):
    """Mass matrices of leg and robot: symmetric, positive definite; their rate less 2 C is skew."""
    robot, rng = bench.scenario.load_robot(), np.random.default_rng(11)
    legs = robot.arrays
    q = rng.uniform(-np.pi, np.pi, (STATES, len(robot.legs), 3))
    qd = rng.normal(size=q.shape)
    M = mass_matrix(robot, BodyMotion.at_rest(), q)
    smallest = np.linalg.eigvalsh(M)[:, 0].min()
    v = rng.normal(size=(STATES, M.shape[-1]))
    zero = np.zeros((STATES, 3))
    body = BodyMotion(zero, np.eye(3) + np.zeros((STATES, 3, 3)), v[:, :3], v[:, 3:6], zero, zero)
    energy = kinetic_energy(robot, body, q, v[:, 6:].reshape(q.shape))
    quadratic = np.einsum("ni,nij,nj->n", v, M, v) / 2
    rates = derivative(lambda t: leg_matrices(legs, q + t * qd, gravity=STANDARD_GRAVITY).M, 0.0)
    skew = rates - 2 * _christoffel(legs, q, qd)
    quotient = "Entries below 0.1 kg·m²: the difference quotient errs by 4e-14, round-off less."
    yield row("asymmetry, robot", M - np.swapaxes(M, -1, -2), 1e-11, quotient)
    why = "Kinetic energy is positive: no eigenvalue below 0."
    yield row("least eigenvalue below 0", max(-smallest, 0.0), 0.0, why)
    why = "Sums of some 600 terms about 1 J, rounded by 1e-16 J each: 1e-13 of the energy."
    yield row("v'M v / 2, off the kinetic energy", quadratic / energy - 1, 1e-11, why)
    both = skew + np.swapaxes(skew, -1, -2)
    yield row("rate - 2 C, not skew, legs", both, 1e-11, quotient, unit="N·m·s")


def _christoffel(legs, q, qd):
    """Return the matrix C(q, q') of Christoffel's symbols, from the quadratic forms of Eq. 10.

    A form h(q') belongs to the bilinear form (h(u + v) - h(u) - h(v)) / 2, which with u = q' is
    C v.
    """
    _, B, C, _ = leg_matrices(legs, q, gravity=STANDARD_GRAVITY)

    def form(u):
        pairs = np.stack([u[..., 0] * u[..., 1], u[..., 0] * u[..., 2], u[..., 1] * u[..., 2]], -1)
        return (B @ pairs[..., None] + C @ (u**2)[..., None])[..., 0]

    columns = [(form(qd + e) - form(qd) - form(0 * qd + e)) / 2 for e in np.eye(3)]
    return np.stack(columns, axis=-1)


def _engine_inverse(bench, robot, body, quaternion, q, qd, qdd):
    """Generalised forces by the engine, its joints let go and its feet in the air."""
    model = bench.model(bench.scenario)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    R, rows = body.rotation, []
    # The engine turns a free body about its own axes.
    w, dw = ((u[:, None] @ R)[:, 0] for u in (body.angular_velocity, body.angular_acceleration))
    for i in range(len(q)):
        data.qpos[:] = [*body.position[i], *quaternion[i], *q[i].ravel()]
        data.qvel[:] = [*body.velocity[i], *w[i], *qd[i].ravel()]
        data.qacc[:] = [*body.acceleration[i], *dw[i], *qdd[i].ravel()]
        mujoco.mj_inverse(model, data)
        row = data.qfrc_inverse.copy()
        row[3:6] = R[i] @ row[3:6]
        rows.append(row)
    return np.array(rows)


def derivative(f, t, h=0.01):
    """Return the rate of f at t by the central difference of eighth order."""
    terms = (c * (f(t + k * h) - f(t - k * h)) for k, c in enumerate(SLOPE, start=1))
    return np.asarray(sum(terms) / h)


LEG_STATES = 10_000  # random angles per robot
SHORT = (0.0, 1e-15, 1e-12, 1e-9, 1e-6)  # parts by which a leg may miss full stretch


def round_trip(bench):
    """Foot to angles to foot, and angles to foot to angles, over the workspace of all presets."""
    there, back, stretched = [], [], []
    for leg in _legs():
        q = _random_angles()
        coxa, femur, tibia = leg.lengths
        r = coxa + femur * np.cos(q[:, 1]) + tibia * np.cos(q[:, 1] + q[:, 2])
        # Near the coxa axis, and where the leg is stretched or folded, the inverse kinematics is
        # ill-conditioned.
        q = q[(r > 0.01) & (np.abs(np.sin(q[:, 2])) > 0.05)]
        p = foot_position(leg, q)
        found = joint_angles(leg, p)
        there.append(np.abs(foot_position(leg, found) - p).max())
        back.append(np.abs(found - q).max() * sum(leg.lengths))
        for short in SHORT:
            up = np.linspace(-1.5, 1.5, 301)
            length = (femur + tibia) * (1 - short)
            far = np.stack([coxa + length * np.cos(up), 0 * up, length * np.sin(up)], axis=-1)
            again = foot_position(leg, joint_angles(leg, far))
            stretched.append(np.abs(again - far).max())
    why = "Sums of a few terms below 0.3 m, each rounded by 3e-17 m: 1e-12 leaves four orders."
    yield row("FK(IK(p)) - p", np.max(there), 1e-12, why, unit="m")
    yield row("IK(FK(q)) - q, times the leg's length", np.max(back), 1e-12, why, unit="m")
    yield row("within 1e-6 of full stretch", np.max(stretched), 1e-12, why, unit="m")


def chain(bench):
    """Table 1's chain of transforms beside the closed form."""
    q = _random_angles()
    apart = [
        np.abs(leg_frames(leg, q)[:, 3, :3, 3] - foot_position(leg, q)).max() for leg in _legs()
    ]
    why = "Products of four transforms: fewer than 20 operations on terms below 0.3 m."
    yield row("foot, all presets", np.max(apart), 1e-14, why, unit="m")


def slopes(bench):
    """Compare the Jacobian with the complex-step derivative of Table 1's chain."""
    q, step, apart = _random_angles(), 1e-30, []
    for leg in _legs():
        J = jacobian(leg, q)
        for joint in range(3):
            moved = q + 1j * step * np.eye(3)[joint]
            apart.append(np.abs(_foot(leg, moved).imag / step - J[..., joint]).max())
    why = "A complex step has no truncation; some ten operations on lengths below 0.3 m."
    yield row("all presets", np.max(apart), 1e-13, why, unit="m")


def _legs():
    return [load_robot(preset).legs[0] for preset in preset_names()]


def _random_angles():
    """Knee-up angles over the whole range."""
    rng = np.random.default_rng(0)
    return rng.uniform([-3.0, -1.5, -np.pi], [3.0, 1.5, 0.0], (LEG_STATES, 3))


def _foot(leg, q):
    """Return the foot by the product of Table 1's transforms, for complex angles."""
    point = np.array([leg.tibia.length, 0.0, 0.0]) + np.zeros_like(q)
    coxa, femur = leg.coxa.length, leg.femur.length
    for angle, at, upright in ((q[:, 2], femur, 0), (q[:, 1], coxa, 1), (q[:, 0], 0.0, 0)):
        x, y, z = point.T
        c, s = np.cos(angle), np.sin(angle)
        x, y = c * x - s * y + at, s * x + c * y
        # The femur's axis lies level: a quarter turn about x.
        point = np.stack([x, -z, y] if upright else [x, y, z], axis=-1)
    return point
