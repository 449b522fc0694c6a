"""What a statement of the paper is, and what comes of measuring it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from phasmid.paper.evidence import Evidence


class Grade(Enum):
    """How a statement fares; the value is what the table prints."""

    HOLDS = "holds"
    WITH_A_LIMIT = "holds, with a limit"
    FAILS = "does not hold"
    MISPRINTED = "misprinted"
    NOT_TESTED = "not tested"


class Finding(NamedTuple):
    """What was measured.

    Attributes:
        number: The figure, with its unit.
        grade: What it makes of the statement.
        note: What a reader must know besides; may be empty.
    """

    number: str
    grade: Grade
    note: str = ""


@dataclass(frozen=True)
class Statement:
    """One thing that the paper says.

    Attributes:
        where: Section, equation, table or figure.
        says: The statement, in our words.
        measure: Finds the number and the grade.
    """

    where: str
    says: str
    measure: Callable[[Evidence], Finding]


def judged(good: bool | np.bool_, number: str, note: str = "") -> Finding:
    """A finding of a statement that either holds or does not."""
    return Finding(number, Grade.HOLDS if good else Grade.FAILS, note)
