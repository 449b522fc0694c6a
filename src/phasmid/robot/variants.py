"""Variants of a robot: mass model, mounts, neutral feet and payload."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.robot.inertial import Inertial, merged
from phasmid.robot.leg import RATIOS, Leg
from phasmid.robot.link import Link
from phasmid.robot.robot import Robot
from phasmid.servo.servo import Servo

MassModel = Literal["as-given", "mid-length"]
MountLayout = Literal["as-given", "perpendicular"]


def with_mass_model(robot: Robot, model: MassModel) -> Robot:
    """Return the robot with its link masses as given, or as the printed Eq. 10 assumes.

    Args:
        robot: The robot.
        model: ``as-given`` changes nothing. ``mid-length`` puts each link's centre of mass at the
            middle of its length and keeps only the diagonal of its inertia.

    Source: Table 2 against Eq. 10.
    """
    if model == "as-given":
        return robot

    def middle(link: Link) -> Link:
        com = np.array([link.length / 2, 0.0, 0.0])
        return replace(link, com=com, inertia=np.diag(np.diag(link.inertia)))

    legs = tuple(
        replace(leg, coxa=middle(leg.coxa), femur=middle(leg.femur), tibia=middle(leg.tibia))
        for leg in robot.legs
    )
    return replace(robot, legs=legs)


def with_mounts(robot: Robot, layout: MountLayout) -> Robot:
    """Return the robot with its mounts as given, or perpendicular to the direction of walking.

    Args:
        robot: The robot.
        layout: ``as-given`` changes nothing. ``perpendicular`` turns right legs to -90 degrees
            and left legs to +90 degrees; each foot keeps its distance from its hip, and each hip
            its tilt.
    """
    if layout == "as-given":
        return robot

    def square(leg: Leg) -> Leg:
        return replace(leg, mount_yaw=math.copysign(math.pi / 2, leg.mount_position[1]))

    return replace(robot, legs=tuple(square(leg) for leg in robot.legs))


def with_neutral_foot(robot: Robot, radius: float | None, height: float | None) -> Robot:
    """Return the robot with other neutral feet.

    Horizontal and height are those of the level body, however the hips are tilted; each foot stays
    in its direction from its hip as seen from above.

    Args:
        robot: The robot.
        radius: Horizontal distance of the neutral feet from their hips [m], or None.
        height: Height of the hips over their neutral feet [m], or None.

    Raises:
        InvalidRobot: A hip is tilted so far that its leg would point inwards.
    """
    if radius is None and height is None:
        return robot

    def place(leg: Leg) -> Leg:
        x, y, z = leg.R_level_hip @ leg.neutral_foot
        if radius is not None and not math.hypot(x, y):
            # A foot straight below its hip goes where the leg points.
            x = 1.0
        scale = 1.0 if radius is None else radius / math.hypot(x, y)
        foot = np.array([x * scale, y * scale, z if height is None else robot.foot_radius - height])
        return replace(leg, neutral_foot=leg.R_level_hip.T @ foot)

    return replace(robot, legs=tuple(place(leg) for leg in robot.legs))


def with_servo(robot: Robot, servo: Servo) -> Robot:
    """Return the robot with the same servo at every joint.

    The additional mass of heavier servos is added at the trunk's centre of mass, since a robot does
    not say where its servos are. Lighter ones leave the masses: no load is underestimated.
    """
    alike: dict[str, Any] = dict.fromkeys(RATIOS, np.ones(3))
    legs = tuple(replace(leg, **alike) for leg in robot.legs)
    body, own = robot.body, robot.servo.mass
    if own is not None and servo.mass is not None and servo.mass > own:
        body = replace(body, mass=body.mass + 3 * len(legs) * (servo.mass - own))
    return replace(robot, servo=servo, legs=legs, body=body)


def with_payload(robot: Robot, mass: float) -> Robot:
    """Return the robot with a payload: a point mass at the centre of the trunk's upper side.

    Args:
        robot: The robot.
        mass: Of the load [kg], 0 or more.

    Raises:
        InvalidInput: The mass is negative or not finite.
    """
    if not (math.isfinite(mass) and mass >= 0):
        raise InvalidInput(f"payload is {mass:g} kg; it must be a finite number, 0 or more.")
    if mass == 0:
        return robot
    body = robot.body
    load = Inertial(mass, body.box_points(np.array([0.0, 0.0, 1.0])), np.zeros((3, 3)))
    total = merged([Inertial(body.mass, body.com, body.inertia), load])
    assert total is not None
    loaded = replace(body, mass=total.mass, com=total.com, inertia=total.inertia)
    return replace(robot, body=loaded)
