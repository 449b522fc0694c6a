"""One thing to set of the live robot: how it is told, and changed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from phasmid.arguments import described
from phasmid.errors import InvalidInput, nearest
from phasmid.studio.setting import Setting
from phasmid.units import UNITS

Value: TypeAlias = float | str | bool
"""A number in the field's unit, a word, or whether something is so."""

Span: TypeAlias = tuple[float, float, float]
"""Least and most of a range, and the step of its slider, SI."""

ROUNDING = 9
"""Digits after the point of a number that is told."""


@dataclass(frozen=True)
class Field:
    """One thing to set.

    Attributes:
        name: By which it is asked for.
        label: What people call it.
        group: Of fields that belong together.
        help: One sentence.
        read: Its value in a setting, SI.
        write: The setting with another value of it.
        unit: Of `UNITS`, in which people know it; none of a number alone or of words.
        span: Of a range, in a setting.
        choices: Of a choice in a setting: values and what people call them.
        shown: Whether it means anything in a setting.
    """

    name: str
    label: str
    group: str
    help: str
    read: Callable[[Setting], Value]
    write: Callable[[Setting, Any], Setting]
    unit: str = ""
    span: Callable[[Setting], Span] | None = None
    choices: Callable[[Setting], dict[str, str]] | None = None
    shown: Callable[[Setting], bool] = lambda _: True

    def value(self, setting: Setting) -> Value:
        """Its value as people know it."""
        value = self.read(setting)
        if self.span is None:
            return value
        number = UNITS[self.unit].from_si(float(value)) if self.unit else float(value)
        return round(number, ROUNDING)

    def told(self, setting: Setting) -> dict[str, Any]:
        """What a page is told of it."""
        told: dict[str, Any] = {"name": self.name, "label": self.label, "group": self.group}
        told |= {"help": self.help, "unit": UNITS[self.unit].symbol if self.unit else ""}
        if self.span is not None:
            least, most, step = (
                round(UNITS[self.unit].from_si(x) if self.unit else x, ROUNDING)
                for x in self.span(setting)
            )
            now = float(self.value(setting))
            return told | {
                "kind": "range",
                "least": min(least, now),
                "most": max(most, now),
                "step": step,
            }
        if self.choices is not None:
            choices = [{"value": v, "label": text} for v, text in self.choices(setting).items()]
            return told | {"kind": "choice", "choices": choices}
        return told | {"kind": "switch"}

    def changed(self, setting: Setting, value: object) -> Setting:
        """The setting with another value of this field.

        Args:
            setting: The present one.
            value: As people know it.

        Raises:
            InvalidInput: It is none for this field, or does not go with the rest.
        """
        what = f"{self.label.lower()} is {described(value)}"
        if self.span is not None:
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise InvalidInput(f"{what}; it must be a number.")
            if not math.isfinite(value):
                raise InvalidInput(f"{what}; it must be a finite number.")
            number = UNITS[self.unit].to_si(value) if self.unit else float(value)
            # The package's own words go first: they know more than a slider's ends.
            made = self.write(setting, number)
            told = self.told(setting)
            if not told["least"] <= value <= told["most"]:
                unit = f" {told['unit']}" if told["unit"] else ""
                raise InvalidInput(
                    f"{self.label.lower()} is {value:g}{unit}; it must be at least "
                    f"{told['least']:g} and at most {told['most']:g}{unit}."
                )
            return made
        if self.choices is not None:
            known = self.choices(setting)
            if not isinstance(value, str) or value not in known:
                guess = nearest(str(value), known)
                raise InvalidInput(
                    f"{what}; it must be one of {', '.join(known)}.",
                    hint=f'"{guess}"' if guess else "",
                )
        elif not isinstance(value, bool):
            raise InvalidInput(f"{what}; it must be true or false.")
        return self.write(setting, value)
