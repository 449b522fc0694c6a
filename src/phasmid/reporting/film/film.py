"""The frames of a video: times, poses, forces and the camera."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp

from phasmid.errors import InvalidInput
from phasmid.reporting.camera import View, camera_axes, fitted_view
from phasmid.reporting.drawing import AZIMUTH, UNEVEN_AZIMUTH
from phasmid.reporting.robot_mesh import body_pose, robot_corners
from phasmid.reporting.run import Run

SHOWN = (
    "body_position",
    "body_orientation",
    "joint_position",
    "joint_position_target",
    "foot_position",
    "foot_force",
    "foot_force_model",
)
"""Channels that a frame shows."""

MOST_FRAMES = 54_000
"""Most frames of a video: half an hour."""

LOOKS = 12
"""Moments at which the robot is measured, so that the camera holds all of it."""

ELEVATION, UNEVEN_ELEVATION = math.radians(24.0), math.radians(36.0)
"""Elevations of the camera; on uneven ground it looks over steps before it."""

WIDE, HIGH = 0.56, 0.80
"""Shares of the picture's width and height that the robot takes."""

SQUARE = 0.1
"""Approximate side of the squares on the ground [m]."""


def frames_of(run: Run, *, fps: float, speed: float) -> Run:
    """Return the part of a run that a video shows, interpolated at the times of its frames.

    Args:
        run: A run with the body's pose and joint angles.
        fps: Frames per second of the video.
        speed: Recorded seconds per second of the video.

    Raises:
        InvalidInput: The pose is not recorded, or there are too many frames.
    """
    run.pose("a video")
    shown = run.recording[[name for name in SHOWN if run.has(name)]]
    time = frame_times(run.time, fps, speed)
    if len(run.time) > 1:
        orientation = shown["body_orientation"]
        turned = Slerp(run.time, Rotation.from_quat(orientation.values, scalar_first=True))
        time = np.minimum(time, run.time[-1])
        shown = shown.interp(time=time)
        shown["body_orientation"] = orientation.dims, turned(time).as_quat(scalar_first=True)
    return replace(run, recording=shown)


def frame_times(
    stamps: Float[np.ndarray, " time"], fps: float, speed: float
) -> Float[np.ndarray, " frames"]:
    """Return the times of the frames [s]; whole cycles make a video that loops.

    Args:
        stamps: Times of the samples [s].
        fps: Frames per second of the video.
        speed: Recorded seconds per second of the video.

    Raises:
        InvalidInput: There are too many frames.
    """
    length = float(stamps[-1] - stamps[0])
    count = max(1, round(length / speed * fps))
    if count > MOST_FRAMES:
        raise InvalidInput(
            f"a video of {length:.4g} s has {count} frames; the limit is {MOST_FRAMES}.",
            hint=f"speed={np.ceil(length * fps / MOST_FRAMES):g}",
        )
    # The last sample would be the frame after the last, so that whole cycles loop.
    return stamps[0] + np.arange(count) * (speed / fps)


def camera_of(frames: Run, size: tuple[int, int]) -> tuple[View, Float[np.ndarray, "frames 3"]]:
    """Return the camera of the first frame, and its displacement in each frame [m].

    It follows the robot smoothly.

    Args:
        frames: The frames.
        size: Width and height of the picture [pixels].
    """
    position, orientation, q = frames.pose("a video")
    X_world_body, time = body_pose(position, orientation), frames.time
    rows = np.unique(np.linspace(0, len(time) - 1, LOOKS).astype(int))
    every = float(time[1] - time[0]) if len(time) > 1 else 1.0
    path = smoothed(position, 0.5 * frames.experiment.course.stride.period / every)
    displacement, terrain = path - path[0], frames.experiment.world.terrain
    points = np.concatenate(
        [robot_corners(frames.robot, q[k], X_world_body[k]) - displacement[k] for k in rows]
    )
    azimuth = math.atan2(X_world_body[0, 1, 0], X_world_body[0, 0, 0])
    azimuth += AZIMUTH if terrain.is_level else UNEVEN_AZIMUTH
    axes = camera_axes(azimuth, ELEVATION if terrain.is_level else UNEVEN_ELEVATION)
    return fitted_view(points, axes, size, (WIDE, HIGH)), displacement


def smoothed(
    values: Float[np.ndarray, "frames parts"], width: float
) -> Float[np.ndarray, "frames parts"]:
    """Return values smoothed over a width [frames], with the first and last kept."""
    from scipy.ndimage import gaussian_filter1d

    if len(values) < 3:
        return values
    line = np.linspace(values[0], values[-1], len(values))
    width = min(width, len(values) / 4)
    return np.asarray(line + gaussian_filter1d(values - line, width, axis=0, mode="nearest"))


def square_side(step: float) -> float:
    """Return the side of the squares [m], in whole steps: each cycle passes whole squares."""
    if not 0.01 <= step <= 2 * SQUARE:
        return SQUARE
    return step * max(1, round(SQUARE / step - 1e-9))
