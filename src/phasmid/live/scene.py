"""Robot, ground and forces as Foxglove's messages of frames and shapes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from foxglove.messages import (
    ArrowPrimitive,
    Color,
    CubePrimitive,
    FrameTransform,
    FrameTransforms,
    Point3,
    Pose,
    Quaternion,
    SceneEntity,
    SceneUpdate,
    Timestamp,
    TriangleListPrimitive,
    Vector3,
)
from numpy.typing import ArrayLike

from phasmid.recording.ros import BODY, WORLD
from phasmid.reporting.drawing import FORCE_COLOUR, FORCE_LENGTH
from phasmid.reporting.robot_mesh import Place, link_poses, mesh_pieces, quaternions
from phasmid.reporting.style import rgb
from phasmid.reporting.terrain_mesh import landscape
from phasmid.robot import JOINTS, Robot
from phasmid.terrain import Ground

REACH = 2.0
"""Distance around the robot to which the ground is drawn; half way there it is renewed [m]."""

GROUND_CELL = 0.04
"""Side of the triangles of curved ground [m]."""

GROUND_COLOUR, GROUND_THICKNESS = "#b9bec7", 0.01

GRAVITY = 9.81
"""Gravity by which the length of force arrows is scaled [m/s²]."""


class Scene:
    """A robot on its ground as shapes.

    Args:
        robot: The robot.
        ground: Its ground.

    Attributes:
        still: Encoded meshes of the links, each in its own frame, and of the ground.
    """

    def __init__(self, robot: Robot, ground: Ground) -> None:
        self._robot, self._ground = robot, ground
        pieces = mesh_pieces(robot)
        legs = range(len(robot.legs))
        # Poses at joint angles of 0 of coxa, femur, tibia and foot, each in the frame before it.
        places = [(leg, frame) for leg in legs for frame in range(4)]
        X = link_poses(robot, np.zeros((1, len(legs), 3)), places)[0].reshape(-1, 4, 4, 4)
        X[:, 1:] = np.linalg.inv(X[:, :-1]) @ X[:, 1:]
        self._frames = [_frame(robot, place) for place in places]
        self._positions = [
            Vector3(x=x, y=y, z=z) for x, y, z in X[..., :3, 3].reshape(-1, 3).tolist()
        ]
        self._orientation = quaternions(X[..., :3, :3])
        span = float(np.ptp(robot.arrays.p_body_hip[:, :2], axis=0).max())
        # Length of an arrow per force [m/N], and its thickness [m].
        self._scale = FORCE_LENGTH * span / (robot.mass * GRAVITY)
        self._thickness = 0.04 * span
        self._robot_entities = [
            SceneEntity(
                frame_id=frame,
                id=frame,
                frame_locked=True,
                triangles=[
                    _triangles(*pieces.meshes[mesh], colour)
                    for at, mesh, colour in pieces.pieces
                    if at == link
                ],
            )
            for link, frame in [(-1, BODY), *enumerate(_frame(robot, p) for p in pieces.links)]
        ]
        self._draw(np.zeros(2))

    def follow(self, sample: Mapping[str, np.ndarray]) -> bool:
        """Renew the ground around a robot that has come far; return whether it was renewed."""
        place = sample.get("body_position", np.zeros(3))[:2]
        if np.abs(place - self._middle).max() < REACH / 2:
            return False
        self._draw(place)
        return True

    def _draw(self, middle: np.ndarray) -> None:
        """Draw the ground around a place [m]."""
        self._middle = np.array(middle)
        cubes, triangles = [], []
        if self._ground.is_level:
            level = float(self._ground.height(*self._middle[:, None])[0])
            cubes.append(
                CubePrimitive(
                    pose=_pose(float(middle[0]), float(middle[1]), level - GROUND_THICKNESS / 2),
                    size=Vector3(x=2 * REACH, y=2 * REACH, z=GROUND_THICKNESS),
                    color=_colour(rgb(GROUND_COLOUR)),
                )
            )
        else:
            mesh = landscape(self._ground, self._middle, REACH, GROUND_CELL)
            triangles.append(_triangles(*mesh, rgb(GROUND_COLOUR)))
        ground = SceneEntity(frame_id=WORLD, id="ground", cubes=cubes, triangles=triangles)
        self.still: bytes = SceneUpdate(entities=[*self._robot_entities, ground]).encode()

    def links(self, sample: Mapping[str, np.ndarray], ns: int) -> bytes:
        """Return the pose of each link in the frame of the one before it, encoded."""
        # Each joint turns its link about the link's z axis; the foot keeps its place.
        half = np.zeros((len(self._orientation), 4))
        half[:, :3] = sample["joint_position"] / 2
        c, s, (w, x, y, z) = np.cos(half), np.sin(half), np.moveaxis(self._orientation, -1, 0)
        turned = np.stack([w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s], axis=-1)
        stamp, before = _timestamp(ns), ""
        transforms = []
        for frame, place, (w, x, y, z) in zip(
            self._frames, self._positions, turned.reshape(-1, 4).tolist(), strict=True
        ):
            transforms.append(
                FrameTransform(
                    timestamp=stamp,
                    parent_frame_id=BODY if frame.endswith(JOINTS[0]) else before,
                    child_frame_id=frame,
                    translation=place,
                    rotation=Quaternion(w=w, x=x, y=y, z=z),
                )
            )
            before = frame
        return FrameTransforms(transforms=transforms).encode()

    def forces(self, sample: Mapping[str, np.ndarray], ns: int) -> bytes:
        """Return the forces on the feet as arrows in the world, encoded."""
        arrows = []
        for foot, force in zip(
            sample.get("foot_position", ()), sample.get("foot_force", ()), strict=False
        ):
            size = float(np.linalg.norm(force))
            if not size > 0:
                continue
            x, y, z = force / size
            # The shortest rotation that turns the arrow's x axis to the force.
            turn = np.array([1 + x, 0.0, -z, y]) if x > -1 else np.array([0.0, 0.0, 0.0, 1.0])
            length, thick = self._scale * size, self._thickness
            head = min(2 * thick, length)
            arrows.append(
                ArrowPrimitive(
                    pose=_pose(*foot, *turn / np.linalg.norm(turn)),
                    shaft_length=length - head,
                    shaft_diameter=thick,
                    head_length=head,
                    head_diameter=2 * thick,
                    color=_colour(rgb(FORCE_COLOUR)),
                )
            )
        entity = SceneEntity(timestamp=_timestamp(ns), frame_id=WORLD, id="forces", arrows=arrows)
        return SceneUpdate(entities=[entity]).encode()


def _frame(robot: Robot, link: Place) -> str:
    """Return the name of a link's frame, such as ``right_front.tibia``."""
    leg, frame = link
    return f"{robot.leg_names[leg]}.{(*JOINTS, 'foot')[frame]}"


def _triangles(vertices: np.ndarray, faces: np.ndarray, colour: ArrayLike) -> TriangleListPrimitive:
    return TriangleListPrimitive(
        pose=_pose(),
        points=[Point3(x=x, y=y, z=z) for x, y, z in vertices.tolist()],
        color=_colour(colour),
        indices=faces.ravel().tolist(),
    )


def _pose(
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    w: float = 1.0,
    i: float = 0.0,
    j: float = 0.0,
    k: float = 0.0,
) -> Pose:
    """Return a pose of a position [m] and a unit quaternion."""
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(w=w, x=i, y=j, z=k))


def _colour(colour: ArrayLike) -> Color:
    r, g, b = np.asarray(colour).tolist()
    return Color(r=r, g=g, b=b, a=1.0)


def _timestamp(ns: int) -> Timestamp:
    return Timestamp(sec=ns // 10**9, nsec=ns % 10**9)
