"""Which legs stand, when, as a scenario says it."""

from __future__ import annotations

from typing import Any

from pydantic import model_validator

from phasmid.gait import Gait, check_gait_name
from phasmid.tables import Number, Table


class GaitTable(Table):
    """``gait = "wave"``, or a table of its own numbers.

    Attributes:
        name: A gait of the library, or any name where offsets are given.
        duty_factor: Fraction of the cycle for which each foot stands.
        offsets: For each leg the fraction of the cycle at which it lifts.
        sway: How far the body sways away from lifted feet, as a share of their distance from the
            middle of all feet; absent: as the gait of the library does, or not at all.
    """

    name: str = "tripod"
    duty_factor: Number | None = None
    offsets: tuple[Number, ...] | None = None
    sway: Number | None = None

    @model_validator(mode="after")
    def _check_name(self) -> GaitTable:
        if self.offsets is None:
            check_gait_name(self.name)
        return self

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, raw: Any) -> Any:
        if isinstance(raw, Gait):
            offsets = tuple(float(offset) for offset in raw.offsets)
            told = {"name": raw.name, "duty_factor": raw.duty_factor, "offsets": offsets}
            return told | ({"sway": raw.sway} if raw.sway else {})
        return {"name": raw} if isinstance(raw, str) else raw
