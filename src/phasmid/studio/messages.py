"""Messages of a browser: JSON in, one of ten validated requests out."""

from __future__ import annotations

import base64
import binascii
import re
from typing import Annotated, Any, Literal, TypeAlias

import pydantic_core
from pydantic import BeforeValidator, Field, Strict, StringConstraints

from phasmid.errors import InvalidInput, nearest
from phasmid.tables import Count, Number, Table, speaking

LARGEST = 10_000_000
"""Bytes of the largest message, which loads a file."""

LARGEST_COMMAND = 10_000
"""Bytes of the largest message without the content of a file."""

CONTENT = re.compile(rb'"content"\s*:\s*"')
"""Beginning of a file's content in a message; base64 has no quotation marks."""

Text = Annotated[str, StringConstraints(max_length=1000)]
Flag = Annotated[bool, Strict()]
Vector = tuple[Number, Number, Number]
Angle = Annotated[Number, Field(ge=-6.2832, le=6.2832)]
Coordinate = Annotated[Number, Field(ge=-10, le=10)]
Force = Annotated[Number, Field(ge=-1000, le=1000)]
LegNumber = Annotated[Count, Field(ge=1)]


def _decode(content: Any) -> Any:
    """Decode base64; bytes pass."""
    try:
        return base64.b64decode(content, validate=True) if isinstance(content, str) else content
    except (binascii.Error, ValueError):
        raise InvalidInput("content must be bytes in base64.") from None


class Request(Table):
    """Fields of every message, whose key ``do`` has the name of its class.

    Attributes:
        id: Number that the reply repeats; a message without one is answered only if refused.
    """

    id: Annotated[Count, Field(ge=0, le=2**53)] | None = None


class Stick(Request):
    """Velocity command; it expires after half a second.

    Attributes:
        at: Shares of the largest velocity forward, to the left and in yaw, each -1 to 1.
    """

    at: Vector


class Change(Request):
    """Change one field of the setting.

    Attributes:
        name: Name of the field.
        value: Number in the field's unit, word or flag.
    """

    name: Text
    value: Number | Flag | Text


class Play(Request):
    """Start or stop time; ``step`` makes one update, ``reset`` returns the robot to its start."""

    how: Literal["play", "pause", "step", "reset"]


class Pace(Request):
    """Set the ratio of simulated time to real time."""

    factor: Annotated[Number, Field(ge=0.05, le=10)]


class Push(Request):
    """Push the trunk once.

    Attributes:
        impulse: In body axes [N·s].
    """

    impulse: Vector


class Limb(Request):
    """Change the use of a leg.

    Attributes:
        leg: Number of the leg, from 1.
        how: ``lose`` takes it out of the gait and lifts it; ``restore`` takes it back; ``limp``
            disables its servos until the robot is reset.
    """

    leg: LegNumber
    how: Literal["lose", "restore", "limp"]


class Record(Request):
    """Start recording, or stop and write the folder of the run with its report."""

    on: Flag


class Keep(Request):
    """Return the setting as a scenario file."""


class Load(Request):
    """Load a file.

    Attributes:
        name: File name, whose ending gives the format.
        content: Bytes of the file; base64 in JSON.
    """

    what: Literal["scenario", "terrain"]
    name: Annotated[str, StringConstraints(max_length=120)]
    content: Annotated[bytes, BeforeValidator(_decode)] = Field(repr=False)


class Bench(Request):
    """Evaluate the paper's equations for one leg in one pose.

    Attributes:
        leg: Number of the leg, from 1.
        angles: Joint angles [rad].
        foot: Foot position in the hip frame, instead of the angles [m].
        force: Force of the ground on the foot in the hip frame [N].
    """

    leg: LegNumber
    angles: tuple[Angle, Angle, Angle] | None = None
    foot: tuple[Coordinate, Coordinate, Coordinate] | None = None
    force: tuple[Force, Force, Force] = (0.0, 0.0, 0.0)


Answer: TypeAlias = dict[str, Any]
"""Content of a reply, for JSON; empty for a plain acknowledgement."""

KINDS: dict[str, type[Request]] = {
    kind.__name__.lower(): kind
    for kind in (Stick, Change, Play, Pace, Push, Limb, Record, Keep, Load, Bench)
}


class InvalidMessage(InvalidInput):
    """Text that is no message.

    Attributes:
        id: Number of the message, where it is readable.
        status: Status of the reply, as of HTTP.
    """

    def __init__(
        self, what: str, *, hint: str = "", id: int | None = None, status: int = 422
    ) -> None:
        super().__init__(what, hint=hint)
        self.id, self.status = id, status


def read_request(text: str | bytes) -> Request:
    """Validate a message.

    Args:
        text: JSON.

    Raises:
        InvalidMessage: It is too large, no JSON, or no message; the sentence names the field.
    """
    message, content = _without_content(text.encode() if isinstance(text, str) else text)
    try:
        raw = pydantic_core.from_json(message)
    except ValueError as error:
        raise InvalidMessage(f"the message is no JSON: {error}.") from None
    if not isinstance(raw, dict):
        raise InvalidMessage("the message must be a table.")
    if content and raw.get("content") == "":
        raw["content"] = content
    number, do = raw.get("id"), raw.pop("do", None)
    try:
        if not isinstance(do, str) or do not in KINDS:
            guess = nearest(do, KINDS) if isinstance(do, str) else ""
            raise InvalidInput(f"do must be one of {', '.join(KINDS)}.", hint=guess)
        with speaking(KINDS[do], raw):
            return KINDS[do].model_validate(raw)
    except InvalidInput as error:
        number = number if isinstance(number, int) and not isinstance(number, bool) else None
        raise InvalidMessage(error.what, hint=error.hint, id=number) from None


def _without_content(message: bytes) -> tuple[bytes, str]:
    """Return a large message without the content of its file, and that content.

    JSON of many keys would take seconds to refuse; content is one text.

    Raises:
        InvalidMessage: The message is too large.
    """
    size, content = len(message), ""
    if size > LARGEST:
        what = f"message is {size / 1e6:.1f} MB; the limit is {LARGEST / 1e6:.0f} MB."
        raise InvalidMessage(what, status=413)
    if size > LARGEST_COMMAND and (begin := CONTENT.search(message, 0, LARGEST_COMMAND)):
        end = message.find(b'"', begin.end())
        content = message[begin.end() : end].decode("latin-1")
        message = message[: begin.end()] + message[end:]
    if len(message) > LARGEST_COMMAND:
        raise InvalidMessage(
            f"message is {size / 1e3:.0f} kB; the limit is {LARGEST_COMMAND / 1e3:.0f} kB, except "
            "for the content of a file.",
            status=413,
        )
    return message, content
