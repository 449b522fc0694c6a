"""What the frames of a video show: times, poses, forces and where the camera is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.reporting.machine import robot_mesh
from phasmid.reporting.source import Source, channel
from phasmid.reporting.webpage.replay import link_poses, quaternions, solids_of
from phasmid.video.camera import Camera, camera_of
from phasmid.video.floor import floor, square_side
from phasmid.video.solid import surface

MOST_FRAMES = 54_000
"""Most frames of a video: half an hour."""

LOOKS = 12
"""Moments at which the robot is measured, so that the camera holds all of it."""


@dataclass(frozen=True, eq=False)
class Film:
    """A recording, frame by frame.

    Attributes:
        source: The machine and the experiment.
        time: Of each frame [s], shape (F,).
        body: Pose of the trunk, ``X_world_body``, shape (F, 4, 4).
        q: Joint angles [rad], shape (F, L, 3).
        feet: Their positions in the world [m], shape (F, L, 3); None where they are not recorded.
        force: On the feet, world axes [N], shape (F, L, 3); None likewise.
        normal: Normal forces of all samples [N], shape (T, L), at times `normal_time`.
        normal_time: [s], shape (T,).
        whose: ``simulated``, ``by the model`` or ``as recorded``.
    """

    source: Source
    time: Float[np.ndarray, " frames"]
    body: Float[np.ndarray, "frames 4 4"]
    q: Float[np.ndarray, "frames legs 3"]
    feet: Float[np.ndarray, "frames legs 3"] | None
    force: Float[np.ndarray, "frames legs 3"] | None
    normal: Float[np.ndarray, "time legs"] | None
    normal_time: Float[np.ndarray, " time"]
    whose: str


def film_of(recording: Recording, source: Source, *, fps: float, speed: float) -> Film:
    """The frames of a recording's video.

    Args:
        recording: Its finite part, with the body's pose and joint angles, seen or planned.
        source: The machine and the experiment behind it.
        fps: Frames per second of the video.
        speed: Recorded seconds per second of the video.

    Raises:
        InvalidInput: The recording lacks what is shown, or is too long.
    """
    names = ("body_position", "body_orientation")
    position, orientation = (channel(recording, name) for name in names)
    angles = channel(recording, "joint_position")
    if angles is None:
        angles = channel(recording, "joint_position_target")
    if position is None or orientation is None or angles is None:
        lacking = "joint_position" if angles is None else "body_position and body_orientation"
        raise InvalidInput(f"the recording has no {lacking}; a video needs it.")
    stamps = np.asarray(recording["time"].values)
    time = frame_times(stamps, fps, speed)
    body = np.zeros((len(time), 4, 4))
    body[:, :3, :3] = kinematics.quaternion_rotation(_turning(stamps, orientation, time))
    body[:, :3, 3] = between(stamps, position, time)
    body[:, 3, 3] = 1
    feet = channel(recording, "foot_position")
    ending, whose = "", "simulated"
    force = channel(recording, "foot_force")
    if recording.attrs.get("kind") != "simulation":
        whose = "as recorded"
    if force is None:
        ending, whose, force = "_model", "by the model", channel(recording, "foot_force_model")
    normal = channel(recording, f"foot_normal_force{ending}")
    if normal is None and force is not None:
        normal = force[..., 2]
    return Film(
        source,
        time,
        body,
        between(stamps, angles, time),
        None if feet is None else between(stamps, feet, time),
        None if force is None or feet is None else between(stamps, force, time),
        normal,
        stamps,
        whose,
    )


def frame_times(
    stamps: Float[np.ndarray, " time"], fps: float, speed: float
) -> Float[np.ndarray, " frames"]:
    """Times that frames show [s]; a run that repeats itself makes a video that does.

    Args:
        stamps: Of the recorded samples [s].
        fps: Frames per second of the video.
        speed: Recorded seconds per second of the video.

    Raises:
        InvalidInput: There are too many.
    """
    length = float(stamps[-1] - stamps[0])
    count = max(1, round(length / speed * fps))
    if count > MOST_FRAMES:
        raise InvalidInput(
            f"a video of {length:.4g} s has {count} frames; the limit is {MOST_FRAMES}.",
            hint=f"speed={np.ceil(length * fps / MOST_FRAMES):g}",
        )
    # The moment after the last frame is that of the last sample, so that whole cycles loop.
    return stamps[0] + np.arange(count) * (speed / fps)


def between(
    stamps: Float[np.ndarray, " time"],
    values: np.ndarray,
    time: Float[np.ndarray, " frames"],
) -> np.ndarray:
    """Values of shape (T, ...) at times between samples, along straight lines, shape (F, ...)."""
    if len(stamps) == 1:
        return np.repeat(values, len(time), axis=0)
    after = np.clip(np.searchsorted(stamps, time, side="right"), 1, len(stamps) - 1)
    part = np.clip((time - stamps[after - 1]) / (stamps[after] - stamps[after - 1]), 0, 1)
    part = part.reshape(-1, *[1] * (values.ndim - 1))
    return values[after - 1] * (1 - part) + values[after] * part


def _turning(
    stamps: Float[np.ndarray, " time"],
    quaternion: Float[np.ndarray, "time 4"],
    time: Float[np.ndarray, " frames"],
) -> Float[np.ndarray, "frames 4"]:
    """Orientations between samples; neighbours are near each other, so that a line will do."""
    same = np.sign(np.sum(quaternion[1:] * quaternion[:-1], axis=1))
    sign = np.cumprod(np.concatenate([[1.0], np.where(same == 0, 1.0, same)]))
    found = between(stamps, quaternion * sign[:, None], time)
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def film_camera(film: Film, size: tuple[int, int]) -> Camera:
    """The camera that follows the robot.

    Args:
        film: What it sees.
        size: Width and height of its picture, in pixels.
    """
    rows = np.unique(np.linspace(0, len(film.time) - 1, LOOKS).astype(int))
    robot = film.source.robot
    looks = [robot_mesh(robot, film.q[k], film.body[k]).corners.reshape(-1, 3) for k in rows]
    period = film.source.scenario.stride.period
    terrain = film.source.scenario.load_terrain()
    seen = dict(zip(rows.tolist(), looks, strict=True))
    return camera_of(film.time, film.body, period, terrain, seen, size)


def scene(film: Film, camera: Camera) -> dict[str, np.ndarray]:
    """All that the process that draws is told, as arrays.

    Args:
        film: What is shown.
        camera: From where.
    """
    solids = solids_of(film.source.robot)
    places = [place for place in solids if place is not None]
    X_world_link = film.body[:, None] @ link_poses(film.source.robot, film.q, places)
    X = np.concatenate([film.body[:, None], X_world_link], axis=1)
    pieces: list[tuple[float, ...]] = []
    told: dict[str, np.ndarray] = {}
    for place, meshes in solids.items():
        link = 0 if place is None else 1 + places.index(place)
        for mesh in meshes:
            for colour in np.unique(mesh.colours, axis=0):
                found = surface(mesh.corners[(mesh.colours == colour).all(axis=1)])
                if found is None:
                    continue
                name = f"piece{len(pieces)}"
                told[f"{name}_vertices"] = found.vertices
                told[f"{name}_normals"] = found.normals
                told[f"{name}_faces"] = found.faces.astype(np.int32)
                pieces.append((link, *(float(c) for c in colour)))
    scenario = film.source.scenario
    told |= floor(scenario.load_terrain(), film.body[:, :2, 3], square_side(scenario))
    told["pieces"] = np.array(pieces)
    told["position"] = X[..., :3, 3]
    told["orientation"] = quaternions(X[..., :3, :3])
    return told | camera.arrays()
