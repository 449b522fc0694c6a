"""The shape of a robot as meshes, link by link, and the solids of robots without meshes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.reporting.style import leg_colour, rgb
from phasmid.robot import JOINTS, Leg, Part, Robot

PLATE, FRAME, SERVO, RUBBER, LAMP = "#4a515e", "#7d8796", "#343941", "#24272c", "#e8edf4"

GREY = 0.15
"""Colours whose strongest and weakest channel differ by less than this are grey."""

Place: TypeAlias = tuple[int, int]
"""Number of a leg, from 0, and of its frame: coxa, femur, tibia, foot."""

Section: TypeAlias = tuple[float, float, float]
"""Place along x, half width in y and half width in z of a beam [m]."""


def hull(points: Float[np.ndarray, "points 3"], colour: str) -> Part:
    """Return the convex hull of points [m] in a colour such as ``#4a6fc4``."""
    import trimesh

    solid = trimesh.convex.convex_hull(points)
    return Part(solid.vertices, solid.faces, (*rgb(colour).tolist(), 1.0))


def beam(sections: Iterable[Section], colour: str) -> Part:
    """Return a beam along x through rectangles with cut corners."""
    corners = [
        (x, side * wide, up * high)
        for x, y, z in sections
        for wide, high in ((y, 0.65 * z), (0.65 * y, z))
        for side in (-1, 1)
        for up in (-1, 1)
    ]
    return hull(np.array(corners), colour)


def plate(
    points: Float[np.ndarray, "points 2"], radius: float, low: float, high: float, colour: str
) -> Part:
    """Return a plate from a height to another [m], whose outline is rounded off about points."""
    angle = np.arange(24) * math.pi / 12
    circle = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    outline = (points[:, None] + circle).reshape(-1, 2)
    return hull(
        np.concatenate([np.c_[outline, np.full(len(outline), z)] for z in (low, high)]), colour
    )


def cylinder(height: float, radius: float, colour: str) -> Part:
    """Return a cylinder along z about the origin [m]."""
    return plate(np.zeros((1, 2)), radius, -height / 2, height / 2, colour)


def ball(radius: float, colour: str) -> Part:
    """Return a ball about the origin [m]."""
    import trimesh

    return hull(trimesh.creation.icosphere(subdivisions=2, radius=radius).vertices, colour)


def body_pose(
    position: Float[np.ndarray, "*batch 3"], orientation: Float[np.ndarray, "*batch 4"]
) -> Float[np.ndarray, "*batch 4 4"]:
    """Return ``X_world_body`` of positions [m] and unit quaternions."""
    X = np.zeros((*position.shape[:-1], 4, 4))
    X[..., :3, :3] = kinematics.quaternion_rotation(orientation)
    X[..., :3, 3], X[..., 3, 3] = position, 1.0
    return X


def robot_corners(
    robot: Robot, q: Float[np.ndarray, "legs 3"], X_world_body: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "corners 3"]:
    """Return the corners of the robot's meshes in the world [m].

    Args:
        robot: The robot.
        q: Joint angles [rad], shape (L, 3).
        X_world_body: Pose of the body.
    """
    solids = link_meshes(robot)
    links = [place for place in solids if place is not None]
    X = dict(zip(links, link_poses(robot, q[None], links)[0], strict=True))
    return np.concatenate(
        [
            part.at(X_world_body if place is None else X_world_body @ X[place]).vertices
            for place, parts in solids.items()
            for part in parts
        ]
    )


def link_meshes(robot: Robot) -> dict[Place | None, list[Part]]:
    """Return the meshes of each link in its own frame; those of the trunk by None.

    They are the robot's appearance. Without one, lengths and mounts give the shape, with assumed
    widths.
    """
    look = robot.appearance
    found: dict[Place | None, list[Part]]
    if look is not None and look.parts:
        found = {None: list(look.body)}
        for number, leg in enumerate(robot.legs):
            for frame, joint in enumerate(JOINTS):
                parts = [_of_leg(part, number) for part in look.link(leg.name, joint)]
                if parts:
                    found[number, frame] = parts
        return found
    width = 0.38 * float(np.median(robot.arrays.lengths[:, 1]))
    found = {None: _body(robot, width)}
    for number, leg in enumerate(robot.legs):
        links = _leg(leg, width, leg_colour(number), float(robot.body.size[2]))
        found |= {(number, frame): meshes for frame, meshes in enumerate(links)}
    return found


@dataclass(frozen=True, eq=False)
class MeshPieces:
    """A robot's meshes, each once.

    Attributes:
        meshes: Vertices [m] and triangles of each mesh, in the frame of its link.
        links: Legs' links with a mesh.
        pieces: Index of the link, -1 for the trunk, index of the mesh, and colour of each piece.
    """

    meshes: list[tuple[np.ndarray, np.ndarray]]
    links: list[Place]
    pieces: list[tuple[int, int, tuple[float, ...]]]


def mesh_pieces(robot: Robot) -> MeshPieces:
    """Return a robot's meshes; legs that are alike share them."""
    import trimesh

    solids = link_meshes(robot)
    links = [place for place in solids if place is not None]
    numbers: dict[bytes, int] = {}
    meshes: list[tuple[np.ndarray, np.ndarray]] = []
    pieces: list[tuple[int, int, tuple[float, ...]]] = []
    for place, parts in solids.items():
        link = -1 if place is None else links.index(place)
        for part in parts:
            key = part.vertices.tobytes() + part.faces.tobytes()
            if key not in numbers:
                numbers[key] = len(meshes)
                # Corners that triangles share are one vertex.
                mesh = trimesh.Trimesh(part.vertices, part.faces)
                meshes.append((mesh.vertices, mesh.faces[mesh.nondegenerate_faces()]))
            pieces.append((link, numbers[key], tuple(np.round(part.color[:3], 4).tolist())))
    return MeshPieces(meshes, links, pieces)


def link_poses(
    robot: Robot, q: Float[np.ndarray, "frames legs 3"], links: Sequence[Place]
) -> Float[np.ndarray, "frames links 4 4"]:
    """Return ``X_body_link`` of each sample and link."""
    frames = [
        leg.X_body_hip @ kinematics.leg_frames(leg, q[:, number])
        for number, leg in enumerate(robot.legs)
    ]
    poses = [frames[leg][:, frame] for leg, frame in links]
    return np.stack(poses, axis=1) if poses else np.zeros((len(q), 0, 4, 4))


def quaternions(R: Float[np.ndarray, "*batch 3 3"]) -> Float[np.ndarray, "*batch 4"]:
    """Return unit quaternions of rotations, w x y z, shape (..., 4)."""
    from scipy.spatial.transform import Rotation

    found = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    return np.asarray(found).reshape(*R.shape[:-2], 4)


def _of_leg(part: Part, leg: int) -> Part:
    """Return a part of a leg, in the leg's colour unless it is grey."""
    if np.ptp(part.color[:3]) <= GREY:
        return part
    return replace(part, color=(*rgb(leg_colour(leg)).tolist(), 1.0))


def _body(robot: Robot, width: float) -> list[Part]:
    """Return the trunk in its own frame: two plates at the hips, a box between and a lid."""
    hips = robot.arrays.p_body_hip
    length, breadth, height = (float(s) for s in robot.body.size)
    middle, outline, thin = float(hips[:, 2].mean()), hips[:, :2], 0.09 * height
    top, bottom = middle + height / 2, middle - height / 2
    root, tip, side = 0.02 * length, 0.13 * length, 0.085 * breadth
    arrow = np.array([[tip, 0.0], [root, side], [root, -side]])
    half, aside = 0.39 * length, (0.21 * breadth, 0.40 * height)
    X_body_middle = np.eye(4)
    X_body_middle[2, 3] = middle
    return [
        plate(outline, 0.62 * width, bottom, bottom + thin, PLATE),
        plate(outline, 0.62 * width, top - thin, top, PLATE),
        beam([(-half, *aside), (half, *aside)], SERVO).at(X_body_middle),
        plate(0.52 * outline, 0.35 * width, top, top + 0.18 * height, FRAME),
        # An arrow on the lid points forward.
        plate(arrow, 0.01 * breadth, top + 0.18 * height, top + 0.22 * height, LAMP),
    ]


def _leg(leg: Leg, w: float, colour: str, height: float) -> list[list[Part]]:
    """Return coxa, femur and tibia as servos, brackets and a blade with a rubber foot."""
    coxa, femur, tibia = (float(length) for length in leg.lengths)
    pivot = cylinder(1.32 * w, 0.36 * w, FRAME)
    thigh = beam([(-0.2 * w, 0.4 * w, 0.45 * w), (femur + 0.2 * w, 0.3 * w, 0.45 * w)], colour)
    yoke = beam([(-0.3 * w, 0.4 * w, 0.45 * w), (coxa, 0.4 * w, 0.45 * w)], SERVO)
    blade = beam(
        [
            (-0.3 * w, 0.26 * w, 0.30 * w),
            (0.1 * w, 0.44 * w, 0.42 * w),
            (0.3 * tibia, 0.4 * w, 0.34 * w),
            (tibia - 0.12 * w, 0.12 * w, 0.13 * w),
        ],
        colour,
    )
    return [
        [cylinder(0.80 * height, 0.46 * w, FRAME), yoke],
        [pivot, thigh],
        [pivot, blade],
        [ball(0.17 * w, RUBBER)],
    ]
