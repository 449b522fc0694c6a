"""A row: what an experiment measured, beside a law's value and a tolerance."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Row:
    """A measured number and the law's.

    Attributes:
        case: Quantity within its check.
        got: Measured value.
        tolerance: Largest difference from `expected`; None where the row is only reported.
        why: Source of the tolerance, a sentence.
        unit: Of all numbers.
        expected: By the closed form, the law or the independent calculation.
    """

    case: str
    got: float
    tolerance: float | None
    why: str
    unit: str = "1"
    expected: float = 0.0

    @property
    def holds(self):
        """Whether the number is finite and within its tolerance."""
        if self.tolerance is None:
            return math.isfinite(self.got)
        return abs(self.got - self.expected) <= self.tolerance


def row(case, got, tolerance, why, unit="1", expected=0.0):
    """Return a row; of an array of deviations the largest size counts."""
    size = float(np.abs(got).max() if np.ndim(got) else got)
    return Row(case, size, tolerance, why, unit, float(expected))


def samples(count, case):
    """Return a row with a count of samples; NaN, which fails, where there were none."""
    why = "A count of samples: the largest value of an empty set proves nothing."
    return row(case, count or math.nan, None, why)
