"""Robots of massless legs, whose statics can be computed by hand."""

from dataclasses import replace

import numpy as np

from phasmid.advice.bounds import Postures, postures, static_loads
from phasmid.scenario import Scenario


def with_massless_legs(robot, mass):
    """All of the mass in the trunk, at its origin: links of a millionth of a gram."""
    legs = tuple(
        replace(
            leg,
            **{
                link.name: replace(link, mass=1e-9, inertia=1e-12 * np.eye(3)) for link in leg.links
            },
        )
        for leg in robot.legs
    )
    return replace(robot, legs=legs, body=replace(robot.body, mass=mass, com=np.zeros(3)))


def with_numbers(robot, **numbers):
    """Other numbers of the robot's servo."""
    return replace(robot, servo=replace(robot.servo, **numbers))


def stance_of(robot):
    """The static loads of a robot that stands on all feet."""
    experiment = Scenario(robot=robot).build()
    chosen = postures(experiment)
    rows = (getattr(chosen, name)[-1:] for name in ("q", "qd", "stance", "phase", "weight"))
    return static_loads(experiment, chosen=Postures(*rows, chosen.fastest))
