"""Events of the locomotion engine: sentences on conditions that begin during its updates."""

from __future__ import annotations

import numpy as np

from phasmid.control.types import LegPhase, SearchStage, State

LONG_WAIT = 0.25
"""Waiting time of a lift from which on it is an event [s]."""


class EventLog:
    """Events, each once for as long as its cause lasts.

    Args:
        state: State of the engine.
        names: Names of the legs.

    Attributes:
        events: Times [s] and sentences.
    """

    def __init__(self, state: State, names: tuple[str, ...]) -> None:
        self._state, self._names = state, names
        self.clear()

    def clear(self) -> None:
        """Forget all events."""
        self.events: list[tuple[float, str]] = []
        self._active: set[str] = set()
        self._search_changes = 0

    def set(self, cause: str, active: bool | np.bool_, sentence: str) -> None:
        """Set whether a cause is active; add an event where it begins.

        Args:
            cause: Name of the cause.
            active: Whether it is active now.
            sentence: Text of the event.
        """
        if not active:
            self._active.discard(cause)
        elif cause not in self._active:
            self._active.add(cause)
            self.events.append((self._state.clock.time, sentence))

    def add_update(self, result: int, limit_reason: str, tipping: bool) -> None:
        """Add the events of an update.

        Args:
            result: Result of `phasmid.control.update.advance_engine`.
            limit_reason: Limit of ground or servos that the motion exceeds; empty where none.
            tipping: Whether the body tips over, for which lifts wait, too.
        """
        clock, stage = self._state.clock, self._state.search_stage
        waits = clock.lift_wait > LONG_WAIT and not tipping
        hindered = waits and clock.pose_hinders == 1
        weak = waits and not hindered
        if weak:
            weak = not ((stage > SearchStage.NONE) & (stage < SearchStage.RETURNED)).any()
        lands = tipping and (self._state.leg_phase == LegPhase.PROBING).any()
        self.set("tipping", lands, "the body tips over: the feet in the air land at once")
        self.set("slowed", result == 1, "slowed down: a joint would turn too fast")
        self.set("braked", result == 2, "braked: a leg could not follow, or feet would not hold it")
        self.set("held", result == 3, "held all: a leg could not follow")
        self.set("back", hindered, "a lift waits: the body comes back from a farther pose")
        self.set("waits", weak, "a lift waits: the feet that stay would not hold the robot")
        self.set("effort", bool(limit_reason), f"slows down: {limit_reason.rstrip('.')}")
        if clock.search_changes == self._search_changes:
            return
        self._search_changes = clock.search_changes
        for name, now in zip(self._names, stage, strict=True):
            no_ground = f"leg {name} finds no ground"
            looks = SearchStage.NONE < now < SearchStage.RETURNED
            self.set(f"{name} looks", looks, f"{no_ground}: it looks elsewhere")
            back = now == SearchStage.RETURNED
            self.set(f"{name} returned", back, f"{no_ground}: it is back where it stood")
            stands = now == SearchStage.GAVE_UP
            self.set(f"{name} stands", stands, f"{no_ground}: it stands in the air")
