"""Free motion: falling, swinging, order of the error, and momentum of the robot afloat."""

import math

import mujoco
import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from phasmid.dynamics import leg_matrices, momentum
from phasmid.kinematics import centre_of_mass, joint_angles, quaternion_rotation
from phasmid.simulation.model import X_AXIS_UP, set_inertia
from physics.bench import INTEGRATORS, compiled, hold, joint_state, trunk_motion, with_integrator
from physics.rows import row, samples

STEP = 0.001  # time step of these experiments [s]; where the order counts, half and twice of it too
SWING = 0.5  # amplitude of the pendulum [rad]
ROD = 1.5  # length of the rod that is hung by its end [m]: it swings as a point on a thread of 1 m
SWUNG = 0.1  # time for which femur and tibia fall about their fixed axis, by about 0.6 rad [s]
EXACT = {"rtol": 1e-13, "atol": 1e-15}  # tolerances of an integration that counts as exact


def fall(bench):
    """Compare 0.5 s of the thrown robot's flight, joints held, with free fall."""
    time, g = 0.5, bench.scenario.model.gravity
    speed = np.array([1.0, 0.0, 2.0])
    way = speed * time - np.array([0.0, 0.0, g * time**2 / 2])
    errors = {}
    for integrator in INTEGRATORS:
        run = bench.standing()
        data = run.data
        with_integrator(run.model, integrator, STEP)
        data.qpos[2] += 1.0
        data.qpos[7:] = run.walk.q[0].ravel()
        data.qvel[:] = 0.0
        data.qvel[:3] = speed
        start = _mass_centre(run)
        for _ in hold(run, round(time / STEP)):
            pass
        errors[integrator] = _mass_centre(run) - start - way
    first, fourth = (errors[integrator] for integrator in INTEGRATORS)
    known = g * STEP * time / 2
    why = "The method is of first order and its error is known, ½ g Δt t: 1 % of that."
    low = "too low, semi-implicit Euler"
    yield row(low, -float(first[2]), 0.01 * known, why, unit="m", expected=known)
    why = "Nothing acts sideways: 500 sums of numbers below 1 m, each rounded by 1e-16 m."
    yield row("sideways", first[:2], 1e-12, why, unit="m")
    why = "A parabola is exact for RK4: 500 sums of numbers below 2 m, rounded by 2e-16 m each."
    yield row("off the parabola, RK4", fourth, 1e-12, why, unit="m")


def pendulum_period(bench):
    """Compare the period of a rod's swing with the closed form."""
    g = bench.scenario.model.gravity
    exact = 4 * math.sqrt(2 * ROD / (3 * g)) * ellipk(math.sin(SWING / 2) ** 2)
    faster = "Semi-implicit Euler swings faster by (ω Δt)²/24 = 4e-7 at ω = 3.1 rad/s."
    fourth = "RK4 errs by less than (ω Δt)⁴ = 1e-10."
    for integrator, tolerance, why in (("semi-implicit", 1e-6, faster), ("RK4", 1e-9, fourth)):
        angle, _ = _swing(bench, integrator, STEP)
        error = _period(angle, STEP) / exact - 1
        yield row(f"relative error, {integrator}", error, tolerance, why)


def pendulum_energy(bench):
    """Compare the rod's total energy with that at the start."""
    g = bench.scenario.model.gravity

    def worst(integrator, step):
        angle, speed = _swing(bench, integrator, step)
        # Per mass of the rod.
        energy = ROD**2 * speed**2 / 6 + g * ROD / 2 * (1 - np.cos(angle))
        return float(np.abs(energy / energy[0] - 1).max())

    euler = worst("semi-implicit", STEP)
    why = "RK4 loses (ω Δt)⁵/72 a step, over 20 000 steps below 1e-9."
    yield row("relative, RK4", worst("RK4", STEP), 1e-8, why)
    why = "Semi-implicit Euler keeps an energy that differs by ½ ω Δt = 1.6e-3 at the most."
    yield row("relative, semi-implicit", euler, 2e-3, why)
    why = "Proportional to the time step: the next order is Δt², a thousandth of it here."
    ratio = euler / worst("semi-implicit", STEP / 2)
    yield row("at Δt over at Δt/2", ratio, 0.1, why, expected=2.0)


def convergence(bench):
    """Femur and tibia of leg 1, swinging from a fixed axis, against the leg's own equations."""
    leg = bench.scenario.load_robot().legs[0]
    exact = _integrate_equations(leg, bench.scenario.model.gravity)
    for integrator, order, coarse in zip(INTEGRATORS, (1, 4), (STEP, 2 * STEP), strict=True):
        errors = [
            np.linalg.norm(_double_pendulum(bench, leg, integrator, step) - exact)
            for step in (coarse, coarse / 2)
        ]
        why = "log2 of the errors at Δt and Δt/2; the next power of Δt adds some percent."
        found = math.log2(errors[0] / errors[1])
        yield row(f"order, {integrator}", found, 0.1, why, expected=order)


def _mass_centre(run):
    data = run.data
    inside = centre_of_mass(run.robot, data.qpos[7:].reshape(-1, 3).copy())
    return data.qpos[:3] + quaternion_rotation(data.qpos[3:7].copy()) @ inside


def _swing(bench, integrator, step):
    """Angles [rad] and speeds [rad/s] of the rod for a little more than ten periods."""
    spec = mujoco.MjSpec()
    rod = spec.worldbody.add_body(explicitinertial=True, mass=1.0, ipos=[0.0, 0.0, -ROD / 2])
    rod.inertia = [ROD**2 / 12, ROD**2 / 12, 1e-6]
    rod.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 1.0, 0.0])
    model = compiled(spec, bench, integrator=integrator, dt=step)
    data = mujoco.MjData(model)
    data.qpos[0] = SWING
    # An amplitude of 0.5 rad swings by 1.6 % slower than a small one.
    period = 1.02 * 2 * math.pi * math.sqrt(2 * ROD / (3 * bench.scenario.model.gravity))
    count = round(10 * period / step)
    angle, speed = np.empty((2, count + 1))
    for k in range(count + 1):
        angle[k], speed[k] = data.qpos[0], data.qvel[0]
        mujoco.mj_step(model, data)
    return angle, speed


def _period(angle, step):
    """Mean time between passages through 0 in one direction [s]."""
    before = np.flatnonzero((angle[:-1] < 0) & (angle[1:] >= 0))
    passages = []
    for k in (before[0], before[-1]):
        # Time as a polynomial of the angle through six samples about the passage.
        near = np.arange(k - 2, k + 4)
        passages.append(step * float(Polynomial.fit(angle[near], near - k, 5)(0.0) + k))
    return (passages[1] - passages[0]) / (len(before) - 1)


def _double_pendulum(bench, leg, integrator, step):
    """Angles of femur and tibia in the engine, let go level and stretched [rad]."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    parent = _add_link(spec.worldbody, leg.femur, [0.0, 0.0, 0.0], X_AXIS_UP)
    _add_link(parent, leg.tibia, [leg.femur.length, 0.0, 0.0], (1.0, 0.0, 0.0, 0.0))
    model = compiled(spec, bench, integrator=integrator, dt=step)
    data = mujoco.MjData(model)
    for _ in range(round(SWUNG / step)):
        mujoco.mj_step(model, data)
    return data.qpos.copy()


def _add_link(parent, link, at, turn):
    body = parent.add_body(pos=at, quat=turn)
    set_inertia(body, link)
    body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
    return body


def _integrate_equations(leg, gravity):
    """Integrate Eqs. 10-11, corrected, with the coxa held."""

    def rates(state):
        femur, tibia = state[2:]
        M, B, C, G = leg_matrices(leg, np.array([0.0, *state[:2]]), gravity=gravity)
        # The products of coxa and femur, coxa and tibia, femur and tibia; then the squares.
        needed = B @ [0.0, 0.0, femur * tibia] + C @ [0.0, femur**2, tibia**2] + G
        return np.concatenate([state[2:], np.linalg.solve(M[1:, 1:], -needed[1:])])

    path = solve_ivp(lambda _, state: rates(state), (0, SWUNG), np.zeros(4), "DOP853", **EXACT)
    return path.y[:2, -1]


LOOK = 0.05  # time from one look at the momentum to the next [s]
WAVING = 1.0  # speed above which a joint is counted as moving [rad/s]


def floating_momentum(bench):
    """Without gravity, drifting and turning, all legs waved by servos for a second."""
    waving = 0
    # The servos hold a leg at up to 100 rad/s, which RK4 must resolve to its fourth power.
    first = (
        "An error of first order: legs that turn by 2 rad/s lose their part of it at each step, "
        "some 1e-3 of the whole in a second."
    )
    fourth = "Of fourth order: 1.1e-8 was measured at 1 ms, so 4e-11 at a quarter of it."
    for integrator, dt, tolerance, why in (
        ("implicit", 1e-3, 1e-2, first),
        ("RK4", 2.5e-4, 1e-9, fourth),
    ):
        drifts, moving = _drifts(bench, integrator, dt)
        waving += moving
        for what, drift in drifts.items():
            yield row(f"{what}, {integrator}, {1000 * dt:g} ms", drift, tolerance, why)
    yield samples(waving, f"joints above {WAVING:g} rad/s, all instants together")


def _drifts(bench, integrator, step):
    """Largest change of linear and angular momentum, as parts of those at the start.

    The second value counts joints that move, over all instants.
    """
    scenario = bench.scenario.replace(drive="ideal-servo")
    robot = scenario.load_robot()
    model = with_integrator(bench.model(scenario), integrator, step)
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    neutral = joint_angles(robot.arrays, robot.arrays.neutral_foot).ravel()
    data.qpos[2] = 10.0
    data.qpos[7:] = neutral
    data.qvel[:6] = [0.3, 0.2, -0.1, 0.5, -0.4, 0.8]
    wave = 0.3 * np.cos(np.arange(len(neutral)))
    stride = round(LOOK / step)
    looks, moving = [], 0
    for k in range(20 * stride + 1):
        if k % stride == 0:
            q, qd, _ = joint_state(data)
            moving += int(np.count_nonzero(np.abs(qd) > WAVING))
            looks.append(momentum(robot, trunk_motion(data), q, qd))
        data.ctrl[:] = neutral + wave * math.sin(2 * math.pi * k * step)
        mujoco.mj_step(model, data)
    drifts = {}
    for name in ("linear", "angular"):
        rows = np.array([getattr(look, name) for look in looks])
        drifts[name] = float(np.abs(rows - rows[0]).max() / np.linalg.norm(rows[0]))
    return drifts, moving
