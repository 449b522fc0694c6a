"""Options that are one number within bounds."""

from __future__ import annotations

import math

from phasmid.errors import InvalidInput, plain


def number_within(
    flag: str, text: str | None, least: float, most: float, *, hint: str = ""
) -> float | None:
    """Return the number of an option; None without the option.

    Args:
        flag: The option.
        text: Its value.
        least: Smallest number.
        most: Largest number.
        hint: What to try.

    Raises:
        InvalidInput: It is no number within these bounds.
    """
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        what = f'{flag} is "{plain(text)}"; it must be a number from {least:g} to {most:g}.'
        raise InvalidInput(what, hint=hint)
    return value
