"""Options of a command as a table, and numbers within bounds."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from phasmid.errors import InvalidInput, plain


@dataclass(frozen=True)
class Number:
    """Option that is a number within bounds.

    Attributes:
        help: Description.
        least: Smallest number.
        most: Largest number.
        default: Number without the option.
        is_whole: True for whole numbers.
        hint: Value to try.
    """

    help: str
    least: float
    most: float
    default: float | None = None
    is_whole: bool = False
    hint: str = ""

    def convert(self, flag: str, text: str) -> float | int:
        """Return the number of a text.

        Raises:
            InvalidInput: It is no such number.
        """
        try:
            value = int(text) if self.is_whole else float(text)
        except ValueError:
            value = math.nan
        if not self.least <= value <= self.most:
            kind = "a whole number" if self.is_whole else "a number"
            raise InvalidInput(
                f'{flag} is "{plain(text)}"; it must be {kind} from {self.least:g} to '
                f"{self.most:g}.",
                hint=f"{flag} {self.hint}" if self.hint else "",
            )
        return value


def declare(
    parser: argparse._ActionsContainer, options: Mapping[str, str | tuple[str, str] | Number]
) -> None:
    """Add options to the parser of a command.

    Args:
        parser: The parser, or a group of its options.
        options: Help, help with a default, or a number, by flag and placeholder. A flag without
            a placeholder is a switch; a placeholder alone is an argument, in brackets an optional
            one.
    """
    for name, kind in options.items():
        flag, _, placeholder = name.partition(" ")
        settings: dict[str, Any] = {}
        if isinstance(kind, Number):
            settings = {"type": partial(kind.convert, flag), "default": kind.default}
            words = kind.help
        elif isinstance(kind, tuple):
            words, settings["default"] = kind
        else:
            words = kind
        if not flag.startswith("-"):
            settings |= {"nargs": "?"} if flag.startswith("[") else {}
            placeholder = flag.strip("[]")
            flag = placeholder.lower()
        if placeholder:
            settings["metavar"] = placeholder
        else:
            settings["action"] = "store_true"
        parser.add_argument(flag, help=words, **settings)


def whole_numbers(flag: str, text: str, what: str, hint: str) -> list[int]:
    """Return the whole numbers of an option, which have commas between."""
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() and part.isascii() and len(part) < 10 for part in parts):
        raise InvalidInput(
            f'{flag} is "{plain(text)}"; it must be {what} with commas between.',
            hint=f"{flag} {hint}",
        )
    return [int(part) for part in parts]


def refuse_given(options: argparse.Namespace, keys: Iterable[str], reason: str) -> None:
    """Refuse options without effect.

    Args:
        options: Those of the command line; absent ones are None, empty or False.
        keys: Names of the options, such as ``live_host``.
        reason: Why they have no effect, such as ``needs --live``.

    Raises:
        InvalidInput: One of them is given.
    """
    for key in keys:
        value = vars(options)[key]
        if value is not None and value is not False and value != []:
            flag = f"--{key.replace('_', '-')}"
            raise InvalidInput(f"{flag} {reason}.", hint=f"without {flag}")
