"""Findings about a robot's description, in sentences."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Severity(Enum):
    """Severity of a finding; the value is the word in tables."""

    IMPOSSIBLE = "impossible"
    SUSPECT = "suspect"
    NOTE = "note"


@dataclass(frozen=True)
class Finding:
    """One finding about a description.

    Attributes:
        severity: ``IMPOSSIBLE`` where the robot cannot walk so, ``SUSPECT`` where it can but
            hardly is so, ``NOTE`` for data that was ignored, assumed or rounded.
        subject: Link, joint or other subject, such as ``link tibia_rf``.
        what: One sentence, with the measured number and its limit.
        where: File and line; empty where nothing is known.
        hint: One thing to try; empty where there is none.
    """

    severity: Severity
    subject: str
    what: str
    where: str = ""
    hint: str = ""

    @property
    def sentence(self) -> str:
        """Subject and finding, such as ``leg 3: no foot in the file; ...``."""
        if self.what.startswith(self.subject):
            return self.what
        return f"{self.subject}: {self.what}"
