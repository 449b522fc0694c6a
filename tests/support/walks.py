"""Presets with the gaits that they can walk, and robots with odd legs."""

import math
from dataclasses import replace

import numpy as np

from phasmid.gait import GAITS
from phasmid.kinematics import centre_of_mass, joint_angles, neutral_feet
from phasmid.robot import Link, load_robot, preset_names, with_neutral_foot

GAITS_OF = {name: tuple(GAITS[len(load_robot(name).legs)]) for name in preset_names()}
"""Gaits by preset."""

PRESETS_OF = {
    legs: [name for name in preset_names() if len(load_robot(name).legs) == legs] for legs in GAITS
}
"""Presets by number of legs."""


def _different(legs):
    """Names of the gaits of so many legs, one for each schedule."""
    names = {}
    for name, gait in GAITS[legs].items():
        names.setdefault((gait.duty_factor, gait.offsets, gait.sway), name)
    return list(names.values())


SLOW = ("lynxmotion-ch3r", "markwtech")
"""Presets whose servos lift a foot by 30 mm in half of 2 s, but not always in a wave's sixth."""


def _walks():
    """Presets and gaits, each preset with so many legs in turn."""
    found = [(name, "tripod") for name in SLOW]
    for legs, presets in PRESETS_OF.items():
        quick = [name for name in presets if name not in SLOW]
        found += [(quick[k % len(quick)], gait) for k, gait in enumerate(_different(legs))]
    return found


WALKS = _walks()
"""Every gait of a schedule of its own, by the presets with so many legs in turn."""


def neutral_and_mass(name):
    """Neutral feet and centre of mass of a preset, in the body's x and y [m]."""
    robot = load_robot(name)
    q = joint_angles(robot.arrays, robot.arrays.neutral_foot)
    return neutral_feet(robot)[:, :2], centre_of_mass(robot, q)[:2]


def with_servo(**changes):
    """The paper's robot, with other numbers of its servo."""
    robot = load_robot("phantomx-paper")
    return replace(robot, servo=replace(robot.servo, **changes))


def tilted_robot():
    """A hexapod whose coxa axes lean outwards by 20° and aside, legs at yaws of their own.

    Left and right legs are mirror images, masses included: all centres of mass lie in the legs'
    planes.
    """
    turns = {
        "front": (-50.0, 20.0, 8.0),
        "middle": (-85.0, 20.0, -5.0),
        "rear": (-140.0, 20.0, 3.0),
    }

    def mounted(leg):
        side = 1.0 if leg.name.startswith("right") else -1.0
        yaw, pitch, roll = np.radians(turns[leg.name.split("_")[1]])
        links = {link.name: _even(link, link.length) for link in leg.links}
        turned = {"mount_yaw": side * yaw, "mount_pitch": pitch, "mount_roll": side * roll}
        return replace(leg, **links, **turned)

    robot = load_robot("phantomx-paper")
    robot = replace(robot, name="tilted", legs=tuple(mounted(leg) for leg in robot.legs))
    return with_neutral_foot(robot, 0.15, 0.1)


def uneven_robot():
    """A hexapod with longer rear legs: femurs by 15 mm, tibias by 30 mm."""

    def grown(leg):
        if "rear" not in leg.name:
            return leg
        longer = {"femur": leg.femur.length + 0.015, "tibia": leg.tibia.length + 0.03}
        links = {link.name: _even(link, longer[link.name]) for link in leg.links[1:]}
        return replace(leg, **links, neutral_foot=leg.neutral_foot * [1.15, 1.0, 1.0])

    robot = load_robot("phantomx-paper")
    return replace(robot, name="uneven", legs=tuple(grown(leg) for leg in robot.legs))


def _even(link, length):
    """A link of some length as an even rod of 20 mm, its weight grown with its length."""
    mass = link.mass * length / link.length
    across, along = mass * 0.01**2 / 4, mass * 0.01**2 / 2
    across += mass * length**2 / 12
    com = np.array([length / 2, 0.0, 0.0])
    return Link(link.name, length, mass, com, np.diag([along, across, across]))


def scaled_robot(robot, factor):
    """The robot with all lengths times a factor, of the same density."""
    mass, inertia = factor**3, factor**5

    def scaled(link):
        return replace(
            link,
            length=factor * link.length,
            mass=mass * link.mass,
            com=factor * link.com,
            inertia=inertia * link.inertia,
            lateral_offset=factor * link.lateral_offset,
        )

    legs = tuple(
        replace(
            leg,
            coxa=scaled(leg.coxa),
            femur=scaled(leg.femur),
            tibia=scaled(leg.tibia),
            mount_position=factor * leg.mount_position,
            neutral_foot=factor * leg.neutral_foot,
        )
        for leg in robot.legs
    )
    trunk = robot.body
    body = replace(
        trunk,
        mass=mass * trunk.mass,
        com=factor * trunk.com,
        inertia=inertia * trunk.inertia,
        size=factor * trunk.size,
    )
    # Torques follow weight times length; joints turn with the inverse root of the length.
    servo = replace(
        robot.servo,
        rated_stall_torque=factor**4 * robot.servo.stall_torque,
        rated_no_load_speed=robot.servo.no_load_speed / math.sqrt(factor),
    )
    return replace(robot, body=body, legs=legs, servo=servo, appearance=None)
