"""Axes and metrics of legs.toml: lengths of the links and the servo, with rules for their masses.

A link is a servo, whose mass stays, and a structure, whose mass grows with the length. The centre
of mass moves along the link with the length, and the inertia grows with the mass and with the
square of the length. The neutral stance stays where it is. What 18 other servos weigh more is added
to the payload.
"""

from dataclasses import replace

import numpy as np

from phasmid.reporting.run import read_run
from phasmid.servo import load_servo

SERVO = 0.0546
"""Mass of an AX-12A [kg]."""


def coxa(scenario, millimetres):
    """Set the length of all coxae."""
    return _with_length(scenario, "coxa", millimetres / 1000)


def femur(scenario, millimetres):
    """Set the length of all femora."""
    return _with_length(scenario, "femur", millimetres / 1000)


def tibia(scenario, millimetres):
    """Set the length of all tibiae."""
    return _with_length(scenario, "tibia", millimetres / 1000)


def servo(scenario, name):
    """Set the servo of all joints, and what it weighs more."""
    more = 3 * len(scenario.base_robot().legs) * max(load_servo(name).mass - SERVO, 0.0)
    return scenario.replace(servo=name, payload=scenario.model.payload + more)


def share(recording):
    """Return the largest rms torque of a joint over the continuous torque of its servo."""
    torque = recording["joint_torque_model"].values
    return float(np.sqrt((torque**2).mean(axis=0)).max()) / read_run(recording).continuous_torque


def price(recording):
    """Return what the servos cost, by the catalogue [US dollars]."""
    robot = read_run(recording).robot
    return 3 * len(robot.legs) * robot.servo.price


def _with_length(scenario, name, length):
    robot = scenario.base_robot()
    legs = tuple(replace(leg, **{name: _scaled(getattr(leg, name), length)}) for leg in robot.legs)
    return scenario.replace(robot=replace(robot, legs=legs))


def _scaled(link, length):
    ratio = length / link.length
    servo = min(SERVO, link.mass)
    mass = servo + (link.mass - servo) * ratio
    return replace(
        link,
        length=length,
        mass=mass,
        com=link.com * [ratio, 1, 1],
        inertia=link.inertia * (mass / link.mass) * ratio**2,
    )
