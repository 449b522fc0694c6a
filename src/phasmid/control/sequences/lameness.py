"""What becomes of legs that are lost: how they are held, and how the others walk on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.control.command import Command
from phasmid.control.controller import Controller
from phasmid.control.observation import Observation
from phasmid.control.sequences.leg_loss import LegFaultDetector, lifted_leg
from phasmid.control.sequences.limping import Limping, limping
from phasmid.control.sequences.settings import SequenceSettings
from phasmid.control.sequences.stance import neutral_stance
from phasmid.errors import InvalidGait
from phasmid.gait import Gait
from phasmid.robot import Robot


class Lameness:
    """Notices servos that are lost, has their legs folded, and tells commands for the others.

    Attributes:
        events: What was noticed and not told yet: times [s] and sentences.
    """

    def __init__(self, walker: Controller, robot: Robot, settings: SequenceSettings) -> None:
        self._walker, self._robot, self._settings = walker, robot, settings
        self._servos = LegFaultDetector(robot)
        self._limps: dict[tuple[str | Gait, frozenset[int]], Limping] = {}
        self._held: dict[int, Float[np.ndarray, "3"]] = {}
        self._seen: tuple[Command, frozenset[int], Command] | None = None
        self._refused: set[str] = set()
        self.events: list[tuple[float, str]] = []

    def reset(self, time: float) -> None:
        """Forget all; every servo is taken for sound at a time [s]."""
        self._servos.reset(time)
        self._seen = None
        for kept in (self.events, self._held, self._limps, self._refused):
            kept.clear()

    def notice(self, observation: Observation) -> bool:
        """Look at an observation; whether a servo has been lost by it."""
        doubted = self._servos.doubtful
        lost = self._servos.notice(observation)
        catch = getattr(self._walker, "catch", None)
        if self._servos.doubtful and not doubted and callable(catch):
            # Its leg may not hold any more; the others are soon enough on the ground only if they
            # do not wait for its answer. Once, since a slow bus leaves some servo silent always.
            catch()
        if not lost:
            return False
        self.events += self._servos.events
        self._servos.events.clear()
        self._fold(observation)
        return True

    def adapt(self, time: float, command: Command) -> Command:
        """The command for the legs that are left; the same object as long as it is the same."""
        lost = self._servos.legs
        if not (lost or command.lost_legs):
            return command
        if self._seen and self._seen[0] is command and self._seen[1] == lost:
            return self._seen[2]
        made = replace(command, lost_legs=command.lost_legs | lost)
        gait: Any = getattr(self._walker, "gait", None)
        if isinstance(gait, Gait):
            try:
                asked = command.gait or gait
                key = (asked, made.lost_legs)
                if key not in self._limps:
                    self._limps[key] = limping(self._robot, asked, made.lost_legs, self._held)
                if not hasattr(self._walker, "largest_velocity"):
                    # One that tells how fast it is without legs finds its gait and shift by itself.
                    made = self._limps[key].follow(made)
            except InvalidGait as error:
                if error.what not in self._refused:
                    self._refused.add(error.what)
                    self.events.append((time, error.what))
                made = replace(made, velocity=(0.0, 0.0, 0.0))
        self._seen = command, lost, made
        return made

    def _fold(self, observation: Observation) -> None:
        """Find out how lost legs are held with the joints that still work."""
        fold = getattr(self._walker, "fold", None)
        height = float(neutral_stance(self._robot).pose[2])
        for number in self._servos.legs:
            leg = number - 1
            dead = [int(joint) for joint in np.flatnonzero(self._servos.lost[leg])]
            now = observation.joint_position[leg]
            q, clear = lifted_leg(
                self._robot,
                leg,
                height,
                self._settings,
                dead=dead,
                now=now if np.isfinite(now).all() else None,
            )
            self._held[leg] = q
            if clear <= 0:
                name = self._robot.leg_names[leg]
                self.events.append((observation.time, f"leg {name} may drag on the ground."))
            if callable(fold):
                fold(leg, q)
