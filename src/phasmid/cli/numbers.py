"""Numbers within bounds, as types of options."""

from __future__ import annotations

import math
from collections.abc import Callable

from phasmid.errors import InvalidInput, plain


def number(flag: str, least: float, most: float, hint: str = "") -> Callable[[str], float]:
    """Return the type of an option that is a number within bounds.

    Args:
        flag: The option.
        least: Smallest number.
        most: Largest number.
        hint: What to try.
    """

    def convert(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not least <= value <= most:
            what = f'{flag} is "{plain(text)}"; it must be a number from {least:g} to {most:g}.'
            raise InvalidInput(what, hint=hint)
        return value

    return convert


def whole_number(flag: str, least: int, most: int, hint: str = "") -> Callable[[str], int]:
    """Return the type of an option that is a whole number within bounds; arguments as above."""

    def convert(text: str) -> int:
        if not (text.isdecimal() and text.isascii() and least <= int(text[:10]) <= most):
            what = f'{flag} is "{plain(text)}"; it must be a whole number from {least} to {most}.'
            raise InvalidInput(what, hint=hint)
        return int(text)

    return convert


def whole_numbers(flag: str, text: str, what: str, hint: str) -> list[int]:
    """Return the whole numbers of an option, which have commas between."""
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() and part.isascii() and len(part) < 10 for part in parts):
        raise InvalidInput(
            f'{flag} is "{plain(text)}"; it must be {what} with commas between.',
            hint=f"{flag} {hint}",
        )
    return [int(part) for part in parts]
