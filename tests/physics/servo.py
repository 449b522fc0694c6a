"""Servos within their limits, in every sample of walks and sweeps that reach them."""

from dataclasses import replace

import mujoco
import numpy as np

from phasmid.errors import InfeasibleWalk
from phasmid.experiment import Solver
from phasmid.motion import plan
from phasmid.simulation.drives import Setpoints
from phasmid.tables import choices
from physics.rows import row, samples

# Mass added to the trunk of the overloaded robot [kg]: 2.5 times the mass of the paper's robot.
LOAD = 4.0
# A gait near the shortest period that the servos allow; the voltage counts for their own law.
OVERLOADED = {"period": 0.6, "duration": 2.0, "servo": {"voltage": 10.0}}
# Angle of all coxas to either side of their mounts in a sweep [rad], and steps to each side.
SWEEP, SWEEP_STEPS = 1.2, 300
NEAR = 0.9  # part of the no-load speed at which a sample counts as at the limit; friction takes 2 %
RAMP = 1.0  # rate at which goals leave the range [rad/s]
CLAMPED = "Limits are clamped and laws are kept in every sample, to round-off."


def servo_limits(bench):
    """Excess over the limits of torque, speed and angle, and how often each limit is reached.

    The overloaded walk counts up to its end, however it ends. Prescribed joints have no limits.
    """
    robot = _overloaded(bench.scenario.base_robot())
    for drive in choices(Solver.model_fields["drive"]):
        if drive == "prescribed":
            continue
        changes = {**OVERLOADED, "robot": robot, "drive": drive}
        # The rotor's motion is followed from one step to the next.
        changes["record_interval"] = bench.scenario.simulation.time_step
        scenario = bench.scenario.replace(**changes)
        recording = bench.run(scenario).simulate()
        if drive == "servo":
            limits = _motor(scenario, recording) | _goal_range(bench)
        else:
            limits = _line(scenario, recording) | _speed(bench, drive)
        for what, (excess, unit, reached) in limits.items():
            case = f"{what}, {drive}"
            yield row(case, max(excess, 0.0), 1e-9, CLAMPED, unit=unit)
            if reached is not None:
                yield samples(int(reached.sum()), f"samples at the limit: {case}")
    yield from _planned_range(bench)


def _overloaded(robot):
    body = robot.body
    mass = body.mass + LOAD
    return replace(robot, body=replace(body, mass=mass, inertia=body.inertia * mass / body.mass))


def _line(scenario, recording):
    """Measure motors' torques against stall, and driving ones against the torque-speed line.

    The engine's friction holds a load beside the actuator, whose part is that much less.
    """
    servo = scenario.load_robot().servo
    most = servo.stall_torque - servo.friction
    torque, speed = (recording[n].values for n in ("servo_motor_torque", "joint_velocity"))
    driving = np.maximum(torque * np.sign(speed), 0.0)
    line = most * np.maximum(1 - np.abs(speed) / servo.no_load_speed, 0.0)
    stall, over = np.abs(torque) - most, driving - line
    on_line = (over > -1e-9) & (line > 0) & (speed != 0)
    return {
        "torque": (float(stall.max()), "N·m", stall > -1e-9),
        "torque at speed": (float(over.max()), "N·m", on_line),
    }


def _motor(scenario, recording):
    """Measure the motor's output under its supply, and the torque behind its gears.

    A step begins with the rotor's speed of the sample before and ends with that of its own: with
    i = (duty V - k w')/R its inertia takes J (w - w')/dt = k i - b w' - torque - friction, and the
    friction is no more than c0 + c1 |k i|. Gears at the stall torque drag the rotor along.
    """
    servo = scenario.load_robot().servo
    motor = servo.motor
    duty, current = (recording[f"servo_{name}"].values[1:] for name in ("duty", "current"))
    torque, speed = recording["joint_torque"].values[1:], recording["servo_speed"].values
    running = ~recording["servo_shutdown"].values[:-1]
    before, change = speed[:-1], np.diff(speed, axis=0) / scenario.simulation.time_step
    law = running * (duty * servo.voltage - motor.constant * before) / motor.resistance
    push = motor.constant * current
    friction = push - motor.viscous * before - servo.armature * change - torque
    most = motor.friction.limit(push, -torque, before) - motor.viscous * np.abs(before)
    beyond = np.abs(torque) - servo.stall_torque
    supply = np.abs(duty) - servo.torque_limit
    loss = np.where(beyond < 0, np.abs(friction) - most, 0.0)
    off = np.abs(current - law)
    return {
        "torque": (float(beyond.max()), "N·m", beyond > -1e-9),
        "share of the supply": (float(supply.max()), "1", supply > -1e-9),
        "current, off the motor's law": (float(off.max()), "A", None),
        "torque, beyond what friction explains": (float(loss.max()), "N·m", None),
    }


def _speed(bench, drive):
    """Measure the speed of coxas that are swept to and fro in the air."""
    limit = bench.scenario.load_robot().servo.no_load_speed
    speed, _ = _sweep(bench, drive, np.repeat([-SWEEP, SWEEP], SWEEP_STEPS))
    reached = np.abs(speed) > NEAR * limit
    return {"speed": (float(np.abs(speed).max() - limit), "rad/s", reached)}


def _goal_range(bench):
    """Measure the angles of coxas whose goals leave the range; the servo's sensor has steps."""
    robot = bench.scenario.load_robot()
    upper, step = robot.arrays.joint_limits[:, 0, 1], robot.servo.resolution
    goals = np.arange(0.0, 1.5 * upper.max(), RAMP * bench.scenario.simulation.time_step)
    _, angle = _sweep(bench, "servo", goals)
    reached = angle > upper - step
    return {"range and a step of the sensor": (float((angle - upper - step).max()), "rad", reached)}


def _sweep(bench, drive, goals):
    """Return speeds [rad/s] and angles [rad] of all coxas that follow goals, without gravity."""
    run = bench.standing(drive=drive)
    data, q = run.data, run.walk.q[:1].copy()
    run.model.opt.gravity[:] = 0.0
    data.qpos[2] += 1.0
    data.qvel[:] = 0.0
    speed, angle = np.empty((2, len(goals), len(run.robot.legs)))
    for k, goal in enumerate(goals):
        q[..., 0] = goal
        run.drive.command(run.drive.targets(Setpoints(q, 0 * q, 0 * q))[0])
        mujoco.mj_step(run.model, data)
        speed[k], angle[k] = data.qvel[6::3], data.qpos[7::3]
    return speed, angle


def _planned_range(bench):
    """Plan the walk for coxas with nine tenths of the range that it needs; it must be refused.

    Ideal servos and joints driven by torque take any goal: the plan keeps them in the range.
    """
    robot = bench.scenario.base_robot()
    most = 0.9 * float(np.abs(plan(bench.scenario).q[..., 0]).max())
    legs = []
    for leg in robot.legs:
        limits = np.array(leg.joint_limits)
        limits[0] = -most, most
        legs.append(replace(leg, joint_limits=limits))
    excess, refused = 0.0, 0
    try:
        walk = plan(bench.scenario.replace(robot=replace(robot, legs=tuple(legs))))
        excess = float(np.abs(walk.q[..., 0]).max() - most)
    except InfeasibleWalk:
        refused = 1
    case = "range, ideal-servo and torque, by the plan"
    yield row(case, excess, 1e-9, "A plan beyond the range is refused.", unit="rad")
    yield samples(refused, "plans refused")
