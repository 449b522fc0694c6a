"""Servos as tables: those of the catalogue, and those of robot files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import model_validator

from phasmid.errors import InvalidInput, nearest
from phasmid.servo.rules import RULES, UNKNOWN, complete_servo
from phasmid.servo.servo import LAW_FIELDS, KnownNumbers, Servo
from phasmid.tables import Name, in_si
from phasmid.toml import read_toml, toml_key, toml_lines, toml_value


class ServoTable(KnownNumbers):
    """``servo = "AX-12A"``, or a table of data-sheet numbers: the fields of `Servo`.

    Attributes:
        sources: Names of the numbers that have a source, by the source.
    """

    name: Name
    sources: dict[str, list[str]] = {}

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, raw: Any) -> Any:
        if not isinstance(raw, str):
            return raw
        return {"name": raw} | _catalogue_entry(known_servos()[known_name(raw)])

    def servo(self) -> Servo:
        """Build the servo; rules give the numbers that are absent.

        Raises:
            InvalidRobot: No servo can have these numbers.
        """
        stated = {name: source for source, names in self.sources.items() for name in names}
        return complete_servo(self.model_dump(exclude={"sources"}), stated)


def _catalogue_entry(groups: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return a servo of ``catalogue.toml`` as a table ``[servo]`` with sources."""
    numbers: dict[str, Any] = {}
    sources: dict[str, list[str]] = {}
    for status, group in groups.items():
        own = {key: value for key, value in group.items() if key != "source"}
        statement = status.replace("_", " ")
        if "source" in group:
            statement += f" ({group['source']})"
        sources[statement] = list(in_si(KnownNumbers, own))
        numbers |= own
    return numbers | {"sources": sources}


@cache
def known_servos() -> dict[str, Any]:
    """Return the tables of ``catalogue.toml``: by servo and by the kind of source."""
    return read_toml(Path(str(resources.files("phasmid.servo") / "catalogue.toml")))[0]


def known_name(name: str) -> str:
    """Return the name of a servo of the catalogue.

    Raises:
        InvalidInput: There is no such servo.
    """
    known = servo_names()
    if name not in known:
        guess = nearest(name, known)
        raise InvalidInput(
            f'no servo called "{name}".',
            hint=f'"{guess}"' if guess else f"one of {', '.join(known)}",
        )
    return name


def servo_names() -> tuple[str, ...]:
    """Return the names of the known servos."""
    return tuple(known_servos())


def load_servo(name: str) -> Servo:
    """Return a servo by its name, one of `servo_names`.

    Raises:
        InvalidInput: There is no such servo.
    """
    servo: Servo = ServoTable.model_validate(name).servo()
    return servo


def servo_table(servo: Servo) -> list[str]:
    """Return a servo as the lines of a table ``[servo]``, with exact numbers and their sources."""
    other_laws = {n for law, names in LAW_FIELDS.items() if law != servo.law for n in names}
    written = set(RULES) - other_laws | set(servo.sources)
    default = {field.name: field.default for field in fields(servo)}
    values = {
        key: value
        for key, value in servo.numbers.items()
        if key in written or value != default.get(key)
    }
    sources = dict(servo.sources)
    if servo.stall_current is None:
        # Else a rule would give one.
        sources["stall_current"] = UNKNOWN
    by_source: dict[str, list[str]] = {}
    for name, source in sorted(sources.items()):
        by_source.setdefault(source, []).append(name)
    return [
        "[servo]",
        *toml_lines({key: v for key, v in values.items() if v is not None}),
        "",
        "[servo.sources]",
        *(f"{toml_key(source)} = {toml_value(names)}" for source, names in by_source.items()),
    ]
