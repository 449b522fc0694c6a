"""Answer of a servo verdict: its numbers, and the sentences that every command shows."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

from phasmid.servo.words import servo_label

GOOD = 1.25
"""Least margin without help from the floor that counts as good: a quarter is left for motion, a
sagging battery and wear."""

OVER_FULL = 1.05
"""Supply over the highest voltage of the data sheet up to which it is no error: three full cells
have 12.6 V, and makers name them for servos of 12 V."""

DEADLY = 150.0
"""Temperature above which estimates are not printed [°C]: windings and gears are destroyed."""


class Holding(Enum):
    """Answer of a servo verdict."""

    HOLDS = "HOLDS"
    LIMITED = "HOLDS FOR A LIMITED TIME"
    NEEDS_FRICTION = "HOLDS ONLY WITH FRICTION"
    TOO_SLOW = "TOO SLOW"
    DOES_NOT_HOLD = "DOES NOT HOLD"
    NOT_STABLE = "NOT STABLE"

    @property
    def is_possible(self) -> bool:
        """The robot can walk in this way, with the help of this floor or without."""
        return self not in (Holding.TOO_SLOW, Holding.DOES_NOT_HOLD, Holding.NOT_STABLE)


class Grade(Enum):
    """What the least margin means.

    Good: at least `GOOD` without help from the floor. No: below 1 with its best help, or the robot
    cannot walk so. Tight: in between; floor and cooling decide.
    """

    GOOD = "good"
    TIGHT = "tight"
    NO = "no"


@dataclass(frozen=True)
class ServoVerdict:
    """Answer and numbers of a servo verdict.

    Pairs are bounds: without help from the floor, then with its best help.

    Attributes:
        holding: The answer.
        servo: Name of the servo.
        interface: How it is commanded, as of `Servo`; None: not known.
        gait: Name of the gait.
        joint: Joint with the largest share of its stall torque without help, such as
            ``right_middle.femur``.
        feet: Numbers of the legs that carry then, from 1; of a robot that is not stable, those of
            its least stable posture.
        torque: Torque of that joint without help [N·m]; NaN where no posture is stable.
        stall_torque: Its stall torque at the supply [N·m].
        peak_share: Largest share of a joint's stall torque.
        least_friction: Least coefficient of friction with which no joint exceeds its stall torque:
            0: none is needed; infinite: none is enough.
        floor_friction: Coefficient of friction of the floor.
        rms_torque: Largest torque of a joint as rms over the cycle, or in the stance [N·m].
        continuous_torque: Continuous torque of the servo [N·m].
        voltage: Supply voltage [V].
        highest_voltage: Highest supply voltage of the data sheet [V].
        ambient_temperature: Temperature of the air [°C].
        temperature_limit: Temperature limit of the servo [°C].
        hour_temperature: Temperature of the warmest servo after an hour of walking or standing:
            highest and lowest estimate [°C]; None where the servo's current is unknown.
        time_to_limit: Time to the temperature limit: soonest and latest [s], infinite where it is
            never reached; None likewise.
        margins: Allowed over needed, by name, as bounds: ``peak``, ``heat``, or ``continuous``
            where that is unknown, and ``speed``, absent where the legs have no room for the walk.
        sources: Numbers of the servo behind the verdict, by the kind of their source: ``data
            sheet``, ``identified``, ``assumed``, ``robot file``, ``scenario`` or ``unknown``.
    """

    holding: Holding
    servo: str
    interface: str | None
    gait: str
    joint: str
    feet: tuple[int, ...]
    torque: float
    stall_torque: float
    peak_share: tuple[float, float]
    least_friction: float
    floor_friction: float
    rms_torque: tuple[float, float]
    continuous_torque: float
    voltage: float
    highest_voltage: float
    ambient_temperature: float
    temperature_limit: float
    hour_temperature: tuple[float, float] | None
    time_to_limit: tuple[float, float] | None
    margins: dict[str, tuple[float, float]]
    sources: dict[str, tuple[str, ...]]

    @property
    def margin(self) -> tuple[float, float]:
        """Least margin; NaN where there is none."""
        low, high = zip(*self.margins.values(), strict=True) if self.margins else ([], [])
        return min(low, default=math.nan), min(high, default=math.nan)

    @property
    def deciding(self) -> str:
        """Name of the least margin; empty where there is none."""
        return min(self.margins, key=lambda name: self.margins[name], default="")

    @property
    def grade(self) -> Grade:
        """What the least margin means."""
        low, high = self.margin
        if high < 1 or not self.holding.is_possible or self.is_supply_too_high:
            return Grade.NO
        return Grade.GOOD if low >= GOOD else Grade.TIGHT

    @property
    def speed_share(self) -> float:
        """Largest share of a joint's no-load speed on the planned walk; NaN without a walk."""
        return 1 / self.margins["speed"][0] if "speed" in self.margins else math.nan

    @property
    def is_supply_too_high(self) -> bool:
        """The supply is above what the data sheet allows, and what a full battery exceeds it by."""
        return self.voltage > OVER_FULL * self.highest_voltage

    @property
    def answer(self) -> str:
        """The answer in a few words, with the least margin and its grade."""
        words = f"{self.holding.value}; margin {margin_words(self.margin)}, {self.grade.value}"
        return f"{words}; the supply is too high" if self.is_supply_too_high else words

    @property
    def lines(self) -> tuple[str, ...]:
        """Sentences that every command shows, the answer first."""
        reason = self._reason()
        if self.holding.is_possible and "speed" not in self.margins:
            reason += " The legs have no room for this stride: judged in steps on the spot."
        lines = [reason]
        if self.voltage > self.highest_voltage:
            lines.append(
                f"WARNING: the supply of {self.voltage:g} V is above the {self.highest_voltage:g} "
                f"V of the {servo_label(self.servo)}; its data sheet promises no more torque "
                "there, and it may burn."
            )
        if self.holding is not Holding.NOT_STABLE:
            lines += [self._margin_line(), self._heat_line()]
        return (*lines, self._source_line())

    def as_dict(self) -> dict[str, Any]:
        """Return all numbers and `lines` for JSON; infinite and unknown numbers are None."""
        found = asdict(self) | {
            "holding": self.holding.value,
            "grade": self.grade.value,
            "answer": self.answer,
            "margin": self.margin,
            "least_margin": self.margin[0],
            "deciding": self.deciding,
            "speed_share": self.speed_share,
            "lines": list(self.lines),
        }
        return {name: _plain(value) for name, value in found.items()}

    def _reason(self) -> str:
        """Return the answer with what decides it."""
        feet, word, floor = ", ".join(map(str, self.feet)), self.holding.value, self.floor_friction
        if self.holding is Holding.NOT_STABLE:
            return (
                f"{word}: while legs {feet} stand in the {self.gait} gait, the centre of mass is "
                "not between their feet."
            )
        without, best = (f"{100 * share:.0f} %" for share in self.peak_share)
        need = (
            f"{self.joint} needs {self.torque:.3g} N·m on feet {feet} of the {self.gait} gait, "
            f"{without} of stall without help from the floor, {best} with its best help."
        )
        least = f"{math.ceil(100 * min(self.least_friction, 99)) / 100:g}"
        if self.holding is Holding.TOO_SLOW:
            share = f"{100 * self.speed_share:.0f} %"
            return f"{word}: the walk needs {share} of a servo's no-load speed. {need}"
        if self.holding is Holding.NEEDS_FRICTION:
            is_hot = self.time_to_limit is not None and math.isfinite(self.time_to_limit[0])
            time = ", and perhaps for a limited time" if is_hot else ""
            return f"{word} of {least} or more{time}; the floor has {floor:g}: {need}"
        if math.isinf(self.least_friction):
            return f"{word} on any floor: {need}"
        if self.least_friction > floor:
            return f"{word} on this floor, whose friction is {floor:g} and not {least}: {need}"
        if self.holding is Holding.DOES_NOT_HOLD:
            return f"{word} in air of {self.ambient_temperature:g} °C. {need}"
        return f"{word}: {need}"

    def _margin_line(self) -> str:
        """Return the least margin, what decides it, and the others."""
        others = ", ".join(
            f"{name} {margin_words(pair)}"
            for name, pair in self.margins.items()
            if name != self.deciding
        )
        limit = f" (at least {GOOD:g})" if self.grade is Grade.GOOD else ""
        if self.grade is Grade.TIGHT:
            limit = " (below 1 without help)" if self.margin[0] < 1 else f" ({GOOD:g} is good)"
        return (
            f"Margin {margin_words(self.margin)}, {self.grade.value}{limit}: "
            f"{self.deciding} decides; {others}."
        )

    def _heat_line(self) -> str:
        """Return the range of heat as temperature after an hour and as time to the limit."""
        limit, air = self.temperature_limit, self.ambient_temperature
        if air >= limit:
            label = servo_label(self.servo)
            return f"Heat: the air is not below the limit of {limit:g} °C of the {label}."
        if self.hour_temperature is None or self.time_to_limit is None:
            return "Heat: unknown, since the servo has no stall current."
        hot, cool = map(_degrees, self.hour_temperature)
        soonest, latest = self.time_to_limit
        at_last = "never" if math.isinf(latest) else f"after {_duration(latest)}"
        line = (
            f"Heat in air of {air:g} °C: {cool} (best help, cooled by the frame) to {hot} °C (no "
            f"help, uncooled) after an hour; the limit of {limit:g} °C "
        )
        if math.isinf(soonest):
            return f"{line}is never reached."
        line += f"after {_duration(soonest)} (no help) or {at_last} (best help)."
        end = {"pwm": " Nothing stops this servo there: it wears out or burns.", None: ""}
        return line + end.get(self.interface, " The servo then shuts down.")

    def _source_line(self) -> str:
        """Return supply, torques, and where the numbers come from."""
        servo = servo_label(self.servo)
        subject = self.servo if servo == self.servo else servo.capitalize()
        low, high = (f"{torque:.2g}" for torque in self.rms_torque[::-1])
        rms = "" if self.holding is Holding.NOT_STABLE else f", rms of the walk {low} to {high} N·m"
        named = {kind: ", ".join(names) for kind, names in self.sources.items()}
        if len(named) > 1 and named.pop("data sheet", ""):
            named["data sheet"] = "the rest"
        sources = "; ".join(f"{kind}: {names}" for kind, names in named.items())
        return (
            f"{subject} at {self.voltage:g} V: stall {self.stall_torque:.3g} N·m, continuous "
            f"{self.continuous_torque:.3g} N·m{rms}. Static loads on level ground. "
            f"{sources.capitalize()}."
        )


def margin_words(pair: tuple[float, float]) -> str:
    """Return a margin as bounds, such as ``0.51 to 1.2``."""
    low, high = (f"{round(m, 3):.2g}" if m < 9.95 else "10 or more" for m in pair)
    return low if low == high else f"{low} to {high}"


def degrees_words(hot_cool: tuple[float, float]) -> str:
    """Return a range of temperatures, such as ``26 to 44 °C``."""
    hot, cool = map(_degrees, hot_cool)
    return f"{hot} °C" if hot == cool else f"{cool} to {hot} °C"


def _degrees(temperature: float) -> str:
    return f"{temperature:.0f}" if temperature <= DEADLY else f"over {DEADLY:g}"


def _duration(seconds: float) -> str:
    """Return a time in seconds, minutes or hours, such as ``12 min``."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 100 * 60 else f"{seconds / 3600:.1f} h"


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
