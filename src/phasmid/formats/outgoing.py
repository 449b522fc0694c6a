"""A robot as a kinematic tree, from which URDF and MJCF are written."""

from __future__ import annotations

import numpy as np

from phasmid.formats.tree import Tree, TreeJoint, TreeLink
from phasmid.kinematics import joint_angles
from phasmid.robot import JOINTS, Link, Part, Robot
from phasmid.robot.inertial import Inertial

BASE = "base_link"


def tree_of(robot: Robot) -> Tree:
    """Convert a robot to a tree; its links' frames are the body's and those of Table 1.

    Links are ``base_link``, ``LEG_coxa_link``, ``LEG_femur_link``, ``LEG_tibia_link`` and the
    massless ``LEG_foot``; joints ``LEG_coxa``, ``LEG_femur``, ``LEG_tibia`` and the fixed
    ``LEG_foot_joint``. Every hinge turns about its child's z, and its angle is that of Table 1.

    """
    body, look = robot.body, robot.appearance
    trunk = Inertial(body.mass, body.com, body.inertia)
    links = {BASE: TreeLink(BASE, trunk, look.body if look else ())}
    joints: list[TreeJoint] = []
    for leg in robot.legs:
        # From the coxa's frame to the femur's: a quarter turn about x.
        poses = (
            leg.X_body_hip,
            _end(leg.coxa, [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
            _end(leg.femur),
        )
        parent = BASE
        for joint, link, X, limits in zip(JOINTS, leg.links, poses, leg.joint_limits, strict=True):
            name = f"{leg.name}_{joint}"
            child = f"{name}_link"
            links[child] = _link(child, link, look.link(leg.name, joint) if look else ())
            joints.append(
                TreeJoint(
                    name,
                    "revolute",
                    parent,
                    child,
                    X,
                    lower=float(limits[0]),
                    upper=float(limits[1]),
                    effort=robot.servo.stall_torque,
                    velocity=robot.servo.no_load_speed,
                    friction=robot.servo.friction,
                    damping=robot.servo.viscous_friction,
                    armature=robot.servo.armature,
                )
            )
            parent = child
        foot = f"{leg.name}_foot"
        links[foot] = TreeLink(foot)
        joints.append(TreeJoint(f"{foot}_joint", "fixed", parent, foot, _end(leg.tibia)))
    return Tree(robot.name, links, tuple(joints))


def _link(name: str, link: Link, parts: tuple[Part, ...]) -> TreeLink:
    return TreeLink(name, Inertial(link.mass, link.com, link.inertia), parts)


def _end(link: Link, R: list[list[float]] | None = None) -> np.ndarray:
    """Return the pose of the next link's frame, or of the foot, in a link's frame."""
    X = np.eye(4)
    if R is not None:
        X[:3, :3] = R
    X[:3, 3] = link.end
    return X


def neutral_angles(robot: Robot) -> dict[str, float]:
    """Return angles of the tree's hinges with which all feet are at their neutral places [rad]."""
    return {
        f"{leg.name}_{joint}": float(angle)
        for leg in robot.legs
        for joint, angle in zip(JOINTS, joint_angles(leg, leg.neutral_foot), strict=True)
    }
