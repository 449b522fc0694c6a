"""Robot, ground and forces as messages of frames and shapes."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from foxglove.messages import (
    ArrowPrimitive,
    Color,
    CubePrimitive,
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

from phasmid.recording.ros import BODY, WORLD, Sample, Topic
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
        links: Poses of the links, each in the frame of the one before it.
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
        self._orientation = np.moveaxis(quaternions(X[..., :3, :3]), -1, 0)
        transforms = []
        for leg, positions in enumerate(X[..., :3, 3].tolist()):
            frames = BODY, *(_frame(robot, (leg, frame)) for frame in range(4))
            for (before, frame), position in zip(pairwise(frames), positions, strict=True):
                transform = {"translation": dict(zip("xyz", position, strict=True))}
                stamped = {"header": {"frame_id": before}, "child_frame_id": frame}
                transforms.append({**stamped, "transform": transform})
        self.links = Topic("tf2_msgs/msg/TFMessage", {"transforms": transforms}, self._rotations)
        span = float(np.ptp(robot.arrays.p_body_hip[:, :2], axis=0).max())
        # Length of an arrow per force [m/N], and its thickness [m].
        self._scale = FORCE_LENGTH * span / (robot.mass * GRAVITY)
        self._thickness = 0.04 * span
        self._force_colour = _colour(rgb(FORCE_COLOUR))
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

    def follow(self, sample: Sample) -> bool:
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

    def _rotations(self, sample: Sample) -> tuple[np.ndarray]:
        """Return the orientation of each link in the frame of the one before it, x y z w."""
        # Each joint turns its link about the link's z axis; the foot keeps its place.
        half = np.zeros(self._orientation.shape[1:])
        half[:, :3] = sample["joint_position"] / 2
        c, s, (w, x, y, z) = np.cos(half), np.sin(half), self._orientation
        turned = x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s
        return (np.stack(turned, axis=-1),)

    def forces(self, sample: Sample, ns: int) -> bytes:
        """Return the forces on the feet as arrows in the world, encoded."""
        arrows, thick = [], self._thickness
        # A few numbers, for which NumPy would take longer.
        feet, forces = (
            np.asarray(sample.get(name, ())).tolist() for name in ("foot_position", "foot_force")
        )
        for foot, force in zip(feet, forces, strict=False):
            size = math.hypot(*force)
            if not size > 0:
                continue
            x, y, z = (part / size for part in force)
            # The shortest rotation that turns the arrow's x axis to the force.
            turn = (1 + x, 0.0, -z, y) if x > -1 else (0.0, 0.0, 0.0, 1.0)
            norm, length = math.hypot(*turn), self._scale * size
            head = min(2 * thick, length)
            arrows.append(
                ArrowPrimitive(
                    pose=_pose(*foot, *(part / norm for part in turn)),
                    shaft_length=length - head,
                    shaft_diameter=thick,
                    head_length=head,
                    head_diameter=2 * thick,
                    color=self._force_colour,
                )
            )
        stamp = Timestamp(sec=ns // 10**9, nsec=ns % 10**9)
        entity = SceneEntity(timestamp=stamp, frame_id=WORLD, id="forces", arrows=arrows)
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
