"""The gait of a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from phasmid.gait import Gait, check_gait_name, is_gait_file, read_gait
from phasmid.robot.table import MOST_LEGS
from phasmid.tables import Number, Table


class GaitTable(Table):
    """``gait = "wave"``, a gait file, or a table of its own numbers.

    Attributes:
        name: A gait of the library, a gait file, or any name where offsets are given.
        duty_factor: Fraction of the cycle for which each foot stands.
        offsets: For each leg the fraction of the cycle at which it lifts, in the legs' order, or
            by the legs' names.
        sway: How far the body sways away from lifted feet, as a share of their distance from the
            middle of all feet; absent: as the gait of the library does, or not at all.
    """

    name: str = "tripod"
    duty_factor: Number | None = None
    offsets: (
        Annotated[tuple[Number, ...], Field(max_length=MOST_LEGS)]
        | Annotated[dict[str, Number], Field(max_length=MOST_LEGS)]
        | None
    ) = None
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
            return _fields(raw, tuple(float(offset) for offset in raw.offsets))
        if isinstance(raw, str | Path):
            raw = {"name": str(raw)}
        if isinstance(raw, Mapping) and raw.get("offsets") is None:
            name = raw.get("name")
            if isinstance(name, str) and is_gait_file(name):
                # The scenario carries the numbers, and repeats without the file.
                gait, legs = read_gait(Path(name))
                offsets = tuple(float(offset) for offset in gait.offsets)
                by_leg = dict(zip(legs, offsets, strict=True)) if legs else offsets
                given = {k: v for k, v in raw.items() if k != "name" and v is not None}
                return _fields(gait, by_leg) | given
        return raw


def _fields(gait: Gait, offsets: tuple[float, ...] | dict[str, float]) -> dict[str, Any]:
    fields = {"name": gait.name, "duty_factor": gait.duty_factor, "offsets": offsets}
    return fields | ({"sway": gait.sway} if gait.sway else {})
