"""Statements of the paper, and the findings of their measurement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from phasmid.paper.evidence import Evidence


class Grade(Enum):
    """Grade of a statement; the value is printed in the table, `RULES` gives its rule."""

    HOLDS = "holds"
    CORRECTED = "holds once corrected"
    WITH_A_LIMIT = "holds with a limit"
    BY_CONSTRUCTION = "by construction"
    MISPRINTED = "misprinted"
    FAILS = "does not hold"
    NOT_TESTED = "not tested"


RULES = {
    Grade.HOLDS: "the measurement confirms every part of the statement",
    Grade.CORRECTED: "the measurement confirms it after the paper's misprints are corrected",
    Grade.WITH_A_LIMIT: "the measurement confirms a part of the statement, or all of it under a "
    "condition; the line names the part or the condition",
    Grade.BY_CONSTRUCTION: "the statement is an input of the robot or the scenario, so that no "
    "measurement can differ",
    Grade.MISPRINTED: "the printed form gives other numbers than the right form",
    Grade.FAILS: "the measurement confirms no part of the statement under any condition tried",
    Grade.NOT_TESTED: "nothing was measured",
}
"""When each grade is given; the one rule for all statements."""


class Finding(NamedTuple):
    """Finding of a measurement.

    Attributes:
        number: The figure, with its unit.
        grade: Grade of the statement.
        note: Further remarks; may be empty.
    """

    number: str
    grade: Grade
    note: str = ""


@dataclass(frozen=True)
class Statement:
    """Statement of the paper.

    Attributes:
        where: Section, equation, table or figure.
        says: The statement, in our words.
        measure: Finds the number and the grade.
    """

    where: str
    says: str
    measure: Callable[[Evidence], Finding]


def judged(
    good: bool | np.bool_, number: str, note: str = "", *, best: Grade = Grade.HOLDS
) -> Finding:
    """Return a finding with the best possible verdict, or the verdict that it does not hold.

    Args:
        good: Whether the number bears it out.
        number: The figure.
        note: Further remarks.
        best: The grade that it then gets.
    """
    return Finding(number, best if good else Grade.FAILS, note)


def length(metres: float) -> str:
    """Describe a length difference in words; round-off counts as none."""
    return "0 m" if metres == 0 else f"{metres:.0e} m"
