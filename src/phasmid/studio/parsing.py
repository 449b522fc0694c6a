"""What a browser says, held against what can be said: JSON in, typed requests out."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable
from typing import Any, NamedTuple

from phasmid.errors import InvalidInput, nearest, plain
from phasmid.studio.messages import (
    Bench,
    Change,
    Keep,
    Limb,
    Load,
    Pace,
    Play,
    Push,
    Record,
    Request,
    Stick,
)
from phasmid.studio.strict import Misunderstood, read_json, short

LONGEST_TEXT = 1000
"""Characters of a text that is no file."""

LARGEST_ID = 2**53
"""Whole numbers up to here are the same in a browser."""


def read_request(text: str | bytes) -> tuple[int | None, Request]:
    """Read a message of a browser.

    Args:
        text: JSON, a table with ``do``, ``id`` and the fields of that request.

    Returns:
        Its number, None where it has none, and the request.

    Raises:
        Misunderstood: It is none.
    """
    if isinstance(text, bytes):
        raise Misunderstood(400, "the message is bytes; it must be text.")
    table = read_json(text)
    if not isinstance(table, dict):
        raise Misunderstood(400, f"the message is {kind_of(table)}; it must be a table.")
    try:
        number = _number(table)
    except InvalidInput as error:
        raise Misunderstood(422, error.what) from None
    try:
        return number, _request(table)
    except Misunderstood as error:
        error.id = number
        raise
    except InvalidInput as error:
        raise Misunderstood(422, error.what, id=number, hint=error.hint) from None


def kind_of(value: Any) -> str:
    """What a value of JSON is, in words."""
    if isinstance(value, bool):
        return str(value).lower()
    names = {dict: "a table", list: "a list", str: "text", int: "a number", float: "a number"}
    return names.get(type(value), "null")


Reader = Callable[[str, Any], Any]


def _wrong(path: str, value: Any, must: str) -> InvalidInput:
    return InvalidInput(f"{path} is {kind_of(value)}; it must be {must}.")


def number(path: str, value: Any) -> float:
    """A number; true is none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(path, value, "a number")
    return float(value)


def whole(path: str, value: Any) -> int:
    """A whole number from 1."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(path, value, "a whole number")
    if not 1 <= value <= LARGEST_ID or value != int(value):
        raise InvalidInput(f"{path} is {value:g}; it must be a whole number 1 or more.")
    return int(value)


def three(path: str, value: Any) -> tuple[float, float, float]:
    """A list of three numbers."""
    if not isinstance(value, list):
        raise _wrong(path, value, "a list of 3 numbers")
    if len(value) != 3:
        count = f"{len(value)} value{'' if len(value) == 1 else 's'}"
        raise InvalidInput(f"{path} has {count}; it must have 3.")
    a, b, c = (number(f"{path}[{i}]", part) for i, part in enumerate(value))
    return (a, b, c)


def three_or_none(path: str, value: Any) -> tuple[float, float, float] | None:
    """A list of three numbers, or nothing."""
    return None if value is None else three(path, value)


def shares(path: str, value: Any) -> tuple[float, float, float]:
    """Three numbers that are brought within -1 and 1."""
    a, b, c = (min(1.0, max(-1.0, part)) for part in three(path, value))
    return (a, b, c)


def truth(path: str, value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool):
        raise _wrong(path, value, "true or false")
    return value


def text(path: str, value: Any) -> str:
    """A short text that can be written to a file."""
    if not isinstance(value, str):
        raise _wrong(path, value, "text")
    if len(value) > LONGEST_TEXT:
        what = f"{path} has {len(value)} characters; the limit is {LONGEST_TEXT}."
        raise InvalidInput(what)
    try:
        value.encode()
    except UnicodeEncodeError:
        raise InvalidInput(f"{path} holds half a character.") from None
    return value


def scalar(path: str, value: Any) -> float | str | bool:
    """A number, a text, or true or false."""
    if isinstance(value, bool):
        return value
    if isinstance(value, str):
        return text(path, value)
    if not isinstance(value, int | float):
        raise _wrong(path, value, "a number, text, true or false")
    return float(value)


def file_name(path: str, value: Any) -> str:
    """The name of a file by itself, without folders."""
    name = text(path, value)
    if not name or len(name) > 120 or name != plain(name) or name in (".", ".."):
        raise InvalidInput(f'{path} is "{short(name)}"; it must be the name of a file.')
    if any(mark in name for mark in "/\\:"):
        raise InvalidInput(f'{path} is "{short(name)}"; it must be a name without folders.')
    return name


def base64_bytes(path: str, value: Any) -> bytes:
    """Bytes, written in base64."""
    if not isinstance(value, str):
        raise _wrong(path, value, "bytes in base64")
    try:
        return base64.b64decode(value.encode("ascii"), validate=True)
    except (binascii.Error, UnicodeEncodeError):
        raise InvalidInput(f"{path} is no base64.") from None


def one_of(*words: str) -> Reader:
    """One of these words."""

    def read(path: str, value: Any) -> str:
        if not isinstance(value, str):
            raise _wrong(path, value, f"one of {', '.join(words)}")
        if value not in words:
            guess = nearest(value, words)
            raise InvalidInput(
                f'{path} is "{short(value)}"; it must be one of {", ".join(words)}.', hint=guess
            )
        return value

    return read


class Form(NamedTuple):
    """What a request looks like: its type, how its fields are read, which may be left out."""

    kind: type[Any]
    fields: dict[str, Reader]
    optional: frozenset[str] = frozenset()


FORMS: dict[str, Form] = {
    "stick": Form(Stick, {"at": shares}),
    "change": Form(Change, {"name": text, "value": scalar}),
    "play": Form(Play, {"how": one_of("play", "pause", "step", "reset")}),
    "pace": Form(Pace, {"factor": number}),
    "push": Form(Push, {"impulse": three}),
    "limb": Form(Limb, {"leg": whole, "how": one_of("lose", "restore", "limp")}),
    "record": Form(Record, {"on": truth}),
    "keep": Form(Keep, {"what": one_of("scenario", "link")}),
    "load": Form(
        Load,
        {
            "what": one_of("setting", "scenario", "robot", "terrain"),
            "name": file_name,
            "content": base64_bytes,
        },
    ),
    "bench": Form(
        Bench,
        {"leg": whole, "angles": three_or_none, "foot": three_or_none, "force": three},
        frozenset(("angles", "foot", "force")),
    ),
}


def _number(table: dict[str, Any]) -> int | None:
    """The message's number; only a stick, which is told all the time, may have none."""
    value = table.get("id")
    if value is None and table.get("do") == "stick":
        return None
    if isinstance(value, bool) or not isinstance(value, int):
        given = kind_of(value) if "id" in table else "missing"
        raise InvalidInput(f"id is {given}; it must be a whole number.")
    if not 0 <= value <= LARGEST_ID:
        raise InvalidInput(f"id is {value}; it must be 0 to {LARGEST_ID}.")
    return value


def _request(table: dict[str, Any]) -> Request:
    do = table.get("do")
    if not isinstance(do, str):
        given = kind_of(do) if "do" in table else "missing"
        raise InvalidInput(f"do is {given}; it must be one of {', '.join(FORMS)}.")
    if do not in FORMS:
        guess = nearest(do, FORMS)
        raise Misunderstood(400, f'no command "{short(do)}".', hint=guess or ", ".join(FORMS))
    form = FORMS[do]
    for key in table:
        if key not in form.fields and key not in ("id", "do"):
            guess = nearest(key, form.fields) or ", ".join(form.fields)
            raise Misunderstood(400, f'unknown key "{short(key)}" in "{do}".', hint=guess)
    for key in form.fields:
        if key not in table and key not in form.optional:
            raise InvalidInput(f'{key} is missing; "{do}" needs it.')
    read = {key: reader(key, table[key]) for key, reader in form.fields.items() if key in table}
    request: Request = form.kind(**read)
    return request
