"""Gait files: which legs stand, when, in a file of its own."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from annotated_types import Ge, Le
from pydantic import Field

from phasmid.errors import InvalidGait, located, nearest
from phasmid.gait.forms import gait_of_phases, gait_of_steps
from phasmid.gait.gait import Gait
from phasmid.robot.table import MOST_LEGS
from phasmid.tables import Count, Hint, Number, Table, in_file, validate
from phasmid.toml import line_of, read_toml

MOST_PARTS = 100_000
"""Most parts of a cycle."""

Phases = Annotated[tuple[Number, ...], Field(max_length=MOST_LEGS)]
PhasesByLeg = Annotated[dict[str, Number], Field(max_length=MOST_LEGS)]
Parts = Annotated[Count, Ge(1), Le(MOST_PARTS)]
Part = Annotated[Count, Ge(-MOST_PARTS), Le(MOST_PARTS)]
PartOfLegs = Annotated[tuple[Part, ...], Field(max_length=MOST_LEGS)]
PartByLeg = Annotated[dict[str, Part], Field(max_length=MOST_LEGS)]

FORMS = {
    "offsets": ("duty_factor", "offsets"),
    "multipliers": ("stance", "swing", "offset", "multipliers"),
    "start_steps": ("steps", "lifted", "divisor", "start_steps"),
}
"""The three ways to write a gait, by the key that only this one has, and their keys."""


class GaitFile(Table):
    """A gait in a file of its own, in one of three forms.

    Attributes:
        format: Version of this table.
        name: Short name; absent: the file's.
        description: What it is for.
        sway: How far the body sways away from lifted feet, as a share of their distance from the
            middle of all feet.
        duty_factor: Fraction of the cycle for which each foot stands.
        offsets: For each leg the fraction of the cycle at which it lifts, in the legs' order, or
            by the legs' names.
        stance: Parts of the cycle in which a foot stands.
        swing: Parts of the cycle in which it is in the air.
        offset: Parts of the cycle that a multiplier counts.
        multipliers: Of each leg, in the legs' order or by their names.
        steps: Steps of the cycle.
        lifted: Places of a foot above the ground.
        divisor: Steps in which a foot pushes, each by this part of the stroke.
        start_steps: Of each leg, in the legs' order or by their names.
    """

    format: Annotated[Count, Ge(1), Le(1), Hint("upgrade phasmid for newer files")] = 1
    name: str = ""
    description: str = ""
    sway: Number = 0.0
    duty_factor: Number | None = None
    offsets: Phases | PhasesByLeg | None = None
    stance: Parts | None = None
    swing: Parts | None = None
    offset: Parts | None = None
    multipliers: PartOfLegs | PartByLeg | None = None
    steps: Parts | None = None
    lifted: Parts | None = None
    divisor: Parts | None = None
    start_steps: PartOfLegs | PartByLeg | None = None


class GaitTold(NamedTuple):
    """A gait as a file tells it, which may name legs of a robot that is not known yet.

    Attributes:
        gait: The gait, its offsets in the order of the file.
        legs: Names of the legs in that order; none where the file goes by the legs' order.
    """

    gait: Gait
    legs: tuple[str, ...]

    def of_legs(self, names: Sequence[str]) -> Gait:
        """The gait of a robot with legs of these names.

        Raises:
            InvalidGait: The file names other legs.
        """
        if not self.legs:
            return self.gait
        by_leg = dict(zip(self.legs, self.gait.offsets, strict=True))
        offsets = offsets_in_order(by_leg, names)
        return Gait(self.gait.name, self.gait.duty_factor, offsets, self.gait.sway)


def is_gait_file(source: object) -> bool:
    """Whether this names a file, and not a gait of the library."""
    return isinstance(source, Path) or (isinstance(source, str) and source.endswith(".toml"))


def read_gait(path: Path) -> GaitTold:
    """A gait from a file.

    Args:
        path: A ``.toml`` file.

    Raises:
        InvalidInput: It is absent, too large, or not well formed.
        InvalidGait: No robot could walk so.
    """
    raw, content = read_toml(path)
    # A gait copied out of a scenario comes with its heading.
    inner = raw.get("gait")
    if isinstance(inner, dict) and len(raw) == 1:
        raw = inner
    with located(path.name):
        table = validate(GaitFile, raw, in_file(path, content))
    given = {key for keys in FORMS.values() for key in keys if getattr(table, key) is not None}
    form = _form(given, path)
    for key in FORMS[form]:
        if key not in given:
            raise InvalidGait(
                f"gait.{key} is missing; a gait by {form} has "
                f"{', '.join(k for k in FORMS[form] if k != form)} too.",
                where=path.name,
                hint=f"{key} = ...",
            )
    written = getattr(table, form)
    numbers = tuple(written.values()) if isinstance(written, Mapping) else written
    if not numbers:
        raise InvalidGait(f"gait.{form} is empty; it must have a value per leg.", where=path.name)
    try:
        gait = _gait(table, form, table.name or path.stem, numbers)
    except InvalidGait as error:
        # The field of which it speaks, or the times of the legs.
        named = re.match(r"gait\.(\w+)", error.what)
        line = line_of(content, (named[1],))[0] if named else 0
        line = line or line_of(content, (form,))[0]
        error.where = f"{path.name}, line {line}" if line else path.name
        raise
    return GaitTold(gait, tuple(written) if isinstance(written, Mapping) else ())


def _form(given: set[str], path: Path) -> str:
    """The form of which there are keys."""
    forms = [form for form, keys in FORMS.items() if given & set(keys)]
    if not forms:
        raise InvalidGait(
            "a gait file tells when each leg lifts; this one does not.",
            where=path.name,
            hint="duty_factor = 0.5 and offsets = [0, 0.5, 0, 0.5, 0, 0.5]",
        )
    if len(forms) > 1:
        first, second = (next(k for k in FORMS[form] if k in given) for form in forms[:2])
        raise InvalidGait(
            f'"{first}" and "{second}" are two ways to write a gait; one must go.',
            where=path.name,
        )
    return forms[0]


def _gait(table: GaitFile, form: str, name: str, numbers: tuple[Any, ...]) -> Gait:
    told = {key: getattr(table, key) for key in FORMS[form] if key != form}
    if form == "offsets":
        return Gait(name, told["duty_factor"], numbers, table.sway)
    if form == "multipliers":
        return gait_of_phases(name, **told, multipliers=numbers, sway=table.sway)
    return gait_of_steps(name, **told, starts=numbers, sway=table.sway)


def offsets_in_order(by_leg: Mapping[str, float], names: Sequence[str]) -> tuple[float, ...]:
    """Offsets in the order of a robot's legs.

    Args:
        by_leg: Offsets by the legs' names.
        names: Names of the robot's legs, in their order.

    Raises:
        InvalidGait: A leg has none, or there is one of no leg.
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
    """The gait in a file, of a robot's legs.

    Args:
        path: A ``.toml`` file.
        leg_count: Number of the robot's legs; None: as many as the file tells of.
        leg_names: Their names, in their order, for a file that goes by them.

    Raises:
        InvalidInput: It is absent, too large, or not well formed.
        InvalidGait: No robot could walk so, or it is one of other legs.
    """
    told = read_gait(path)
    with located(path.name):
        if told.legs and not leg_names:
            raise InvalidGait(
                "gait.offsets go by the names of legs; the robot's are not known here.",
                hint="leg_names=[leg.name for leg in robot.legs]",
            )
        gait = told.of_legs(leg_names)
        if leg_count is not None and len(gait.offsets) != leg_count:
            raise InvalidGait(
                f"gait.offsets has {len(gait.offsets)} values; one per leg, {leg_count} in all."
            )
    return gait
