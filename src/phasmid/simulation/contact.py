"""Feet on the ground: the contact points and their law in the engine."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.kinematics import joint_angles, leg_frames
from phasmid.robot import Leg, Robot
from phasmid.scenario import Scenario

if TYPE_CHECKING:
    import mujoco

POINT_RADIUS = 0.0005
"""Radius of the small sphere that stands for one contact point [m]."""

CONTACT_POINTS = 4
"""Points of a foot that touch the ground, each a spring and a damper."""


SOFT_TIME = 0.02
"""Time constant of the engine's own contact [s]."""


def friction_hardness(scenario: Scenario) -> float:
    """How much harder the engine makes friction than normal forces: its ``impratio``.

    Under its own law it is its own number, one.
    """
    contact = scenario.contact
    if contact.contact_law == "mujoco":
        return 1.0
    return contact.friction_damping / contact.law_damping


def add_belly(trunk: mujoco.MjsBody, robot: Robot, friction: list[float]) -> None:
    """Give the trunk the points on which it can lie: the corners of its underside."""
    for i, corner in enumerate(belly_points(robot)):
        _add_point(trunk, belly_name(i), corner, friction)


def belly_points(robot: Robot) -> Float[np.ndarray, "points 3"]:
    """Centres of the small spheres on which a trunk lies, in the body frame [m], shape (4, 3)."""
    corners = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])
    points = np.concatenate([corners, -np.ones((4, 1))], axis=1) * robot.body.size / 2
    points[:, 2] += POINT_RADIUS
    return points


def belly_name(point: int) -> str:
    """Name of one of the trunk's four contact points in the engine's model."""
    return f"trunk.point{point}"


def add_foot(tibia: mujoco.MjsBody, leg: Leg, tip_width: float, friction: list[float]) -> None:
    """Give a tibia its foot: four points that touch the ground, and a site at its tip."""
    tibia.add_site(name=f"{leg.name}.foot", pos=leg.tibia.end)
    for i, corner in enumerate(foot_points(leg, tip_width)):
        _add_point(tibia, point_name(leg, i), corner, friction)


def _add_point(
    body: mujoco.MjsBody, name: str, place: Float[np.ndarray, "3"], friction: list[float]
) -> None:
    import mujoco

    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[POINT_RADIUS, 0.0, 0.0],
        pos=place,
        mass=0.0,
        condim=3,
        friction=friction,
        # The point's own spring counts, not a mixture with the ground's.
        priority=1,
        # Points touch the ground and not each other.
        contype=0,
        conaffinity=1,
    )


def foot_points(leg: Leg, tip_width: float) -> Float[np.ndarray, "points 3"]:
    """Centres of the small spheres that stand for a foot's contact points.

    Args:
        leg: The leg.
        tip_width: Side of the square on which they lie [m].

    Returns:
        In the tibia's frame [m], shape (4, 3); level when the foot is at its neutral place.
    """
    tip = leg.tibia.end
    X_hip_tibia = leg_frames(leg, joint_angles(leg, leg.neutral_foot))[2]
    # Axes of a level frame of the leg's yaw in the tibia's at the neutral stance.
    ahead, side, up = leg.R_level_hip @ X_hip_tibia[:3, :3]
    return np.stack(
        [
            tip + tip_width / 2 * (a * ahead + b * side) + POINT_RADIUS * up
            for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))
        ]
    )


def point_name(leg: Leg, point: int) -> str:
    """Name of one of a foot's four contact points in the engine's model."""
    return f"{leg.name}.point{point}"


def set_contact(
    spec: mujoco.MjSpec, points: Iterable[str], scenario: Scenario, mobility: float
) -> None:
    """Make contact points springs and dampers in N/m and N·s/m.

    With a constant impedance d the engine's force on a point of mobility A is
    (reference acceleration - acceleration) d / ((1 - d) A). Direct values of -K (1 - d) A and
    -B (1 - d) A, which it divides by d² and d, make this K depth + B speed - m acceleration with
    m = d / ((1 - d) A): exact at rest, and with a small mass of its own in motion. Under the
    engine's own law the points keep its own numbers.
    """
    if scenario.contact.contact_law == "mujoco":
        return
    d = scenario.contact.impedance
    scale = (1 - d) * mobility
    for name in points:
        point = spec.geom(name)
        point.solimp = [d, d, 0.001, 0.5, 2.0]
        point.solref = [-scenario.contact.stiffness * scale, -scenario.contact.law_damping * scale]
