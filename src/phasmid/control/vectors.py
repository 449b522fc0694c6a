"""Vectors, rotations and plane paths at one instant."""

from __future__ import annotations

import math

import numpy as np

from phasmid.compiled import compiled
from phasmid.kinematics import vector_kernels as kernels
from phasmid.kinematics.leg_kernels import Triple
from phasmid.kinematics.vector_kernels import turned

Path = np.ndarray | Triple
"""Place and heading in odom [m, rad]."""


@compiled
def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross product of a and b."""
    return np.array(kernels.cross(a, b))


@compiled
def rotate(R: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return R times v."""
    return np.array(kernels.rotate(R, v))


@compiled
def rotate_back(R: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the transpose of R times v."""
    return np.array(kernels.rotate_back(R, v))


@compiled
def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return the rotation of roll about x, then pitch about y, then yaw about z, fixed axes."""
    return np.array(kernels.rpy_rows(roll, pitch, yaw))


@compiled
def in_odom(path: Path, x: float, y: float) -> tuple[float, float]:
    """Return a point of the path's axes in odom [m]."""
    x, y = turned(path[2], x, y)
    return path[0] + x, path[1] + y


@compiled
def in_path(path: Path, x: float, y: float) -> tuple[float, float]:
    """Return a point of odom in the path's axes [m]."""
    return turned(-path[2], x - path[0], y - path[1])


@compiled
def point_velocity(path: Path, velocity: np.ndarray, x: float, y: float) -> tuple[float, float]:
    """Return the velocity in odom of a point of odom that moves with the path [m/s]."""
    vx, vy = turned(path[2], velocity[0], velocity[1])
    return vx - velocity[2] * (y - path[1]), vy + velocity[2] * (x - path[0])


@compiled
def integrate_twist(path: Path, twist: np.ndarray, time: float) -> Triple:
    """Return the path after a time [s] at constant vx, vy, wz in its axes: an arc or a line."""
    turn = twist[2] * time
    if abs(turn) < 1e-4:
        along, across = 1.0 - turn * turn / 6, turn / 2
    else:
        along, across = math.sin(turn) / turn, (1.0 - math.cos(turn)) / turn
    dx = (along * twist[0] - across * twist[1]) * time
    dy = (across * twist[0] + along * twist[1]) * time
    x, y = in_odom(path, dx, dy)
    return x, y, path[2] + turn


@compiled
def is_zero(velocity: np.ndarray) -> bool:
    """Return whether a velocity is exactly zero."""
    return bool(velocity[0] == 0.0 and velocity[1] == 0.0 and velocity[2] == 0.0)
