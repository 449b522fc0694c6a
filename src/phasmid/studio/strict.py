"""JSON as the standard has it, from whoever sends it."""

from __future__ import annotations

import json
import math
import re
from typing import Any

from phasmid.errors import InvalidInput, plain

DEEPEST = 8
"""How many lists and tables may stand in one another."""

MOST_MARKS = 4000
"""How many texts and brackets a message may have: more than any setting takes."""

LONGEST_NUMBER = 400
"""Characters of a number; the largest that is finite has 309 digits."""

# A text without an end reaches to the message's end, so that it is looked for only once.
MARKS = re.compile(r'"[^"\\]*+(?:\\.[^"\\]*+)*+"?|[\[\]{}]', re.DOTALL)


class Misunderstood(InvalidInput):
    """A message that is no request.

    Attributes:
        status: 400 where it cannot be read, 422 where a field is not what it must be.
        id: Of the message, where it could be read.
    """

    def __init__(self, status: int, what: str, *, id: int | None = None, hint: str = "") -> None:
        super().__init__(what, hint=hint)
        self.status = status
        self.id = id


def read_json(text: str, noun: str = "message") -> Any:
    """Read JSON as the standard has it: no key twice, no number that is none, not too deep.

    Args:
        text: From a browser or from a link.
        noun: What it is called.

    Raises:
        Misunderstood: With status 400, naming the line or the key.
    """
    depth = 0
    for count, mark in enumerate(MARKS.finditer(text), 1):
        depth += {"[": 1, "{": 1, "]": -1, "}": -1}.get(mark[0], 0)
        if depth > DEEPEST:
            line = 1 + text.count("\n", 0, mark.start())
            what = f"{noun} line {line}: more than {DEEPEST} lists and tables in one another."
            raise Misunderstood(400, what)
        if count > MOST_MARKS:
            raise Misunderstood(400, f"the {noun} has more than {MOST_MARKS} texts and brackets.")
    try:
        return json.loads(
            text,
            object_pairs_hook=_table,
            parse_float=_finite,
            parse_int=_whole,
            parse_constant=_finite,
        )
    except json.JSONDecodeError as error:
        reason = f"{error.msg[:1].lower()}{error.msg[1:]}"
        what = f"{noun} line {error.lineno}, column {error.colno}: {reason}."
        raise Misunderstood(400, what) from None
    except RecursionError:
        raise Misunderstood(400, f"the {noun} is too deep.") from None


def _table(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for key, value in pairs:
        if key in table:
            raise Misunderstood(400, f'key "{short(key)}" is given twice.')
        table[key] = value
    return table


def _finite(text: str) -> float:
    number = float(text) if len(text) <= LONGEST_NUMBER else math.inf
    if not math.isfinite(number):
        raise Misunderstood(400, f"{short(text)} is no finite number.")
    return number


def _whole(text: str) -> int | float:
    # Python reads whole numbers of any length, and takes its time.
    return int(text) if len(text) <= 18 else _finite(text)


def short(text: str) -> str:
    """A text that somebody else wrote, fit for a sentence."""
    return plain(text if len(text) <= 40 else f"{text[:40]}…")
