"""The frames of a video: times, poses, forces and the camera."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid import kinematics
from phasmid.errors import InvalidInput
from phasmid.reporting.camera import View, camera_axes, fitted_view
from phasmid.reporting.drawing import AZIMUTH, UNEVEN_AZIMUTH
from phasmid.reporting.robot_mesh import robot_mesh
from phasmid.reporting.run import Run
from phasmid.scenario import Scenario
from phasmid.terrain import Ground

MOST_FRAMES = 54_000
"""Most frames of a video: half an hour."""

LOOKS = 12
"""Moments at which the robot is measured, so that the camera holds all of it."""

ELEVATIONS = [math.radians(degrees) for degrees in range(24, 70, 3)]
"""Elevations of the camera, in the order in which they are tried."""

WIDE, HIGH = 0.56, 0.80
"""Shares of the picture's width and height that the robot takes."""

CLEARANCE = 0.03
"""Least height of the line of sight over the ground [m]."""

SQUARE = 0.1
"""Approximate side of the squares on the ground [m]."""


@dataclass(frozen=True, eq=False)
class Film:
    """A run, frame by frame.

    Attributes:
        run: The run.
        time: Time of each frame [s], shape (F,).
        body: Pose of the trunk, ``X_world_body``, shape (F, 4, 4).
        q: Joint angles [rad], shape (F, L, 3).
        feet: Foot positions in the world [m], shape (F, L, 3); None where not recorded.
        force: Forces on the feet in world axes [N], shape (F, L, 3); None likewise.
        normal: Normal forces of all samples of the run [N], shape (T, L); None likewise.
    """

    run: Run
    time: Float[np.ndarray, " frames"]
    body: Float[np.ndarray, "frames 4 4"]
    q: Float[np.ndarray, "frames legs 3"]
    feet: Float[np.ndarray, "frames legs 3"] | None
    force: Float[np.ndarray, "frames legs 3"] | None
    normal: Float[np.ndarray, "time legs"] | None


def film_of(run: Run, *, fps: float, speed: float) -> Film:
    """Return the frames of a run's video.

    Args:
        run: A run with the body's pose and joint angles.
        fps: Frames per second of the video.
        speed: Recorded seconds per second of the video.

    Raises:
        InvalidInput: The pose is not recorded, or there are too many frames.
    """
    position, orientation, angles = run.pose("a video")
    time = frame_times(run.time, fps, speed)
    body = np.zeros((len(time), 4, 4))
    body[:, :3, :3] = kinematics.quaternion_rotation(_orientations(run.time, orientation, time))
    body[:, :3, 3] = interpolate(run.time, position, time)
    body[:, 3, 3] = 1
    feet, force = run.channel("foot_position"), run.channel("foot_force", "foot_force_model")
    normal = run.channel(f"foot_normal_force{'' if run.has('foot_force') else '_model'}")
    if normal is None and force is not None:
        normal = force[..., 2]
    return Film(
        run,
        time,
        body,
        interpolate(run.time, angles, time),
        None if feet is None else interpolate(run.time, feet, time),
        None if force is None or feet is None else interpolate(run.time, force, time),
        normal,
    )


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


def interpolate(
    stamps: Float[np.ndarray, " time"], values: np.ndarray, time: Float[np.ndarray, " frames"]
) -> np.ndarray:
    """Return values of shape (T, ...) interpolated linearly at times, shape (F, ...)."""
    if len(stamps) == 1:
        return np.repeat(values, len(time), axis=0)
    after = np.clip(np.searchsorted(stamps, time, side="right"), 1, len(stamps) - 1)
    part = np.clip((time - stamps[after - 1]) / (stamps[after] - stamps[after - 1]), 0, 1)
    part = part.reshape(-1, *[1] * (values.ndim - 1))
    return values[after - 1] * (1 - part) + values[after] * part


def _orientations(
    stamps: Float[np.ndarray, " time"],
    quaternion: Float[np.ndarray, "time 4"],
    time: Float[np.ndarray, " frames"],
) -> Float[np.ndarray, "frames 4"]:
    """Return orientations between samples; neighbours are close enough for a straight line."""
    same = np.sign(np.sum(quaternion[1:] * quaternion[:-1], axis=1))
    sign = np.cumprod(np.concatenate([[1.0], np.where(same == 0, 1.0, same)]))
    found = interpolate(stamps, quaternion * sign[:, None], time)
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def camera_of(film: Film, size: tuple[int, int]) -> tuple[View, Float[np.ndarray, "frames 3"]]:
    """Return the camera of the first frame, and its displacement in each frame [m].

    It follows the robot smoothly, from the least elevation at which the ground hides nothing.

    Args:
        film: The frames.
        size: Width and height of the picture [pixels].
    """
    rows = np.unique(np.linspace(0, len(film.time) - 1, LOOKS).astype(int))
    every = float(film.time[1] - film.time[0]) if len(film.time) > 1 else 1.0
    path = smoothed(film.body[:, :3, 3], 0.5 * film.run.scenario.stride.period / every)
    robot, terrain = film.run.robot, film.run.scenario.load_terrain()
    displacement = path - path[0]
    points = np.concatenate(
        [
            robot_mesh(robot, film.q[k], film.body[k]).corners.reshape(-1, 3) - displacement[k]
            for k in rows
        ]
    )
    azimuth = math.atan2(film.body[0, 1, 0], film.body[0, 0, 0])
    azimuth += AZIMUTH if terrain.is_level else UNEVEN_AZIMUTH
    for elevation in ELEVATIONS:
        view = fitted_view(points, camera_axes(azimuth, elevation), size, (WIDE, HIGH))
        if terrain.is_level or _sees(view, displacement, terrain):
            break
    return view, displacement


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


def _sees(view: View, displacement: Float[np.ndarray, "frames 3"], terrain: Ground) -> bool:
    """Return whether the ground leaves all lines of sight free."""
    part = np.linspace(0.15, 1.0, 30)[:, None, None]
    points = view.middle + displacement + part * (view.eye - view.middle)
    return bool((points[..., 2] > terrain.height(points[..., 0], points[..., 1]) + CLEARANCE).all())


def square_side(scenario: Scenario) -> float:
    """Return the side of the squares [m]: whole steps, so that each cycle passes whole squares."""
    step = scenario.stride.step_length
    if not 0.01 <= step <= 2 * SQUARE:
        return SQUARE
    return step * max(1, round(SQUARE / step - 1e-9))
