"""Height and tilt of the trunk in random driven walks on level ground."""

from dataclasses import replace
from itertools import combinations

import numpy as np

import phasmid
from phasmid.experiment import Command, Ending
from phasmid.forces import holding_forces
from phasmid.gait import gaits_of, support_margin
from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
from phasmid.robot import load_robot
from phasmid.scenario import Scenario
from phasmid.simulation import drive
from phasmid.terrain import Flat, Ground

DRIVES = ("prescribed", "ideal-servo", "servo")

FASTEST = (0.06, 0.04, 0.15)
"""Largest commanded velocity: forward, lateral [m/s] and yaw [rad/s]."""

LIGHT = (0.6, 1.6)
"""Masses of every fourth robot, scaled in all its links [kg]."""

ROBOTS = ("octopod", "phantomx-ax", "phantomx-mk4", "phantomx-paper", "quadruped")
"""Presets that take turns."""

SETTLED = 1.0
"""Time after which the trunk's height counts: the servos of the standing robot start without
torque [s]."""

HOP = 1e-3
"""Largest distance of the trunk from its mean height [m]."""


def cases(count, seed):
    """Return random velocities for robots, gaits and drives in turn."""
    generator = np.random.default_rng(seed)
    kinds = [
        (robot, gait, joints)
        for robot in ROBOTS
        for gait in gaits_of(len(load_robot(robot).legs))
        for joints in DRIVES
    ]
    order = generator.permutation(len(kinds))
    return [
        {
            "robot": kinds[order[i % len(kinds)]][0],
            "gait": kinds[order[i % len(kinds)]][1],
            "joints": kinds[order[i % len(kinds)]][2],
            "velocity": [float(v * generator.uniform(-1, 1)) for v in FASTEST],
            "mass": float(generator.uniform(*LIGHT)) if i % 4 == 3 else None,
        }
        for i in range(count)
    ]


def scaled(robot, mass):
    """Return the robot with all masses and inertias scaled to a total mass [kg]."""
    share = mass / robot.mass

    def light(part):
        return replace(part, mass=share * part.mass, inertia=share * part.inertia)

    legs = tuple(
        replace(leg, coxa=light(leg.coxa), femur=light(leg.femur), tibia=light(leg.tibia))
        for leg in robot.legs
    )
    return replace(robot, body=light(robot.body), legs=legs)


def measure(robot, gait, joints, velocity, mass=None, duration=6.0):
    """Walk once with the default controller."""
    machine = load_robot(robot)
    scenario = Scenario().replace(
        robot=machine if mass is None else scaled(machine, mass),
        gait=gait,
        drive=joints,
        duration=duration,
        record_interval_ms=2,
        terrain="flat",
        # The gears of a servo are stiffer than 1 ms resolves on a light leg.
        dt=0.001 if mass is None else 0.00025,
    )
    run = drive(scenario, None, Command(velocity=tuple(velocity)))
    time, z = run["time"].values, run["body_position"].values[:, 2]
    since = int(np.searchsorted(time, SETTLED))
    if not Ending[run.attrs["ending"]].is_full_length:
        return {"ending": run.attrs["ending"]}
    reference = np.mean(run["velocity_reference"].values[since:], axis=0)
    height = z[since:] - z[since:].mean()
    return {
        "ending": run.attrs["ending"],
        "hop": float(np.abs(height).max()),
        "torque": float(np.abs(run["joint_torque"].values[since:]).max()),
        "planned_torque": planned_torque(scenario, reference),
    }


def planned_torque(scenario, velocity):
    """Return the largest torque that the walk at a velocity can need [N·m].

    The larger one of the planned walk's inverse dynamics and of statics: where more than three feet
    stand, stiff legs leave the load to any three of them that hold the robot.

    Args:
        scenario: Robot, gait and period.
        velocity: Of the body: forward, lateral [m/s], yaw [rad/s], shape (3,).
    """
    robot = scenario.load_robot()
    gait = scenario.load_gait(len(robot.legs))
    step = velocity * gait.duty_factor * scenario.build().course.stride.period
    planned = scenario.replace(
        step_length=float(step[0]),
        step_sideways=float(step[1]),
        step_turn=float(step[2]),
        stance_timing="constant-speed",
        drive="prescribed",
        duration=scenario.build().course.stride.period,
    )
    model = phasmid.analyse(planned, phasmid.plan(planned))
    largest = [float(np.abs(model["joint_torque_model"].values).max())]
    feet = neutral_feet(robot)
    q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    com = centre_of_mass(robot, q)[:2]
    stances = {tuple(map(int, np.flatnonzero(row))) for row in gait.stance(gait.events + 1e-6)}
    for three in {three for stance in stances for three in combinations(stance, 3)}:
        stance = np.isin(np.arange(len(feet)), three)
        if support_margin(feet[:, :2], stance, com) > 0:
            held = holding_forces(
                planned.build(), np.zeros(3), np.eye(3), q, feet, stance, Ground(Flat(), 1.0)
            )
            largest.append(float(np.abs(held.torque).max()))
    return max(largest)
