"""Check of a law by experiments."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from phasmid.errors import PhasmidError
from phasmid.verification.laboratory import Laboratory
from phasmid.verification.row import Reading, Row

Measure = Callable[[Laboratory], Sequence[Reading]]
"""Makes a check's experiments."""


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
    measure: Measure

    def rows(self, laboratory: Laboratory) -> list[Row]:
        """Measure; an experiment that phasmid refuses or cannot end is a row that fails."""
        start = time.perf_counter()
        try:
            readings = list(self.measure(laboratory))
        except PhasmidError as error:
            readings = [Reading(math.nan, 0.0, error.what, case="could not be measured")]
        seconds = time.perf_counter() - start
        return [
            Row(
                number=self.number,
                title=self.title,
                equation=self.equation,
                case=reading.case,
                expected=float(reading.expected),
                got=float(reading.got),
                tolerance=None if reading.tolerance is None else float(reading.tolerance),
                unit=reading.unit,
                why=reading.why,
                seconds=seconds,
            )
            for reading in readings
        ]
