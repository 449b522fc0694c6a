"""The camera of a video, which follows the robot smoothly."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.reporting.camera import View
from phasmid.reporting.drawing import AZIMUTH, UNEVEN_AZIMUTH
from phasmid.reporting.light import LIGHT
from phasmid.terrain import Ground

ELEVATIONS = [math.radians(degrees) for degrees in range(24, 70, 3)]
"""Heights of the camera over the horizon that are tried: the lowest that sees the robot."""

FAR = 5.0
"""Distance of the camera, in radii of the robot."""

WIDE, HIGH = 0.56, 0.80
"""Parts of the picture's width and height that the robot takes."""

CLEAR = 0.03
"""Least height of the line of sight over the ground [m]."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera of constant direction, frame by frame.

    Attributes:
        eye: Where it stands [m], shape (F, 3).
        middle: What it looks at [m], shape (F, 3).
        reach: Radius about that in which the robot is [m].
        view: It at the first frame.
    """

    eye: Float[np.ndarray, "frames 3"]
    middle: Float[np.ndarray, "frames 3"]
    reach: float
    view: View

    def at(self, frame: int) -> View:
        """The camera at one frame."""
        view = self.view
        return View(self.eye[frame], view.axes, view.focal, view.size, view.shift)

    def arrays(self) -> dict[str, np.ndarray]:
        """All of it, as the process that draws is told."""
        distance = FAR * self.reach
        return {
            "eye": self.eye,
            "axes": np.broadcast_to(self.view.axes, (len(self.eye), 3, 3)),
            "middle": self.middle,
            "focal": np.array(self.view.focal),
            "shift": np.array(self.view.shift),
            "size": np.array(self.view.size),
            "distance": np.array(distance),
            "reach": np.array(1.5 * self.reach),
            "fog": np.array([distance + 1.5 * self.reach, distance + 7.0 * self.reach]),
            "light": LIGHT,
        }


def camera_of(
    time: Float[np.ndarray, " frames"],
    body: Float[np.ndarray, "frames 4 4"],
    period: float,
    terrain: Ground,
    looks: Mapping[int, Float[np.ndarray, "points 3"]],
    size: tuple[int, int],
) -> Camera:
    """The camera that follows a robot.

    Args:
        time: Of each frame [s].
        body: ``X_world_body``, shape (F, 4, 4).
        period: Of a cycle [s]; what is shorter does not shake the camera.
        terrain: It may hide nothing.
        looks: All points of the robot at some frames, in the world [m].
        size: Width and height of the picture, in pixels.
    """
    every = float(time[1] - time[0]) if len(time) > 1 else 1.0
    middle = smoothed(body[:, :3, 3], 0.5 * period / every)
    about = np.concatenate([points - middle[frame] for frame, points in looks.items()])
    # The middle of the robot, which may lie off its trunk's.
    centre = (about.min(axis=0) + about.max(axis=0)) / 2
    middle, about = middle + centre, about - centre
    reach = float(np.linalg.norm(about, axis=1).max())
    yaw = math.atan2(body[0, 1, 0], body[0, 0, 0])
    azimuth = yaw + (AZIMUTH if terrain.is_level else UNEVEN_AZIMUTH)
    axes = _axes(azimuth, ELEVATIONS[0])
    for elevation in ELEVATIONS:
        axes = _axes(azimuth, elevation)
        if terrain.is_level or _sees(middle, middle + FAR * reach * axes[2], terrain):
            break
    view = View(FAR * reach * axes[2], axes, 1.0, size, (0.0, 0.0))
    seen = view.project(about)[:, :2]
    low, high = seen.min(axis=0), seen.max(axis=0)
    width, height = size
    focal = float(min(WIDE * width / (high - low)[0], HIGH * height / (high - low)[1]))
    across, down = -focal * (low + high) / 2
    shift = (width / 2 + float(across), 0.5 * height + float(down))
    eye = middle + FAR * reach * axes[2]
    return Camera(eye, middle, reach, View(eye[0], axes, focal, size, shift))


def smoothed(
    values: Float[np.ndarray, "frames parts"], width: float
) -> Float[np.ndarray, "frames parts"]:
    """Values without what is shorter than some frames; they begin and end where they did."""
    from scipy.ndimage import gaussian_filter1d

    if len(values) < 3:
        return values
    line = np.linspace(values[0], values[-1], len(values))
    width = min(width, len(values) / 4)
    found = line + gaussian_filter1d(values - line, width, axis=0, mode="nearest")
    return np.asarray(found)


def _axes(azimuth: float, elevation: float) -> Float[np.ndarray, "3 3"]:
    """Right, up and backward directions of a camera."""
    c, s = math.cos(azimuth), math.sin(azimuth)
    up, flat = math.sin(elevation), math.cos(elevation)
    back = np.array([c * flat, s * flat, up])
    right = np.array([-s, c, 0.0])
    return np.stack([right, np.cross(back, right), back])


def _sees(
    middle: Float[np.ndarray, "frames 3"], eye: Float[np.ndarray, "frames 3"], terrain: Ground
) -> bool:
    """Whether the ground leaves all lines of sight free."""
    part = np.linspace(0.15, 1.0, 30)[:, None, None]
    points = middle + part * (eye - middle)
    return bool((points[..., 2] > terrain.height(points[..., 0], points[..., 1]) + CLEAR).all())
