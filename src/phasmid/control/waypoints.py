"""Places gone to one after the other: turn towards the next, go, turn to its heading."""

from __future__ import annotations

import math

from phasmid.control.command import Command
from phasmid.control.script import CommandScript

TURN_GAIN = 1.5
"""Turn per error of the heading [1/s]."""

NEAR_GAIN = 1.0
"""Speed per distance that is left, near a place [1/s]."""

SIDEWAYS = math.radians(40)
"""Error of the direction above which the robot turns on the spot."""

REST = 1.0
"""Time for which it stands at the last place before the drive ends [s]."""


class WaypointFollower:
    """Goes to a script's places, by where the robot is known to be.

    Args:
        script: With waypoints.

    Attributes:
        reached: Times at which the waypoints were reached [s], in their order; a waypoint with a
            heading is reached when the robot has turned to it.
        remaining: What is left to the next waypoint.
    """

    def __init__(self, script: CommandScript) -> None:
        self.reached: list[float] = []
        self.remaining = ""
        self._script, self._next = script, 0
        self._home: tuple[float, float, float] | None = None
        self._arrived: float | None = None

    def command(self, time: float, pose: tuple[float, float, float]) -> Command | None:
        """What brings the robot to the next place; None once it has stood at the last.

        Args:
            time: From the beginning [s].
            pose: Where it is: x, y [m] and yaw [rad], in any axes that stay.
        """
        script, follow = self._script, self._script.follow
        if script.duration is not None and time > script.duration + 1e-9:
            return None
        self._home = self._home or pose
        x0, y0, yaw0 = self._home
        c, s = math.cos(yaw0), math.sin(yaw0)
        while self._next < len(script.waypoint):
            place = script.waypoint[self._next]
            dx = x0 + c * place.x - s * place.y - pose[0]
            dy = y0 + s * place.x + c * place.y - pose[1]
            distance = math.hypot(dx, dy)
            self.remaining = f"{distance:.3g} m away"
            if self._arrived is None and distance > follow.reached:
                return Command(velocity=self._towards(math.atan2(dy, dx) - pose[2], distance))
            # Turning on the spot moves the robot a little, which is let be.
            self._arrived = time
            error = 0.0 if place.heading is None else _wrapped(yaw0 + place.heading - pose[2])
            self.remaining = f"{math.degrees(abs(error)):.0f}° from its heading"
            if abs(error) > follow.aligned:
                return Command(velocity=(0.0, 0.0, self._turn(error)))
            self.reached.append(time)
            self._next += 1
            if self._next < len(script.waypoint):
                self._arrived = None
        assert self._arrived is not None
        return Command() if time < self._arrived + REST else None

    def _towards(self, direction: float, distance: float) -> tuple[float, float, float]:
        """Velocity towards a place, seen from the body."""
        error = _wrapped(direction)
        if abs(error) > SIDEWAYS:
            return 0.0, 0.0, self._turn(error)
        speed = min(self._script.follow.speed, NEAR_GAIN * distance)
        return speed * math.cos(error), speed * math.sin(error), self._turn(error)

    def _turn(self, error: float) -> float:
        most = self._script.follow.turn_speed
        return min(max(TURN_GAIN * error, -most), most)


def _wrapped(angle: float) -> float:
    """An angle from minus half a turn to half a turn."""
    return math.remainder(angle, 2 * math.pi)
