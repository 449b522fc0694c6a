"""Axes of legs.toml: the lengths of the links, with a rule for their masses.

A link is a servo, whose mass stays, and a structure, whose mass grows with the length. The centre
of mass moves along the link with the length, and the inertia grows with the mass and with the
square of the length. The neutral stance stays where it is.
"""

from dataclasses import replace

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
