"""Faults of an emulated bus: packets that are lost, late or garbled, and servos that fail."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from phasmid.errors import InvalidInput, nearest

PACKET_FAULTS = {"lost": "0.01", "garbled": "0.01", "late": "0.01 by 50 ms"}
"""Faults of packets, with an example of their amounts."""

SERVO_FAULTS = ("dead", "hot", "overload", "phantom", "answers")

PHANTOMS = 0.2
"""Share of answers with random data of a servo with phantom values."""

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


class FaultSource:
    """The faults of an emulated bus, and their random numbers.

    Args:
        texts: Sentences, see `parse_fault`; times count from the start.
        seed: Of the random numbers.

    Attributes:
        time: Time since the start [s], which decides what is active.
    """

    def __init__(self, texts: Sequence[str] = (), seed: int = 0) -> None:
        self.time = 0.0
        self._faults = [parse_fault(text) for text in texts]
        self._random = np.random.default_rng(seed)
        self._ids: Sequence[int] = ()

    def __bool__(self) -> bool:
        """Return whether there are any."""
        return bool(self._faults)

    def check(self, ids: Sequence[int]) -> None:
        """Refuse faults of servos that are not there, also of faults that are added.

        Raises:
            InvalidInput: A fault names another id.
        """
        self._ids = ids
        for fault in self._faults:
            if fault.id >= 0 and fault.id not in ids:
                known = ", ".join(map(str, ids))
                raise InvalidInput(f"there is no servo {fault.id}; there are {known}.")

    def add(self, text: str, now: float) -> None:
        """Add a fault, whose time counts from a time [s]."""
        fault = parse_fault(text)
        self._faults.append(replace(fault, at=fault.at + now))
        self.check(self._ids)

    def active(self) -> list[Fault]:
        """Return the active faults."""
        return [fault for fault in self._faults if fault.is_active(self.time)]

    def happens(self, kind: str) -> Fault | None:
        """Return the fault of packets that happens to the present one, or None."""
        for fault in self.active():
            if fault.kind == kind and self._random.random() < fault.rate:
                return fault
        return None

    def strikes(self, kind: str, id_: int) -> bool:
        """Return whether a servo has a fault."""
        return bool(self._faults) and any(
            fault.kind == kind and fault.id == id_ for fault in self.active()
        )

    def own_id(self, id_: int) -> int:
        """Return the id with which a servo answers."""
        other = next((f for f in self.active() if f.kind == "answers" and f.id == id_), None)
        return id_ if other is None else int(other.amount)

    def phantom(self, id_: int, data: bytes) -> bytes:
        """Return data of a servo, or random bytes."""
        if data and self.strikes("phantom", id_) and self._random.random() < PHANTOMS:
            return self._random.bytes(len(data))
        return data

    def garbled(self, packet: bytes) -> bytes:
        """Return a packet with one bit turned."""
        damaged = bytearray(packet)
        damaged[self._random.integers(len(packet))] ^= 1 << int(self._random.integers(8))
        return bytes(damaged)
