"""What people do to the live robot: its setting, the stick, pushes and lost legs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

from phasmid.errors import InvalidInput
from phasmid.robot import JOINTS
from phasmid.studio.fields import field_of
from phasmid.studio.live import LiveRobot
from phasmid.studio.setting import Setting

STALE = 0.5
"""A stick that was not told of for longer is let go [s]."""

GENTLE = (0.5, 0.0, 0.0)
"""Shares of the largest velocities with which the robot walks by itself."""

HARDEST = 1.5
"""Largest change of the robot's speed by a push [m/s]."""

POSES = ("body_height", "body_x", "body_y", "roll", "pitch", "yaw")

AT_REST = (0.0, 0.0, 0.0)


class Hands:
    """Holds the robot that is there, and does to it what is asked; all in the stage's thread.

    Args:
        setting: With what it begins.
        build: Stands a robot up by a setting, with the numbers of lost legs, or refuses it.
        changed: Is called after the setting has changed.
        say: Takes sentences about what was done.

    Attributes:
        setting: What the robot is, and what it does.
        live: The robot; None while there is none.
        lost: Numbers of the legs that are not used.
        dead: Numbers of the legs whose servos are dead.
    """

    def __init__(
        self,
        setting: Setting,
        *,
        build: Callable[[Setting, frozenset[int]], None],
        changed: Callable[[], None],
        say: Callable[[str], None],
    ) -> None:
        self.setting = setting
        self.live: LiveRobot | None = None
        self.lost: frozenset[int] = frozenset()
        self.dead: frozenset[int] = frozenset()
        self._build, self._changed, self._say = build, changed, say
        self._stick, self._stick_at = AT_REST, -math.inf

    @property
    def robot(self) -> LiveRobot:
        """The robot that is there."""
        assert self.live is not None
        return self.live

    def made(self, setting: Setting, lost: frozenset[int]) -> LiveRobot:
        """A robot by a setting, which does what is asked.

        Raises:
            InvalidInput: It cannot be built, or not walk so.
        """
        live = LiveRobot(setting)
        live.follow(setting, self._share(setting), lost)
        return live

    def begin(self, live: LiveRobot, lost: frozenset[int]) -> None:
        """Take another robot."""
        self.live, self.setting = live, live.setting
        self.lost, self.dead = lost, frozenset()

    def take_up(self, setting: Setting) -> None:
        """Go by another setting from now on, or refuse it as a whole.

        Raises:
            InvalidInput: It cannot be built, or not walk so; all stays as it was.
        """
        if setting.built_of() != self.setting.built_of():
            same = len(setting.base.legs) == len(self.setting.base.legs)
            self._build(setting, self.lost if same else frozenset())
            return
        self.robot.follow(setting, self._share(setting), self.lost)
        self.setting = setting
        self._changed()

    def _share(self, setting: Setting) -> tuple[float, float, float]:
        if setting.walks == "by itself":
            return GENTLE
        return self._stick if setting.walks == "by hand" else AT_REST

    def _follow(self) -> None:
        """Go where the setting and the stick say."""
        if self.live is not None:
            self.live.follow(self.setting, self._share(self.setting), self.lost)

    def let_go(self, now: float, *, alone: bool) -> None:
        """Let go of a stick that nobody holds any more.

        Args:
            now: Wall time [s].
            alone: Whether nobody looks on.
        """
        if self._stick != AT_REST and (now - self._stick_at > STALE or alone):
            self._stick = AT_REST
            self._follow()

    # What is asked -------------------------------------------------------------------------------

    def steer(self, at: tuple[float, float, float]) -> None:
        """Go where a stick says."""
        if self.setting.walks == "the plan":
            raise InvalidInput(
                "the robot walks by its plan, which knows no stick.", hint='walks = "by hand"'
            )
        forward, lateral, yaw = (min(max(part, -1.0), 1.0) for part in at)
        share = forward, lateral, yaw
        if self.setting.walks == "by itself":
            if not any(share):
                return
            self.setting = replace(self.setting, walks="by hand")
            self._changed()
        self._stick_at = time.monotonic()
        if share != self._stick:
            self._stick = share
            self._follow()

    def change(self, name: str, value: object) -> None:
        """Give a field another value."""
        field = field_of(name)
        if self.setting.walks == "the plan" and name in POSES:
            raise InvalidInput(
                "the robot walks by its plan, which knows no other pose of the body.",
                hint='walks = "by hand"',
            )
        setting = field.changed(self.setting, value)
        if name == "walks":
            self._stick = AT_REST
        if field.value(setting) != field.value(self.setting):
            self.take_up(setting)

    def upright(self) -> LiveRobot:
        """The robot, where it can be done something to."""
        if self.robot.trouble is not None:
            raise InvalidInput("the robot fell; it is put back in a moment.", hint="reset")
        return self.robot

    def push(self, impulse: tuple[float, float, float]) -> None:
        """Push the trunk [N·s]."""
        live = self.upright()
        most = HARDEST * live.source.robot.mass
        size = math.hypot(*impulse)
        if size > most:
            raise InvalidInput(
                f"the push is {size:.3g} N·s; it must be at most {most:.3g} N·s, which changes "
                f"the robot's speed by {HARDEST:g} m/s.",
                hint=f"{most / 3:.2g} N·s",
            )
        live.run.push(impulse)
        self._say(f"a push of {size:.3g} N·s.")

    def limb(self, leg: int, how: str) -> None:
        """Lose a leg, have it back, or let its servos die."""
        live = self.upright()
        names = self.setting.base.leg_names
        if not 1 <= leg <= len(names):
            raise InvalidInput(f"there is no leg {leg}; legs are 1 to {len(names)}.")
        name = names[leg - 1].replace("_", " ")
        if how == "limp":
            if leg not in self.dead:
                for joint in range(len(JOINTS)):
                    live.run.fail_servo(leg - 1, joint)
                self.dead |= {leg}
                self._say(f"all servos of leg {name} died.")
            return
        if live.plays:
            raise InvalidInput(
                "the robot walks by its plan, which knows no lost legs.", hint='walks = "by hand"'
            )
        if how == "restore" and leg in self.dead:
            raise InvalidInput(
                f"the servos of leg {name} are dead for as long as the robot is not put back.",
                hint="reset",
            )
        lost = self.lost | {leg} if how == "lose" else self.lost - {leg}
        live.follow(self.setting, self._share(self.setting), lost)
        if lost != self.lost:
            self._say(f"leg {name} is {'lost' if how == 'lose' else 'there again'}.")
        self.lost = lost
