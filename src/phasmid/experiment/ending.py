"""How a run ends."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Ending(Enum):
    """How a run ended, and the sentence for it."""

    COMPLETED = "The run came to its end."
    SHORT = "The robot fell short of its command."
    INCOMPLETE = "The drive did not reach all waypoints."
    FELL = "The robot fell."
    DIVERGED = "The simulation diverged."
    FAILED = "The controller failed."
    STOPPED = "The run was stopped by the user."
    ABORTED = "The driver ended the walk."
    CUT = "The run was cut off."

    @property
    def is_full_length(self) -> bool:
        """Whether the run lasted as long as it should."""
        return self in (Ending.COMPLETED, Ending.SHORT, Ending.INCOMPLETE)


@dataclass(frozen=True)
class Failure:
    """Why a run ended early.

    Attributes:
        ending: How the run ends.
        sample: Index of the first sample concerned.
        reason: Cause and time.
        remedy: What to try, or nothing.
    """

    ending: Ending
    sample: int
    reason: str
    remedy: str = ""

    @property
    def sentence(self) -> str:
        """How the run ended, where and why, and what to try."""
        sentence = f"{self.ending.value[:-1]} {self.reason}."
        return f"{sentence} Try {self.remedy}." if self.remedy else sentence
