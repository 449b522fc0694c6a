"""One thing that a machine can do or cannot, and what would help."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class State(Enum):
    """How a thing stands."""

    READY = "ready"
    ABSENT = "absent"
    BROKEN = "broken"


@dataclass(frozen=True)
class Finding:
    """What was found about one thing.

    Attributes:
        topic: What it is about, in a word or two.
        state: How it stands.
        what: What is there, or what is missing and what it would be for.
        remedy: The one command that installs it, or the one thing to try; empty where nothing is
            to be done.
        needed: Whether nothing walks without it.
    """

    topic: str
    state: State
    what: str
    remedy: str = ""
    needed: bool = False

    def as_dict(self) -> dict[str, str | bool]:
        """The same for a program."""
        return {
            "topic": self.topic,
            "state": self.state.value,
            "what": self.what,
            "remedy": self.remedy,
            "needed": self.needed,
        }
