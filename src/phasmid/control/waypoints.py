"""Commands that lead a robot along the waypoints of a script."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float

from phasmid.control.script import ROUND_OFF, CommandScript
from phasmid.experiment.command import Command

TURN_GAIN = 1.5
"""Yaw rate per error of the heading [1/s]."""

APPROACH_GAIN = 1.0
"""Speed per remaining distance near a waypoint [1/s]."""

LARGEST_ERROR = math.radians(40)
"""Error of the heading above which the robot turns on the spot [rad]."""

REST_TIME = 1.0
"""Time for which the robot stands at the last waypoint before the drive ends [s]."""


def plane_pose(
    position: Float[np.ndarray, "3"], orientation: Float[np.ndarray, "4"]
) -> tuple[float, float, float]:
    """Return x, y [m] and yaw [rad] of a body, whose orientation is w x y z."""
    (x, y, _), (w, i, j, k) = position.tolist(), orientation.tolist()
    return x, y, math.atan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))


class WaypointFollower:
    """Turns towards each waypoint, walks to it, and turns to its heading.

    Args:
        script: With waypoints.

    Attributes:
        reached: Times at which waypoints were reached, their headings included [s].
        remaining: Distance or angle to the next waypoint, in words.
    """

    def __init__(self, script: CommandScript) -> None:
        self.reached: list[float] = []
        self.remaining = ""
        self._script, self._start = script, (math.nan,) * 3
        self._arrival: float | None = None

    def command(self, time: float, pose: tuple[float, float, float]) -> Command | None:
        """Return the command at a time; None at the end.

        Args:
            time: Since the beginning [s].
            pose: Of the robot: x, y [m] and yaw [rad], in a fixed frame.
        """
        script, follow = self._script, self._script.follow
        if script.duration is not None and time > script.duration + ROUND_OFF:
            return None
        if math.isnan(self._start[0]):
            self._start = pose
        x0, y0, yaw0 = self._start
        c, s = math.cos(yaw0), math.sin(yaw0)
        while len(self.reached) < len(script.waypoint):
            place = script.waypoint[len(self.reached)]
            dx = x0 + c * place.x - s * place.y - pose[0]
            dy = y0 + s * place.x + c * place.y - pose[1]
            distance = math.hypot(dx, dy)
            self.remaining = f"{distance:.3g} m away"
            if self._arrival is None and distance > follow.reached:
                error = math.remainder(math.atan2(dy, dx) - pose[2], math.tau)
                speed = min(follow.speed, APPROACH_GAIN * distance)
                return self._walk(error, speed if abs(error) <= LARGEST_ERROR else 0.0)
            # Turning on the spot moves the robot a little, which is accepted.
            self._arrival = time
            error = 0.0
            if place.heading is not None:
                error = math.remainder(yaw0 + place.heading - pose[2], math.tau)
            self.remaining = f"{math.degrees(abs(error)):.0f}° from its heading"
            if abs(error) > follow.aligned:
                return self._walk(error, 0.0)
            self.reached.append(time)
            if len(self.reached) < len(script.waypoint):
                self._arrival = None
        assert self._arrival is not None
        return Command() if time < self._arrival + REST_TIME else None

    def _walk(self, error: float, speed: float) -> Command:
        """Return the command for an error of the heading [rad] and a speed [m/s]."""
        most = self._script.follow.turn_speed
        turn = min(max(TURN_GAIN * error, -most), most)
        return Command(velocity=(speed * math.cos(error), speed * math.sin(error), turn))
