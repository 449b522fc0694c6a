"""Gait files: duty factor and offsets of a gait, in TOML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

from annotated_types import Ge, Le, MinLen
from pydantic import Field

from phasmid.errors import InvalidGait, located, nearest
from phasmid.gait.gait import Gait
from phasmid.robot.table import MOST_LEGS
from phasmid.tables import Count, Hint, Number, Table, in_file, validate
from phasmid.toml import line_of, read_toml

Phases = Annotated[tuple[Number, ...], MinLen(1), Field(max_length=MOST_LEGS)]
PhasesByLeg = Annotated[dict[str, Number], MinLen(1), Field(max_length=MOST_LEGS)]


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
    duty_factor: Number
    offsets: Phases | PhasesByLeg
    sway: Number = 0.0


def is_gait_file(source: object) -> bool:
    """Return whether this is the path of a gait file, and not the name of a gait."""
    return isinstance(source, Path) or (isinstance(source, str) and source.endswith(".toml"))


def read_gait(path: Path) -> tuple[Gait, tuple[str, ...]]:
    """Read a gait file.

    Args:
        path: A ``.toml`` file.

    Returns:
        The gait, its offsets in the order of the file, and the names of the legs in that order;
        no names where the file has none.

    Raises:
        InvalidInput: It is absent, too large, or not well formed.
        InvalidGait: A number is out of range, or too few feet stand.
    """
    raw, content = read_toml(path)
    with located(path.name):
        table = validate(GaitFile, raw, in_file(path, content))
    if isinstance(table.offsets, Mapping):
        legs, offsets = tuple(table.offsets), tuple(table.offsets.values())
    else:
        legs, offsets = (), table.offsets
    try:
        gait = Gait(table.name or path.stem, table.duty_factor, offsets, table.sway)
    except InvalidGait as error:
        key = next((k for k in ("duty_factor", "sway") if f"gait.{k} " in error.what), "offsets")
        error.where = f"{path.name}, line {line_of(content, (key,))[0]}"
        raise
    return gait, legs


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
