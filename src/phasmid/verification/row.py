"""Checks, and the rows of the table that they give."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from phasmid.errors import PhasmidError
from phasmid.verification.laboratory import Laboratory


class Verdict(Enum):
    """Verdict of a row; the value is printed in the table."""

    PASSES = "passes"
    FAILS = "FAILS"
    REPORTED = "reported"


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the table.

    Attributes:
        number: Of the check.
        title: Subject of the check.
        equation: The law that must hold.
        case: Which of the check's numbers it is.
        expected: By the closed form, the law or the independent calculation.
        got: Measured value; not finite where it could not be measured.
        tolerance: Largest difference that passes; None where the row is only reported.
        unit: Of all three.
        why: Where the tolerance comes from, a sentence.
        seconds: Time that the whole check took [s].
    """

    number: int = 0
    title: str = ""
    equation: str = ""
    case: str
    expected: float
    got: float
    tolerance: float | None
    unit: str
    why: str
    seconds: float = 0.0

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


def reading(
    case: str,
    got: ArrayLike,
    tolerance: float | None,
    why: str,
    unit: str = "1",
    expected: float = 0.0,
) -> Row:
    """Return a row of a check; of an array of deviations the largest size counts."""
    return Row(
        case=case,
        expected=float(expected),
        got=float(np.abs(got).max() if np.ndim(got) else got),  # type: ignore[arg-type]
        tolerance=None if tolerance is None else float(tolerance),
        unit=unit,
        why=why,
    )


def seen(count: int, case: str) -> Row:
    """Return the number of samples of a largest value; NaN, which fails, where there were none."""
    why = "A count of samples: the largest value of an empty set proves nothing."
    return reading(case, count or math.nan, None, why)


@dataclass(frozen=True)
class Check:
    """One law and its experiments.

    Attributes:
        number: By which users name it.
        title: Subject of the check.
        equation: The law that must hold.
        measure: Makes the experiments.
    """

    number: int
    title: str
    equation: str
    measure: Callable[[Laboratory], Iterator[Row]]

    def rows(self, laboratory: Laboratory) -> list[Row]:
        """Measure; an experiment that phasmid refuses or cannot end is a row that fails."""
        start = time.perf_counter()
        try:
            rows = list(self.measure(laboratory))
        except PhasmidError as error:
            rows = [reading("could not be measured", math.nan, 0.0, error.what)]
        spent = time.perf_counter() - start
        own = {"number": self.number, "title": self.title, "equation": self.equation}
        return [replace(row, **own, seconds=spent) for row in rows]  # type: ignore[arg-type]
