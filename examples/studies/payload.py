"""Axis and metric of payload.toml."""

from dataclasses import replace

import numpy as np


def payload(scenario, grams):
    """Put a box of 80 mm on the trunk, its centre 60 mm above the trunk's."""
    if not grams:
        return scenario
    robot = scenario.base_robot()
    body, mass = robot.body, grams / 1000
    place = body.com + np.array([0.0, 0.0, 0.06])
    total = body.mass + mass
    com = (body.mass * body.com + mass * place) / total

    def about(com, mass, offset):
        # The parallel axis theorem.
        return mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))

    box = mass * 0.08**2 / 6 * np.eye(3)
    inertia = body.inertia + about(com, body.mass, body.com - com)
    inertia = inertia + box + about(com, mass, place - com)
    loaded = replace(body, mass=total, com=com, inertia=inertia)
    return scenario.replace(robot=replace(robot, body=loaded))


def warming(recording):
    """Return by how much the warmest servo has warmed during the run [K]."""
    temperature = recording["servo_temperature"].values
    return float((temperature[-1] - temperature[0]).max())
