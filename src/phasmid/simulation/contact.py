"""Feet on the ground: the contact points and their law in the engine."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from phasmid.kinematics import joint_angles, leg_frames
from phasmid.robot import Leg
from phasmid.scenario import Scenario

if TYPE_CHECKING:
    import mujoco

POINT_RADIUS = 0.0005
"""Radius of the small sphere that stands for one contact point [m]."""

CONTACT_POINTS = 4
"""Points of a foot that touch the ground, each a spring and a damper."""


def add_foot(tibia: mujoco.MjsBody, leg: Leg, tip_width: float, friction: list[float]) -> None:
    """Give a tibia its foot: four points that touch the ground, and a site at its tip."""
    import mujoco

    tip = np.array([leg.tibia.length, 0.0, 0.0])
    tibia.add_site(name=f"{leg.name}.foot", pos=tip)
    X_hip_tibia = leg_frames(leg, joint_angles(leg, leg.neutral_foot))[2]
    # Axes of the hip frame in the tibia's at the neutral stance.
    ahead, side, up = X_hip_tibia[:3, :3]
    for i, (a, b) in enumerate(((1, 1), (1, -1), (-1, -1), (-1, 1))):
        corner = tip + tip_width / 2 * (a * ahead + b * side) + POINT_RADIUS * up
        tibia.add_geom(
            name=point_name(leg, i),
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[POINT_RADIUS, 0.0, 0.0],
            pos=corner,
            mass=0.0,
            condim=3,
            friction=friction,
            # The point's own spring counts, not a mixture with the ground's.
            priority=1,
            # Points touch the ground and not each other.
            contype=0,
            conaffinity=1,
        )


def point_name(leg: Leg, point: int) -> str:
    """Name of one of a foot's four contact points in the engine's model."""
    return f"{leg.name}.point{point}"


def set_contact(spec: mujoco.MjSpec, leg: Leg, scenario: Scenario, mobility: float) -> None:
    """Make each contact point a spring and damper in N/m and N·s/m.

    With a constant impedance d the engine's force on a point of mobility A is
    (reference acceleration - acceleration) d / ((1 - d) A). Direct values of -K (1 - d) A and
    -B (1 - d) A, which it divides by d² and d, make this K depth + B speed - m acceleration with
    m = d / ((1 - d) A): exact at rest, and with a small mass of its own in motion.
    """
    d = scenario.contact.impedance
    scale = (1 - d) * mobility
    for i in range(CONTACT_POINTS):
        point = spec.geom(point_name(leg, i))
        point.solimp = [d, d, 0.001, 0.5, 2.0]
        point.solref = [-scenario.contact.stiffness * scale, -scenario.contact.damping * scale]
