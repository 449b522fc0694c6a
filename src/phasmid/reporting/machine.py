"""A robot's shape at one moment of a recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.reporting.shapes import Mesh, ball, beam, box, cylinder, joined, loft, rgb, slab
from phasmid.reporting.style import leg_colour
from phasmid.robot import JOINTS, Leg, Part, Robot

PLATE, FRAME, SERVO, RUBBER, LAMP = "#4a515e", "#7d8796", "#343941", "#24272c", "#e8edf4"

GREY = 0.15
"""Colours whose strongest and weakest channel differ by less than this are grey."""


def body_pose(
    position: Float[np.ndarray, "3"], orientation: Float[np.ndarray, "4"]
) -> Float[np.ndarray, "4 4"]:
    """``X_world_body`` of a position [m] and a unit quaternion."""
    X = np.eye(4)
    X[:3, :3] = kinematics.quaternion_rotation(orientation)
    X[:3, 3] = position
    return X


def robot_mesh(
    robot: Robot, q: Float[np.ndarray, "legs 3"], X_world_body: Float[np.ndarray, "4 4"]
) -> Mesh:
    """The robot in the world.

    Args:
        robot: It looks as its meshes say; without any, its lengths and mounts give the shape, and
            widths are made up.
        q: Joint angles [rad], shape (L, 3).
        X_world_body: Pose of the body.
    """
    links = link_meshes(robot)
    parts = [mesh.at(X_world_body) for mesh in links.body]
    for number, leg in enumerate(robot.legs):
        X_world_hip = X_world_body @ leg.X_body_hip
        frames = X_world_hip @ kinematics.leg_frames(leg, q[number])
        for X_world_link, pieces in zip(frames, links.legs[number], strict=True):
            parts += [mesh.at(X_world_link) for mesh in pieces]
    return joined(parts)


LegMeshes = tuple[list[Mesh], list[Mesh], list[Mesh], list[Mesh]]


@dataclass(frozen=True, eq=False)
class LinkMeshes:
    """A robot's look, each piece in the frame of its link.

    Attributes:
        body: Pieces of the trunk, in the body's frame.
        legs: Of each leg the pieces in its frames of coxa, femur, tibia and foot.
    """

    body: list[Mesh]
    legs: list[LegMeshes]


def link_meshes(robot: Robot) -> LinkMeshes:
    """What moves as one piece: the trunk and, leg by leg, coxa, femur, tibia and foot.

    Args:
        robot: It looks as its meshes say; without any, its lengths and mounts give the shape, and
            widths are made up.
    """
    look = robot.appearance
    if look is not None and look.parts:
        legs: list[LegMeshes] = []
        for number, leg in enumerate(robot.legs):
            colour = leg_colour(number)
            coxa, femur, tibia = (
                [_mesh(part, colour) for part in look.link(leg.name, joint)] for joint in JOINTS
            )
            legs.append((coxa, femur, tibia, []))
        return LinkMeshes([_mesh(part) for part in look.body], legs)
    width = 0.38 * float(np.median(robot.arrays.lengths[:, 1]))
    height = float(robot.body.size[2])
    legs = [_leg(leg, width, leg_colour(number), height) for number, leg in enumerate(robot.legs)]
    return LinkMeshes([body_mesh(robot, width)], legs)


def _mesh(part: Part, leg_colour: str = "") -> Mesh:
    """A part as triangles; what is coloured, and not grey, wears its leg's colour."""
    colour = np.array(part.color[:3])
    if leg_colour and np.ptp(colour) > GREY:
        colour = rgb(leg_colour)
    return Mesh(part.vertices[part.faces], np.broadcast_to(colour, (len(part.faces), 3)))


def body_mesh(robot: Robot, width: float) -> Mesh:
    """The trunk in its own frame: two plates that hold the hips, and what is between and on top."""
    hips = robot.arrays.p_body_hip
    length, breadth, height = (float(s) for s in robot.body.size)
    middle = float(hips[:, 2].mean())
    top, bottom = middle + height / 2, middle - height / 2
    plate = 0.09 * height
    outline = hips[:, :2]
    parts = [
        slab(outline, 0.62 * width, bottom, bottom + plate, PLATE),
        slab(outline, 0.62 * width, top - plate, top, PLATE),
        box((0, 0, middle), (0.78 * length, 0.42 * breadth, 0.80 * height), SERVO),
        slab(0.52 * outline, 0.35 * width, top, top + 0.18 * height, FRAME),
        box(
            (0.02 * length, 0, top + 0.26 * height),
            (0.30 * length, 0.34 * breadth, 0.22 * height),
            SERVO,
        ),
    ]
    # An arrow on the lid tells which way is forward.
    tip, root, side = 0.13 * length, 0.02 * length, 0.085 * breadth
    lid = top + 0.372 * height
    arrow = np.array([[tip, 0], [root, side], [root + 0.02 * length, 0], [root, -side]])
    rings = np.stack([np.c_[arrow, np.full(4, z)] for z in (lid - 0.004, lid)])
    return joined([*parts, loft(rings, LAMP)])


def _leg(leg: Leg, w: float, colour: str, height: float) -> LegMeshes:
    """Coxa, femur and tibia as servos, brackets and a blade with a rubber tip."""
    coxa, femur, tibia = (float(length) for length in leg.lengths)
    up = np.array([0.0, 0.0, 1.0])
    zero = np.zeros(3)
    hip = cylinder(-0.40 * height * up, 0.40 * height * up, (0.46 * w, 0.46 * w), FRAME)
    yoke = beam(
        [
            (-0.30 * w, 0.34 * w, 0.42 * w),
            (-0.22 * w, 0.42 * w, 0.50 * w),
            (coxa - 0.25 * w, 0.42 * w, 0.50 * w),
            (coxa + 0.10 * w, 0.34 * w, 0.36 * w),
        ],
        SERVO,
    )
    pivot = cylinder(-0.66 * w * up, 0.66 * w * up, (0.36 * w, 0.36 * w), FRAME)
    thigh = [pivot]
    for side in (-1, 1):
        plate = beam(
            [
                (-0.34 * w, 0.20 * w, 0.07 * w),
                (-0.10 * w, 0.42 * w, 0.07 * w),
                (0.5 * femur, 0.30 * w, 0.07 * w),
                (femur + 0.10 * w, 0.42 * w, 0.07 * w),
                (femur + 0.34 * w, 0.20 * w, 0.07 * w),
            ],
            colour,
            chamfer=0.5,
        )
        offset = np.eye(4)
        offset[2, 3] = side * 0.53 * w
        thigh.append(plate.at(offset))
    knee = beam(
        [
            (0.36 * femur, 0.22 * w, 0.38 * w),
            (0.40 * femur, 0.30 * w, 0.44 * w),
            (femur - 0.05 * w, 0.36 * w, 0.44 * w),
        ],
        SERVO,
    )
    thigh.append(knee)
    blade = beam(
        [
            (-0.30 * w, 0.26 * w, 0.30 * w),
            (0.10 * w, 0.44 * w, 0.42 * w),
            (0.30 * tibia, 0.40 * w, 0.34 * w),
            (0.72 * tibia, 0.19 * w, 0.20 * w),
            (tibia - 0.12 * w, 0.12 * w, 0.13 * w),
        ],
        colour,
    )
    return [hip, yoke], thigh, [pivot, blade], [ball(zero, 0.17 * w, RUBBER)]


def ribbon(
    points: Float[np.ndarray, "points 3"], eye: Float[np.ndarray, "3"], width: float, colour: str
) -> Mesh:
    """A line of some width [m] that faces the eye."""
    along = np.gradient(points, axis=0)
    side = np.cross(along, eye - points)
    side *= width / 2 / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
    left, right = points - side, points + side
    corners = np.concatenate(
        [
            np.stack([left[:-1], right[:-1], right[1:]], axis=1),
            np.stack([left[:-1], right[1:], left[1:]], axis=1),
        ]
    )
    return Mesh(corners, np.broadcast_to(rgb(colour), (len(corners), 3)))
