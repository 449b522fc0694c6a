"""The shape of a robot as meshes, link by link, and the solids of robots without meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.reporting.style import leg_colour, rgb
from phasmid.robot import JOINTS, Part, Robot

PLATE, RUBBER, LAMP = "#4a515e", "#24272c", "#e8edf4"

GREY = 0.15
"""Colours whose strongest and weakest channel differ by less than this are grey."""

Place: TypeAlias = tuple[int, int]
"""Number of a leg, from 0, and of its frame: coxa, femur, tibia, foot."""


def rounded(points: Float[np.ndarray, "points 3"], radius: float, colour: str) -> Part:
    """Return the convex hull of balls about points [m] in a colour such as ``#4a6fc4``."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2, radius=radius).vertices
    solid = trimesh.convex.convex_hull((points[:, None] + ball).reshape(-1, 3))
    return Part(solid.vertices, solid.faces, (*rgb(colour).tolist(), 1.0))


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

    They are the robot's appearance, or else a plate about the hips and rods of assumed widths.
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
    radius = 0.17 * float(np.median(robot.arrays.lengths[:, 1]))
    found = {None: _trunk(robot, radius)}
    for number, leg in enumerate(robot.legs):
        for frame, length in enumerate(leg.lengths):
            ends, slim = np.array([[0.0, 0, 0], [length, 0, 0]]), (1.0, 0.8, 0.6)[frame]
            found[number, frame] = [rounded(ends, slim * radius, leg_colour(number))]
        ball = robot.foot_radius or 0.7 * radius
        found[number, 3] = [rounded(np.zeros((1, 3)), ball, RUBBER)]
    return found


def _trunk(robot: Robot, radius: float) -> list[Part]:
    """Return a plate about the hips, and on it an arrow that points forward."""
    hips, body = robot.arrays.p_body_hip, robot.body
    (_, _, low), (_, _, high) = body.box
    above, below = hips.copy(), hips.copy()
    above[:, 2] = np.maximum(hips[:, 2], high - radius)
    below[:, 2] = np.minimum(hips[:, 2], low + radius)
    arrow = body.box_points(np.array([[0.4, 0.0, 1.0], [0.0, 0.3, 1.0], [0.0, -0.3, 1.0]]))
    arrow[:, 2] = max(high, float(hips[:, 2].max()) + radius)
    return [
        rounded(np.concatenate([above, below]), radius, PLATE),
        rounded(arrow, 0.02 * float(body.size[0]), LAMP),
    ]


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
    X_body_hip = np.stack([leg.X_body_hip for leg in robot.legs])
    X_body_link = X_body_hip[:, None] @ kinematics.leg_frames(robot.arrays, q)
    leg, frame = np.array(links, dtype=int).reshape(-1, 2).T
    return X_body_link[:, leg, frame]


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
