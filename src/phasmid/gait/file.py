"""Gait files: duty factor and offsets of a gait, in TOML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, NamedTuple

from annotated_types import Ge, Le
from pydantic import Field

from phasmid.errors import InvalidGait, located, nearest
from phasmid.gait.gait import Gait
from phasmid.robot.table import MOST_LEGS
from phasmid.tables import Count, Hint, Number, Table, in_file, validate
from phasmid.toml import line_of, read_toml

Phases = Annotated[tuple[Number, ...], Field(max_length=MOST_LEGS)]
PhasesByLeg = Annotated[dict[str, Number], Field(max_length=MOST_LEGS)]


class GaitFile(Table):
    """A gait in a file.

    Attributes:
        format: Version of this table.
        name: Short name; absent: the file's.
        description: For readers.
        duty_factor: Fraction of the cycle for which each foot stands.
        offsets: Fraction of the cycle at which each leg lifts, in the order of the legs or by
            their names.
        sway: Sway of the body away from lifted feet, as `Gait` has it.
    """

    format: Annotated[Count, Ge(1), Le(1), Hint("upgrade phasmid for newer files")] = 1
    name: str = ""
    description: str = ""
    duty_factor: Number | None = None
    offsets: Phases | PhasesByLeg | None = None
    sway: Number = 0.0


class NamedGait(NamedTuple):
    """A gait of a file, whose offsets may be given by the names of legs.

    Attributes:
        gait: The gait, its offsets in the order of the file.
        legs: Names of the legs in that order; empty where the file has none.
    """

    gait: Gait
    legs: tuple[str, ...]


def is_gait_file(source: object) -> bool:
    """Return whether this is the path of a gait file, and not the name of a gait."""
    return isinstance(source, Path) or (isinstance(source, str) and source.endswith(".toml"))


def read_gait(path: Path) -> NamedGait:
    """Read a gait file.

    Args:
        path: A ``.toml`` file.

    Raises:
        InvalidInput: It is absent, too large, or not well formed.
        InvalidGait: A number is out of range, or too few feet stand.
    """
    raw, content = read_toml(path)
    # A gait that is copied out of a scenario has its heading.
    inner = raw.get("gait")
    if isinstance(inner, dict) and len(raw) == 1:
        raw = inner
    with located(path.name):
        table = validate(GaitFile, raw, in_file(path, content))
    written, duty_factor = table.offsets, table.duty_factor
    if written is None or duty_factor is None:
        missing = "offsets" if written is None else "duty_factor"
        raise InvalidGait(
            f"gait.{missing} is missing; a gait file has duty_factor and offsets.",
            where=path.name,
            hint="duty_factor = 0.5 and offsets = [0, 0.5, 0, 0.5, 0, 0.5]",
        )
    if not written:
        raise InvalidGait("gait.offsets is empty; it must have a value per leg.", where=path.name)
    offsets = tuple(written.values()) if isinstance(written, Mapping) else written
    try:
        gait = Gait(table.name or path.stem, duty_factor, offsets, table.sway)
    except InvalidGait as error:
        key = next((k for k in ("duty_factor", "sway") if f"gait.{k} " in error.what), "offsets")
        error.where = f"{path.name}, line {line_of(content, (key,))[0]}"
        raise
    return NamedGait(gait, tuple(written) if isinstance(written, Mapping) else ())


def offsets_in_order(by_leg: Mapping[str, float], names: Sequence[str]) -> tuple[float, ...]:
    """Return offsets in the order of a robot's legs.

    Args:
        by_leg: Offsets by the names of the legs.
        names: Names of the robot's legs in order.

    Raises:
        InvalidGait: A leg has no offset, or an offset no leg.
    """
    for name in by_leg:
        if name not in names:
            guess = nearest(name, [known for known in names if known not in by_leg])
            raise InvalidGait(
                f'gait.offsets names a leg "{name}"; the robot has none of that name.',
                hint=f'"{guess}"' if guess else f"its legs are {', '.join(names)}",
            )
    for name in names:
        if name not in by_leg:
            raise InvalidGait(
                f"gait.offsets has {len(by_leg)} values; one per leg, {len(names)} in all.",
                hint=f"{name} = ...",
            )
    return tuple(by_leg[name] for name in names)


def gait_from_file(path: Path, leg_count: int | None = None, leg_names: Sequence[str] = ()) -> Gait:
    """Return the gait in a file for a robot's legs.

    Args:
        path: A ``.toml`` file.
        leg_count: Number of the robot's legs; None: any.
        leg_names: Their names in order, for offsets by name.

    Raises:
        InvalidInput: The file is absent, too large, or not well formed.
        InvalidGait: Too few feet stand, or the file is for other legs.
    """
    gait, legs = read_gait(path)
    with located(path.name):
        if legs and not leg_names:
            raise InvalidGait(
                "gait.offsets go by the names of legs; the robot's are not known here.",
                hint="leg_names=[leg.name for leg in robot.legs]",
            )
        if legs:
            by_leg = dict(zip(legs, gait.offsets, strict=True))
            gait = replace(gait, offsets=offsets_in_order(by_leg, leg_names))
        if leg_count is not None and len(gait.offsets) != leg_count:
            raise InvalidGait(
                f"gait.offsets has {len(gait.offsets)} values; one per leg, {leg_count} in all."
            )
    return gait
