"""The pinhole camera of the pictures and videos."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

FAR = 5.0
"""Distance of the camera from the robot's middle, in radii of the robot."""


@dataclass(frozen=True, eq=False)
class View:
    """A pinhole camera.

    Attributes:
        eye: Position of the camera [m], shape (3,).
        axes: Its right, up and backward directions as rows, shape (3, 3).
        focal: Focal length [pixels].
        size: Width and height of the picture [pixels].
        distance: Distance from the eye to the robot's middle [m].
    """

    eye: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]
    focal: float
    size: tuple[int, int]
    distance: float

    @property
    def middle(self) -> Float[np.ndarray, "3"]:
        """The robot's middle [m], shape (3,)."""
        return self.eye - self.distance * self.axes[2]

    def moved(self, displacement: Float[np.ndarray, "3"]) -> View:
        """Return the camera moved by a displacement [m]."""
        return replace(self, eye=self.eye + displacement)

    def project(self, points: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 2"]:
        """Return points [m] in the picture, to the right and down [pixels]."""
        x, y, back = np.moveaxis((points - self.eye) @ self.axes.T, -1, 0)
        scale = self.focal / np.maximum(-back, 1e-3)
        return np.stack([self.size[0] / 2 + scale * x, self.size[1] / 2 - scale * y], axis=-1)


def camera_axes(azimuth: float, elevation: float) -> Float[np.ndarray, "3 3"]:
    """Return right, up and backward directions of a camera as rows.

    Args:
        azimuth: Direction from the robot to the camera in the plane [rad].
        elevation: Angle of that direction above the plane [rad].
    """
    c, s = math.cos(azimuth), math.sin(azimuth)
    back = np.array([c * math.cos(elevation), s * math.cos(elevation), math.sin(elevation)])
    right = np.array([-s, c, 0.0])
    return np.stack([right, np.cross(back, right), back])


def fitted_view(
    points: Float[np.ndarray, "points 3"],
    axes: Float[np.ndarray, "3 3"],
    size: tuple[int, int],
    fill: tuple[float, float],
) -> View:
    """Return the camera in whose picture points lie in the middle.

    Args:
        points: Points of the robot [m].
        axes: Directions of the camera, as of `camera_axes`.
        size: Width and height of the picture [pixels].
        fill: Largest share of width and height that the points take.
    """
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    distance = FAR * float(np.linalg.norm(points - middle, axis=1).max())
    view = View(middle + distance * axes[2], axes, float(size[0]), size, distance)
    # Perspective: the outline changes a little as the camera moves.
    for _ in range(4):
        seen = view.project(points)
        low, high = seen.min(axis=0), seen.max(axis=0)
        right, down = (low + high - size) / 2 * distance / view.focal
        view = view.moved(right * axes[0] - down * axes[1])
        view = replace(view, focal=view.focal * float(np.min(np.array(fill) * size / (high - low))))
    return view
