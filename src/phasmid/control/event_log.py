"""What the locomotion engine says of its updates."""

from __future__ import annotations

import numpy as np

from phasmid.control.types import SearchStage, State

PATIENT = 0.25
"""A lift that waits for longer is worth a sentence [s]."""

NOTHING = 0, False, False, "", 0
"""What is new of an update of which nothing is to be said."""


class Remarks:
    """Sentences, each once for as long as what it tells goes on.

    Args:
        state: Where the engine is.
        names: Of the legs.

    Attributes:
        events: Times [s] and sentences.
    """

    def __init__(self, state: State, names: tuple[str, ...]) -> None:
        self._state, self._names = state, names
        self.forget()

    def forget(self) -> None:
        """Forget all that was said."""
        self.events: list[tuple[float, str]] = []
        self._said: set[str] = set()
        self._news: tuple[int, bool, bool, str, int] = NOTHING

    def tell(self, kind: str, is_so: bool | np.bool_, sentence: str) -> None:
        """Say something that is so, unless it has been so since it was said.

        Args:
            kind: A word for it.
            is_so: Whether it is so now.
            sentence: What is said.
        """
        if not is_so:
            self._said.discard(kind)
        elif kind not in self._said:
            self._said.add(kind)
            self.events.append((float(self._state.clock.time), sentence))

    def goes_on(self, kind: str) -> bool:
        """Whether something that was said is still so.

        Args:
            kind: The word for it.
        """
        return kind in self._said

    def _news_of(self, code: int, effort: str) -> tuple[int, bool, bool, str, int]:
        """What there would be to say of an update."""
        clock = self._state.clock
        waits = bool(clock.lift_wait > PATIENT)
        hindered = waits and bool(clock.pose_hinders == 1)
        return code, waits, hindered, effort, int(clock.search_changes)

    def of_update(self, code: int, effort: str) -> None:
        """Say what is new of an update.

        Args:
            code: What became of it, see `phasmid.control.update.update`.
            effort: Why ground or servos cannot give the motion; empty where they can.
        """
        state, news = self._state, self._news_of(code, effort)
        _, waits, back, _, looks = news
        if news == self._news:
            return
        looked = looks != self._news[-1]
        self._news = news
        self.tell("slowed", code == 1, "slowed down: a joint would turn too fast")
        self.tell("braked", code == 2, "braked: a leg could not follow, or feet would not hold it")
        self.tell("held", code == 3, "held all: a leg could not follow")
        self.tell("back", back, "a lift waits: the body comes back from a farther pose")
        # What waits for a foot that looks for ground is told below.
        weak = (
            waits
            and not back
            and not ((state.search_stage > 0) & (state.search_stage < SearchStage.RETURNED)).any()
        )
        self.tell("waits", weak, "a lift waits: the feet that stay would not hold the robot")
        self.tell("effort", bool(effort), f"slows down: {effort.rstrip('.')}")
        if not looked:
            return
        for name, count in zip(self._names, state.search_stage, strict=True):
            told = f"leg {name} finds no ground: it looks elsewhere"
            self.tell(f"{name} looks", 0 < count < SearchStage.RETURNED, told)
            told = f"leg {name} finds no ground: it is back where it stood"
            self.tell(f"{name} returned", count == SearchStage.RETURNED, told)
            told = f"leg {name} finds no ground: it stands in the air"
            self.tell(f"{name} stands", count == SearchStage.GAVE_UP, told)
