"""Feet on the ground: forces and accelerations, standing, impact and friction."""

import math

import mujoco
import numpy as np

from phasmid.dynamics import inverse_dynamics, kinetic_energy, potential_energy
from phasmid.kinematics import (
    body_from_hip,
    centre_of_mass,
    foot_position,
    link_frames,
    rpy_quaternion,
)
from physics.bench import contact_points, hold, joint_state, touching, trunk_motion
from physics.rows import row, samples

# Instants of the walk at which the engine's forces are compared [s].
INSTANTS = (0.1, 0.37, 1.05, 1.62)
# From how high at the most [m], and rolled and pitched by how much [rad].
HIGHEST, STEEPEST = 0.15, 0.4


def forward_and_inverse(bench):
    """Compare our inverse dynamics and the engine's at its accelerations in contact."""
    torque, wrench, own, as_run = np.zeros((4, len(INSTANTS)))
    points = 0
    for k, instant in enumerate(INSTANTS):
        scenario = bench.scenario.replace(duration=instant)
        run = bench.run(scenario)
        run.advance()
        model, data = run.model, run.data
        mujoco.mj_inverse(model, data)
        as_run[k] = np.abs(data.qfrc_inverse).max()
        # The solver's iterations end in round-off.
        model.opt.tolerance = 1e-24
        mujoco.mj_forward(model, data)
        touch = touching(run.robot, model, data)
        points += len(touch.leg)
        needed, missing = _needs(run.robot, data, touch, scenario.model.gravity)
        torque[k] = np.abs(needed - run.drive.torque()).max()
        wrench[k] = np.abs(missing).max()
        mujoco.mj_inverse(model, data)
        own[k] = np.abs(data.qfrc_inverse).max()
    why = "Sums of some hundred terms below 100 N, rounded by 1e-14 N each; the solver at its end."
    yield row("torques, our recursion", torque.max(), 1e-9, why, unit="N·m")
    yield row("left on the trunk, ours", wrench.max(), 1e-9, why, unit="N, N·m")
    yield row("the engine's own inverse", own.max(), 1e-9, why, unit="N, N·m")
    why = (
        "The imbalance that the engine's solver leaves at its own tolerance of 1e-8, as in every "
        "run."
    )
    yield row("left by the solver in a run", as_run.max(), None, why, unit="N, N·m")
    yield samples(points, "points that touch, all instants together")


def static_depth(bench):
    """Mean depth of the points that touch, the robot at rest on six feet.

    The number of points that must share the weight comes from the robot, not from the engine.
    """
    run = bench.standing()
    for _ in hold(run, 1000):
        pass
    law, weight = run.experiment.world.contact, run.robot.mass * run.experiment.world.gravity
    depth = touching(run.robot, run.model, run.data).depth
    why = "Springs are exact at rest; after 2 s the residual motion is below 1e-12 m."
    points = contact_points(run.robot)
    found, expected = depth.mean() if len(depth) else math.nan, weight / (points * law.stiffness)
    yield row(f"mean of {points} points", found, 1e-9, why, unit="m", expected=expected)


def standing(bench):
    """Sum and moment of the ground's forces about the centre of mass, six feet."""
    run = bench.standing()
    robot, data = run.robot, run.data
    for _ in hold(run, 1000):
        pass
    touch = touching(robot, run.model, data)
    body, (q, _, _) = trunk_motion(data), joint_state(data)
    centre = body.position + body.rotation @ centre_of_mass(robot, q)
    force = touch.force.sum(axis=0)
    moment = np.cross(touch.position - centre, touch.force).sum(axis=0)
    weight = robot.mass * run.experiment.world.gravity
    reach = float(np.linalg.norm(robot.legs[0].neutral_foot + robot.legs[0].mount_position))
    why = "Equilibrium; after 2 s residual accelerations are below 1e-7 of gravity."
    yield row("ΣF / mg", force[2] / weight, 1e-6, why, expected=1.0)
    yield row("ΣM / (mg · reach)", np.abs(moment).max() / (weight * reach), 1e-6, why)
    yield row("ΣF along the ground / mg", np.abs(force[:2]).max() / weight, 1e-6, why)


def impact_energy(bench):
    """Energy from the last instant before each touch to the first after it; drops, joints held."""
    gained, rng = [0.0], np.random.default_rng(20)
    for _ in range(12):
        height = rng.uniform(0.01, HIGHEST)
        roll, pitch = rng.uniform(-STEEPEST, STEEPEST, 2)
        run = bench.standing()
        data = run.data
        # No foot is farther than 0.3 m from the middle.
        data.qpos[2] += height + 0.3 * (abs(roll) + abs(pitch))
        data.qpos[3:7] = rpy_quaternion(*np.array([roll, pitch, 0.0]))
        data.qpos[7:] = run.walk.q[0].ravel()
        data.qvel[:] = 0.0
        before, touched = _energy(run), False
        for _ in hold(run, 600):
            # The engine's contacts are those at the step's start, its state that at the end.
            if data.ncon:
                touched = True
                continue
            after = _energy(run)
            if touched:
                gained.append(after - before)
            before, touched = after, False
    why = "Springs and dampers give back less than they take; round-off of 1 J is 1e-16 J."
    yield row("most that any impact gained", np.max(gained), 1e-9, why, unit="J")
    yield samples(len(gained) - 1, "impacts")


def _needs(robot, data, touch, gravity):
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


def _energy(run):
    body, (q, qd, _) = trunk_motion(run.data), joint_state(run.data)
    g = run.experiment.world.gravity
    kinetic = kinetic_energy(run.robot, body, q, qd)
    return float(kinetic + potential_energy(run.robot, body, q, gravity=g))


FRICTIONS = (0.3, 0.7)  # coefficients of friction that are tried
CREEP_SLOPE = math.radians(20)  # slope on which creep is measured
CREEPLESS = 5000.0  # friction damping with which creep at 20° stays below 1e-4 m/s [N·s/m]
FAST_SLIP = 0.05
"""Slip above which a point's friction is on its cone [m/s]: its damper of 500 N·s/m then takes
25 N, more than friction and the point's own inertia need."""


def incline(bench):
    """Find the steepest slope that holds the robot on six feet, joints held, by bisection."""
    for friction in FRICTIONS:
        critical = math.atan(friction)
        low, high = critical - math.radians(2), critical + math.radians(2)
        for _ in range(5):
            middle = (low + high) / 2
            run = bench.standing(friction=friction)
            # Twice the speed at which it could creep with all friction that there is.
            limit = 2 * friction * _weight(run) / _damping(run)
            slides = _speed_on_slope(run, middle) > limit
            low, high = (low, middle) if slides else (middle, high)
        why = "Specified; slip from a slope 0.1° too steep shows after 0.5 s; bisected to 0.06°."
        case, expected = f"steepest that holds, μ = {friction:g}", math.degrees(critical)
        yield row(case, math.degrees((low + high) / 2), 0.5, why, unit="°", expected=expected)


def creep(bench):
    """Compare the creep velocity on a slope of 20° with that of the friction damping."""
    scenario = bench.scenario
    for damping in (scenario.build().world.contact.friction_damping, CREEPLESS):
        run = bench.standing(friction_damping=damping)
        speed = _speed_on_slope(run, CREEP_SLOPE)
        law = _weight(run) * math.sin(CREEP_SLOPE) / _damping(run)
        why = "Sticking friction is a damper in this model. Joints are held to a thousandth."
        yield row(f"{damping:g} N·s/m a point", speed, 1e-3 * law, why, unit="m/s", expected=law)
    why = "The specified 1e-4 m/s; it needs more friction damping than the default."
    yield row(f"bound, {CREEPLESS:g} N·s/m a point", speed, 1e-4, why, unit="m/s")


def stopping(bench):
    """Compare the stopping distance on six feet, joints held, with v²/(2 μ g)."""
    speed, dt = 0.8, 0.00025
    for friction in FRICTIONS:
        run = bench.standing(friction=friction, dt=dt)
        g = run.experiment.world.gravity
        run.data.qvel[0] = speed
        start, aloft = float(run.data.qpos[0]), 0
        steps = round(speed / (friction * g) / dt)
        for k in hold(run, steps + round(0.1 / dt)):
            aloft += k < steps and run.data.ncon == 0
        expected = speed**2 / (2 * friction * g)
        why = (
            "Half a step at full speed is 0.2 %; the damper in which friction ends adds about "
            "0.1 mm, 0.2 %."
        )
        way, case = float(run.data.qpos[0]) - start, f"way, μ = {friction:g}"
        yield row(case, way, 0.005 * expected, why, unit="m", expected=expected)
        why = (
            "A slipping point receives an additional normal force μ · damping · v, as in engines "
            "with convex contact: above load / (μ · damping), here some 0.1 m/s, feet hop."
        )
        case = f"time off the ground, μ = {friction:g}"
        yield row(case, 100 * aloft / steps, None, why, unit="%")


def cone(bench):
    """Check the friction cone at every contact point and step while the robot slides."""
    measured = []
    for friction in FRICTIONS:
        run = bench.standing(friction=friction)
        run.data.qvel[:2] = [0.6, -0.8]
        slipping = 2 * friction * _weight(run) / _damping(run)
        measured += [_friction(run, friction, slipping) for _ in hold(run, 300)]
    over, short, along, slips = np.reshape(measured, (-1, 4)).T
    why = "The cone is exact in the engine; forces below 30 N round by 1e-14 N."
    yield row("beyond μ times the normal force", over.max(initial=0.0), 1e-9, why, unit="N")
    why = (
        f"A point that slips by more than {FAST_SLIP:g} m/s has all the friction that the cone "
        "allows; round-off as above."
    )
    case = "short of μ times the normal force, fast slip"
    yield row(case, short.max(initial=0.0), 1e-9, why, unit="N")
    why = "Friction on a slipping point only dissipates energy."
    yield row("along the slip", along.max(initial=0.0), 1e-9, why, unit="N")
    yield samples(int(slips.sum()), "points that slipped fast, all steps together")


def _friction(run, friction, slipping):
    """Return excess over the cone, shortfall in fast slip and friction along the slip.

    All three are the largest of all points [N]; the last number counts points in fast slip.
    """
    # Contacts, forces and velocities of one instant.
    mujoco.mj_forward(run.model, run.data)
    touch = touching(run.robot, run.model, run.data)
    if not len(touch.leg):
        return 0.0, 0.0, 0.0, 0
    normal = np.sum(touch.force * touch.normal, axis=1)
    tangential = touch.force - normal[:, None] * touch.normal
    slip = touch.velocity - np.sum(touch.velocity * touch.normal, axis=1)[:, None] * touch.normal
    speed = np.linalg.norm(slip, axis=1)
    over = np.linalg.norm(tangential, axis=1) - friction * normal
    slips, fast = speed > slipping, speed > FAST_SLIP
    along = np.sum(tangential * slip, axis=1)[slips] / speed[slips]
    return (
        float(over.max()),
        float(-over[fast].min(initial=0.0)),
        float(along.max(initial=0.0)),
        int(fast.sum()),
    )


def _weight(run):
    return run.robot.mass * run.experiment.world.gravity


def _damping(run):
    """Return the friction damping of all feet's points [N·s/m]."""
    return contact_points(run.robot) * run.experiment.world.contact.friction_damping


def _speed_on_slope(run, slope):
    """Speed downhill, half a second after level ground has become a slope [m/s].

    Gravity is turned, not the ground: seen from the ground it is the same.
    """
    g = run.experiment.world.gravity
    run.model.opt.gravity[:] = [g * math.sin(slope), 0.0, -g * math.cos(slope)]
    for _ in hold(run, round(0.5 / run.dt)):
        pass
    return float(run.data.qvel[0])
