"""Command tracking: how much of its commanded motion a body made."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from phasmid.kinematics.frames import quaternion_yaw

MIN_DISTANCE = 1e-3
"""Least commanded distance of which there is a share [m]; contacts yield by tenths of it."""

MIN_TURN = math.radians(10)
"""Least commanded turn of which there is a share [rad]; slip of loaded feet turns a body by some
degrees."""


@dataclass(frozen=True)
class CommandTracking:
    """The commanded motion of a body over ground, and what the body made of it.

    Runs add up: the sum of two successive ones is that of the whole.

    Attributes:
        distance: The body's velocity in the commanded direction, integrated [m].
        commanded_distance: The commanded speed, integrated [m].
        turn: The body's yaw rate in the commanded sense, integrated [rad].
        commanded_turn: The size of the commanded yaw rate, integrated [rad].
    """

    distance: float = 0.0
    commanded_distance: float = 0.0
    turn: float = 0.0
    commanded_turn: float = 0.0

    def __add__(self, other: CommandTracking) -> CommandTracking:
        return CommandTracking(
            self.distance + other.distance,
            self.commanded_distance + other.commanded_distance,
            self.turn + other.turn,
            self.commanded_turn + other.commanded_turn,
        )

    @property
    def distance_share(self) -> float | None:
        """Share of the commanded distance that was made; None where none was commanded."""
        is_commanded = self.commanded_distance >= MIN_DISTANCE
        return self.distance / self.commanded_distance if is_commanded else None

    @property
    def turn_share(self) -> float | None:
        """Share of the commanded turn that was made; None where none was commanded."""
        return self.turn / self.commanded_turn if self.commanded_turn >= MIN_TURN else None

    @property
    def smallest_share(self) -> float | None:
        """The smaller one of both shares; None where nothing was commanded."""
        known = [share for share in (self.distance_share, self.turn_share) if share is not None]
        return min(known, default=None)


def share_words(distance_share: float | None, turn_share: float | None) -> str:
    """Return the shares of a `CommandTracking` in words; empty where nothing was commanded."""
    return " and ".join(
        f"{100 * share:z.1f} % of the commanded {what}"
        for what, share in (("distance", distance_share), ("turn", turn_share))
        if share is not None
    )


def track_command(
    time: Float[np.ndarray, " time"],
    command: Float[np.ndarray, "time 3"],
    position: Float[np.ndarray, "time axes"],
    orientation: Float[np.ndarray, "time 4"],
    heading: Float[np.ndarray, " time"] | None = None,
) -> CommandTracking:
    """Compare the motion of a body with a commanded velocity.

    A command holds until the next sample.

    Args:
        time: Times of the samples [s], shape (N,).
        command: Commanded velocity ahead and to the left [m/s], and yaw rate [rad/s], shape (N, 3).
        position: Origin of the body in the world, x and y first [m], shape (N, 2) or (N, 3).
        orientation: Orientation of the body in the world, w x y z, shape (N, 4).
        heading: Yaw of the axes in which the velocity is commanded [rad], shape (N,); None: the
            body's own.
    """
    yaw = np.unwrap(quaternion_yaw(orientation))
    axes = yaw if heading is None else heading
    (dx, dy), turn = np.diff(position[:, :2], axis=0).T, np.diff(yaw)
    # A constant twist moves the body along the mean direction of its axes.
    middle = (axes[1:] + axes[:-1]) / 2
    c, s = np.cos(middle), np.sin(middle)
    moved = np.stack([c * dx + s * dy, c * dy - s * dx, turn], axis=-1)
    return _tracked(np.diff(time), command[:-1], moved)


def track_twist(
    time: Float[np.ndarray, " time"],
    twist: Float[np.ndarray, "3"],
    position: Float[np.ndarray, "time axes"],
    orientation: Float[np.ndarray, "time 4"],
) -> CommandTracking:
    """Compare the motion of a body with a plan of one constant twist from the world's axes on.

    Args:
        time: Times since the start of the plan [s], shape (N,).
        twist: Planned velocity ahead and to the left [m/s], and yaw rate [rad/s], shape (3,).
        position: Origin of the body in the world, x and y first [m], shape (N, 2) or (N, 3).
        orientation: Orientation of the body in the world, w x y z, shape (N, 4).
    """
    command = np.tile(twist, (len(time), 1))
    return track_command(time, command, position, orientation, twist[2] * time)


def track_velocity(
    time: Float[np.ndarray, " time"],
    command: Float[np.ndarray, "time 3"],
    velocity: Float[np.ndarray, "time 3"],
) -> CommandTracking:
    """Compare a velocity in body axes with a commanded one; both hold until the next sample.

    Args:
        time: Times of the samples [s], shape (N,).
        command: Commanded velocity ahead and to the left [m/s], and yaw rate [rad/s], shape (N, 3).
        velocity: The other velocity, shape (N, 3).
    """
    held = np.diff(time)
    return _tracked(held, command[:-1], held[:, None] * velocity[:-1])


def _tracked(held: np.ndarray, command: np.ndarray, moved: np.ndarray) -> CommandTracking:
    """Return the commanded motions of intervals [s], and the parts of motions along them."""
    v, wz = command[:, :2], command[:, 2]
    speed = np.linalg.norm(v, axis=1)
    ahead = np.divide(v, speed[:, None], out=np.zeros_like(v), where=speed[:, None] > 0)
    return CommandTracking(
        distance=float(np.vdot(moved[:, :2], ahead)),
        commanded_distance=float(held @ speed),
        turn=float(moved[:, 2] @ np.sign(wz)),
        commanded_turn=float(held @ np.abs(wz)),
    )
