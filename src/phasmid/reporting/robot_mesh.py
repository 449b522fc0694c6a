"""The shape of a robot as triangles, link by link, and the solids of robots without meshes."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

from phasmid import kinematics
from phasmid.reporting.style import leg_colour, rgb
from phasmid.reporting.terrain_mesh import indexed
from phasmid.robot import JOINTS, Leg, Part, Robot

PLATE, FRAME, SERVO, RUBBER, LAMP = "#4a515e", "#7d8796", "#343941", "#24272c", "#e8edf4"

GREY = 0.15
"""Colours whose strongest and weakest channel differ by less than this are grey."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one colour; from outside their corners run counter-clockwise.

    Attributes:
        corners: Corners of each triangle [m], shape (T, 3, 3).
        colour: Red, green and blue, 0 to 1.
    """

    corners: Float[np.ndarray, "triangles 3 3"]
    colour: Float[np.ndarray, "3"]

    def at(self, X: Float[np.ndarray, "4 4"]) -> Mesh:
        """Return the mesh moved by a pose."""
        return Mesh(self.corners @ X[:3, :3].T + X[:3, 3], self.colour)


def loft(rings: Float[np.ndarray, "rings points 3"], colour: str) -> Mesh:
    """Return the closed solid through rings of points, each counter-clockwise seen from the last.

    Args:
        rings: Convex outlines of equal number of points, from the first end to the last [m].
        colour: Such as ``#4a6fc4``.
    """
    low, high = rings[:-1], rings[1:]
    low_next, high_next = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    sides = [np.stack(c, axis=-2) for c in ((low, low_next, high_next), (low, high_next, high))]
    triangles = [side.reshape(-1, 3, 3) for side in sides]
    for ring, order in ((rings[0], -1), (rings[-1], 1)):
        outline = ring[::order]
        hub = np.broadcast_to(outline.mean(axis=0), outline.shape)
        triangles.append(np.stack([hub, outline, np.roll(outline, -1, axis=0)], axis=1))
    return Mesh(np.concatenate(triangles), rgb(colour))


def beam(sections: list[tuple[float, float, float]], colour: str, chamfer: float = 0.35) -> Mesh:
    """Return a beam along x through rectangles with cut corners.

    Args:
        sections: Place along x, half width in y and half width in z of each [m].
        colour: Such as ``#4a6fc4``.
        chamfer: Part of the smaller half width that is cut off a corner.
    """
    rings = []
    for x, y, z in sections:
        c = chamfer * min(y, z)
        upper = [(x, y, z - c), (x, y - c, z), (x, c - y, z), (x, -y, z - c)]
        lower = [(x, -y, c - z), (x, c - y, -z), (x, y - c, -z), (x, y, c - z)]
        rings.append(upper + lower)
    return loft(np.array(rings), colour)


def box(centre: tuple[float, float, float], size: tuple[float, float, float], colour: str) -> Mesh:
    """Return a box along the axes with bevelled edges [m]."""
    length, width, height = size
    bevel = 0.12 * min(size)
    end, inner = length / 2, length / 2 - bevel
    y, z = width / 2, height / 2
    mesh = beam(
        [(-end, y - bevel, z - bevel), (-inner, y, z), (inner, y, z), (end, y - bevel, z - bevel)],
        colour,
        chamfer=0.24,
    )
    return Mesh(mesh.corners + np.array(centre), mesh.colour)


def turned(profile: list[tuple[float, float]], sides: int, colour: str) -> Mesh:
    """Return the solid of revolution about z through pairs of height and radius [m]."""
    angle = np.arange(sides) * 2 * math.pi / sides
    rings = [
        np.stack([r * np.cos(angle), r * np.sin(angle), np.full(sides, z)], axis=-1)
        for z, r in profile
    ]
    return loft(np.stack(rings), colour)


def cylinder(height: float, radius: float, colour: str) -> Mesh:
    """Return a cylinder with bevelled ends along z, about the origin [m]."""
    top, bevel = height / 2, 0.15 * min(radius, height)
    ends = [(top - bevel, radius), (top, radius - bevel)]
    return turned([*((-z, r) for z, r in reversed(ends)), *ends], 28, colour)


def ball(radius: float, colour: str) -> Mesh:
    """Return a ball about the origin [m]."""
    latitudes = np.linspace(-1.45, 1.45, 9).tolist()
    profile = [(radius * math.sin(angle), radius * math.cos(angle)) for angle in latitudes]
    return turned(profile, 20, colour)


def slab(
    points: Float[np.ndarray, "points 2"], radius: float, low: float, high: float, colour: str
) -> Mesh:
    """Return a plate whose outline is the hull of some points, rounded off about them.

    Args:
        points: Seen from above [m].
        radius: Of the rounding, and the margin about the points [m].
        low: Height of the lower face [m].
        high: Height of the upper face [m].
        colour: Such as ``#4a6fc4``.
    """
    angle = np.arange(24) * math.pi / 12
    circle = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    around = (points[:, None] + circle).reshape(-1, 2)
    outline = around[ConvexHull(around).vertices]
    middle = outline.mean(axis=0)
    bevel = 0.2 * (high - low)
    size = np.linalg.norm(outline - middle, axis=1, keepdims=True)
    inset = outline - (outline - middle) / size * bevel
    heights = ((low, inset), (low + bevel, outline), (high - bevel, outline), (high, inset))
    return loft(
        np.stack([np.c_[ring, np.full(len(ring), height)] for height, ring in heights]), colour
    )


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
) -> Float[np.ndarray, "triangles 3 3"]:
    """Return the corners of the robot's triangles in the world [m].

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
            mesh.at(X_world_body if place is None else X_world_body @ X[place]).corners
            for place, meshes in solids.items()
            for mesh in meshes
        ]
    )


Place: TypeAlias = tuple[int, int]
"""Number of a leg, from 0, and of its frame: coxa, femur, tibia, foot."""


def link_meshes(robot: Robot) -> dict[Place | None, list[Mesh]]:
    """Return the meshes of each link in its own frame; those of the trunk by None.

    They are the robot's appearance. Without one, lengths and mounts give the shape, with assumed
    widths.
    """
    look = robot.appearance
    if look is not None and look.parts:
        found: dict[Place | None, list[Mesh]] = {None: [_mesh(part) for part in look.body]}
        for number, leg in enumerate(robot.legs):
            for frame, joint in enumerate(JOINTS):
                parts = look.link(leg.name, joint)
                found[number, frame] = [_mesh(part, leg_colour(number)) for part in parts]
        return {place: meshes for place, meshes in found.items() if meshes or place is None}
    width = 0.38 * float(np.median(robot.arrays.lengths[:, 1]))
    height = float(robot.body.size[2])
    found = {None: body_meshes(robot, width)}
    for number, leg in enumerate(robot.legs):
        links = _leg(leg, width, leg_colour(number), height)
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
    solids = link_meshes(robot)
    links = [place for place in solids if place is not None]
    numbers: dict[bytes, int] = {}
    meshes: list[tuple[np.ndarray, np.ndarray]] = []
    pieces: list[tuple[int, int, tuple[float, ...]]] = []
    for place, solid in solids.items():
        link = -1 if place is None else links.index(place)
        for mesh in solid:
            key = hashlib.sha256(np.ascontiguousarray(mesh.corners).tobytes()).digest()
            if key not in numbers:
                numbers[key] = len(meshes)
                meshes.append(indexed(mesh.corners))
            pieces.append((link, numbers[key], tuple(np.round(mesh.colour, 4).tolist())))
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


def _mesh(part: Part, leg_colour: str = "") -> Mesh:
    """Return a part as triangles, coloured parts in the colour of their leg."""
    colour = np.array(part.color[:3])
    if leg_colour and np.ptp(colour) > GREY:
        colour = rgb(leg_colour)
    return Mesh(part.vertices[part.faces], colour)


def body_meshes(robot: Robot, width: float) -> list[Mesh]:
    """Return the trunk in its own frame: two plates at the hips, boxes between and on top."""
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
    # An arrow on the lid points forward.
    tip, root, side = 0.13 * length, 0.02 * length, 0.085 * breadth
    lid = top + 0.372 * height
    arrow = np.array([[tip, 0], [root, side], [root + 0.02 * length, 0], [root, -side]])
    rings = np.stack([np.c_[arrow, np.full(4, z)] for z in (lid - 0.004, lid)])
    return [*parts, loft(rings, LAMP)]


def _leg(leg: Leg, w: float, colour: str, height: float) -> list[list[Mesh]]:
    """Return coxa, femur and tibia as servos, brackets and a blade with a rubber foot."""
    coxa, femur, tibia = (float(length) for length in leg.lengths)
    hip = cylinder(0.80 * height, 0.46 * w, FRAME)
    yoke = beam(
        [
            (-0.30 * w, 0.34 * w, 0.42 * w),
            (-0.22 * w, 0.42 * w, 0.50 * w),
            (coxa - 0.25 * w, 0.42 * w, 0.50 * w),
            (coxa + 0.10 * w, 0.34 * w, 0.36 * w),
        ],
        SERVO,
    )
    pivot = cylinder(1.32 * w, 0.36 * w, FRAME)
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
    return [[hip, yoke], thigh, [pivot, blade], [ball(0.17 * w, RUBBER)]]
