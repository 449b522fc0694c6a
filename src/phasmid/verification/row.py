"""Row of the verification table, and its verdict."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any


class Verdict(Enum):
    """Verdict of a row; the value is printed in the table."""

    PASSES = "passes"
    FAILS = "FAILS"
    REPORTED = "reported"


@dataclass(frozen=True)
class Reading:
    """Measured number beside its expected value.

    Attributes:
        got: The number; not finite where it could not be measured.
        tolerance: Largest difference that passes; None where nothing is claimed.
        why: Where the tolerance comes from, a sentence.
        expected: By the closed form, the law or the independent calculation.
        unit: Of all three numbers.
        case: Which of a check's readings it is; empty where it has one.
    """

    got: float
    tolerance: float | None
    why: str
    expected: float = 0.0
    unit: str = "1"
    case: str = ""


def seen(count: int, case: str) -> Reading:
    """Return the number of samples of a largest value; NaN, which fails, where there were none.

    Args:
        count: How often.
        case: The sampled quantity.
    """
    why = "Counted: a largest value of none at all would say nothing."
    return Reading(float(count) if count else math.nan, None, why, case=case)


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        number: Of the check.
        title: Subject of the check.
        equation: The law that must hold.
        case: Which of the check's readings it is; may be empty.
        expected: Value by the law.
        got: Measured value.
        tolerance: Largest difference that passes; None where the row is only reported.
        unit: Of all three.
        why: Where the tolerance comes from.
        seconds: Time that the whole check took [s].
    """

    number: int
    title: str
    equation: str
    case: str
    expected: float
    got: float
    tolerance: float | None
    unit: str
    why: str
    seconds: float

    @property
    def verdict(self) -> Verdict:
        """Whether it passes; a number that is not finite never does."""
        if not math.isfinite(self.got):
            return Verdict.FAILS
        if self.tolerance is None:
            return Verdict.REPORTED
        near = abs(self.got - self.expected) <= self.tolerance
        return Verdict.PASSES if near else Verdict.FAILS

    def as_dict(self) -> dict[str, Any]:
        """Return the row with its verdict for JSON; numbers that are not finite become None."""
        row = asdict(self) | {"verdict": self.verdict.name}
        return {
            key: None if isinstance(value, float) and not math.isfinite(value) else value
            for key, value in row.items()
        }
