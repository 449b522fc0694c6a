"""Faults of an emulated bus: packets that are lost, late or garbled, and servos that fail."""

from __future__ import annotations

import re
from dataclasses import dataclass

from phasmid.errors import InvalidInput, nearest

PACKET_FAULTS = {"lost": "0.01", "garbled": "0.01", "late": "0.01 by 50 ms"}
"""Faults of packets, with an example of their amounts."""

SERVO_FAULTS = ("dead", "hot", "overload", "phantom", "answers")

NUMBER = r"\d+(?:\.\d+)?"
TIMES = rf"(?: at (?P<at>{NUMBER}) ?s)?(?: for (?P<duration>{NUMBER}) ?s)?"
SENTENCES = (
    re.compile(rf"(?P<kind>lost|garbled) (?P<rate>{NUMBER}){TIMES}"),
    re.compile(rf"(?P<kind>late) (?P<rate>{NUMBER})(?: by (?P<ms>{NUMBER}) ?ms)?{TIMES}"),
    re.compile(rf"(?P<id>\d+) (?P<kind>dead|hot|overload|phantom){TIMES}"),
    re.compile(rf"(?P<id>\d+) (?P<kind>answers) as (?P<other>\d+){TIMES}"),
    re.compile(rf"(?P<kind>brown-out)(?: to (?P<volt>{NUMBER}) ?V)?{TIMES}"),
)
EXAMPLES = '"lost 0.01", "late 0.01 by 50 ms", "5 dead at 3 s" or "brown-out at 3 s for 0.5 s"'


@dataclass(frozen=True)
class Fault:
    """A fault of the bus.

    Attributes:
        kind: ``lost``, ``garbled``, ``late``, ``brown-out``; of a servo ``dead`` (limp and
            silent), ``hot`` (above its temperature limit), ``overload`` (latched), ``phantom``
            (one answer in five has random data), ``answers`` (with another id).
        at: When it begins [s].
        duration: How long it lasts [s].
        id: The servo.
        rate: Share of packets.
        amount: Delay of late packets [s]; supply during a brown-out [V]; id in the answers.
    """

    kind: str
    at: float = 0.0
    duration: float = float("inf")
    id: int = -1
    rate: float = 1.0
    amount: float = 0.0

    def is_active(self, time: float) -> bool:
        """Return whether it acts at a time [s]."""
        return self.at <= time < self.at + self.duration


def parse_fault(text: str) -> Fault:
    """Parse a sentence.

    Args:
        text: Such as ``lost 0.01``, ``garbled 0.01 at 2 s``, ``late 0.01 by 50 ms``,
            ``5 dead at 3 s``, ``5 hot``, ``5 overload``, ``5 phantom for 2 s``, ``5 answers as 6``
            or ``brown-out to 5 V at 3 s for 0.5 s``.

    Raises:
        InvalidInput: It is no such sentence.
    """
    found = next((m for m in (s.fullmatch(text.strip()) for s in SENTENCES) if m), None)
    if found is None:
        words = text.split()
        known = [*PACKET_FAULTS, *SERVO_FAULTS, "brown-out"]
        guess = next((g for g in (nearest(w, known) for w in words) if g and g not in words), "")
        raise InvalidInput(
            f'"{text}" is no fault of a bus; it must be such as {EXAMPLES}.',
            hint=f'"{guess}"' if guess else "",
        )
    parts = found.groupdict()
    rate = float(parts.get("rate") or 1.0)
    if not 0 <= rate <= 1:
        raise InvalidInput(f'the share of packets in "{text}" is {rate:g}; it must be 0 to 1.')
    amounts = {
        "late": float(parts.get("ms") or 50) / 1000,
        "brown-out": float(parts.get("volt") or 5),
        "answers": float(parts.get("other") or 0),
    }
    kind, duration = parts["kind"], parts["duration"]
    return Fault(
        kind=kind,
        at=float(parts["at"] or 0),
        duration=float(duration) if duration else float("inf"),
        id=int(parts.get("id") or -1),
        rate=rate,
        amount=amounts.get(kind, 0.0),
    )
