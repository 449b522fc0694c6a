"""Actions of users on the live robot: setting, stick, pushes and lost legs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

from phasmid.errors import InvalidInput
from phasmid.robot import JOINTS
from phasmid.studio.fields import field_of
from phasmid.studio.live import LiveRobot
from phasmid.studio.setting import LOCOMOTION, Setting

STICK_TIMEOUT = 0.5
"""A stick command expires after as long [s]."""

GENTLE = (0.5, 0.0, 0.0)
"""Shares of the largest velocity with which the robot walks by itself."""

HARDEST = 1.5
"""Largest change of the robot's speed by a push [m/s]."""

POSES = ("body_height", "body_x", "body_y", "roll", "pitch", "yaw")

AT_REST = (0.0, 0.0, 0.0)

BY_HAND = 'walks = "by hand"'


class Operator:
    """Owner of the live robot, which applies actions to it; all in the simulation's thread.

    Args:
        setting: Initial setting.
        build: Builds the robot of a setting, with the numbers of lost legs, or refuses.
        changed: Called after the setting has changed.
        report: Receives sentences on actions.

    Attributes:
        setting: Present setting.
        live: Robot; None while there is none.
        lost: Numbers of the legs out of use.
        dead: Numbers of the legs without working servos.
    """

    def __init__(
        self,
        setting: Setting,
        *,
        build: Callable[[Setting, frozenset[int]], None],
        changed: Callable[[], None],
        report: Callable[[str], None],
    ) -> None:
        self.setting = setting
        self.live: LiveRobot | None = None
        self.lost: frozenset[int] = frozenset()
        self.dead: frozenset[int] = frozenset()
        self._build, self._changed, self._report = build, changed, report
        self._stick, self._stick_at = AT_REST, -math.inf

    @property
    def robot(self) -> LiveRobot:
        """Robot, where there is one."""
        assert self.live is not None
        return self.live

    def create(self, setting: Setting, lost: frozenset[int]) -> LiveRobot:
        """Create the robot of a setting.

        Raises:
            InvalidInput: It cannot be built, or cannot walk so.
        """
        live = LiveRobot(setting)
        live.follow(setting, self._share(setting), lost)
        return live

    def adopt(self, live: LiveRobot, lost: frozenset[int]) -> None:
        """Replace the robot."""
        self.live, self.setting = live, live.setting
        self.lost, self.dead = lost, frozenset()

    def apply(self, setting: Setting) -> None:
        """Replace the setting.

        Raises:
            InvalidInput: It cannot be built, or cannot be walked; all stays as it was.
        """
        if setting.built_of() != self.setting.built_of():
            same = len(setting.base.legs) == len(self.setting.base.legs)
            self._build(setting, self.lost if same else frozenset())
            return
        self.robot.follow(setting, self._share(setting), self.lost)
        self.setting = setting
        self._changed()

    def _share(self, setting: Setting) -> tuple[float, float, float]:
        """Return the commanded shares of the largest velocity."""
        if setting.walks == "by itself":
            return GENTLE
        return self._stick if setting.walks == "by hand" else AT_REST

    def _move_stick(self, share: tuple[float, float, float]) -> None:
        if share != self._stick:
            self._stick = share
            if self.live is not None:
                self.live.follow(self.setting, self._share(self.setting), self.lost)

    def release_stale_stick(self, now: float, *, unwatched: bool) -> None:
        """Center the stick once its command has expired, or without viewers.

        Args:
            now: Wall time [s].
            unwatched: True if no browser is open.
        """
        if unwatched or now - self._stick_at > STICK_TIMEOUT:
            self._move_stick(AT_REST)

    # Requests ------------------------------------------------------------------------------------

    def steer(self, at: tuple[float, float, float]) -> None:
        """Move the stick: shares of the largest velocity forward, lateral and in yaw."""
        if self.setting.walks == "the plan":
            raise InvalidInput("the robot walks by its plan, without a stick.", hint=BY_HAND)
        forward, lateral, yaw = (min(max(part, -1.0), 1.0) for part in at)
        share = forward, lateral, yaw
        if self.setting.walks == "by itself":
            if not any(share):
                return
            self.setting = replace(self.setting, walks="by hand")
            self._changed()
        self._stick_at = time.monotonic()
        self._move_stick(share)

    def change(self, name: str, value: object) -> None:
        """Change a field of the setting."""
        field = field_of(name)
        if self.setting.walks == "the plan" and name in POSES:
            raise InvalidInput(
                "the robot walks by its plan, without another pose of the body.", hint=BY_HAND
            )
        if self.setting.controller != LOCOMOTION and name in POSES:
            raise InvalidInput(
                "a learned policy takes no pose of the body.",
                hint='controller = "locomotion controller"',
            )
        setting = field.changed(self.setting, value)
        if name == "walks":
            self._stick = AT_REST
        if field.value(setting) != field.value(self.setting):
            self.apply(setting)

    def upright(self) -> LiveRobot:
        """Return the robot.

        Raises:
            InvalidInput: It fell.
        """
        if self.robot.failure is not None:
            raise InvalidInput("the robot fell; it is put back in a moment.", hint="reset")
        return self.robot

    def push(self, impulse: tuple[float, float, float]) -> None:
        """Push the trunk by an impulse in body axes [N·s]."""
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
        self._report(f"a push of {size:.3g} N·s.")

    def limb(self, leg: int, how: str) -> None:
        """Lose a leg, restore it, or disable its servos."""
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
                self._report(f"all servos of leg {name} died.")
            return
        if live.plays:
            raise InvalidInput("the robot walks by its plan, without lost legs.", hint=BY_HAND)
        if not live.lifts_legs:
            raise InvalidInput(
                "a learned policy walks with all legs.", hint='controller = "locomotion controller"'
            )
        if how == "restore" and leg in self.dead:
            raise InvalidInput(
                f"the servos of leg {name} are dead for as long as the robot is not put back.",
                hint="reset",
            )
        lost = self.lost | {leg} if how == "lose" else self.lost - {leg}
        live.follow(self.setting, self._share(self.setting), lost)
        if lost != self.lost:
            self._report(f"leg {name} is {'lost' if how == 'lose' else 'there again'}.")
        self.lost = lost
