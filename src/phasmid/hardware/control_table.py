"""Control tables of servo models: registers with addresses, limits and units.

The data is in ``control_tables.toml``. The bus and the emulator use these tables.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from phasmid.errors import InvalidInput, nearest
from phasmid.toml import read_toml

SCALES = {"scale": 1.0, "scale_deg": math.radians(1), "scale_rpm": math.tau / 60}
"""SI value of a unit's scale, by its key."""

SIGN = 1 << 10
"""Bit of a direction in speeds and loads of the AX and MX series."""


@dataclass(frozen=True)
class Register:
    """Register of a control table.

    Attributes:
        name: Name, the same for all families where the meaning is the same.
        address: Address of its first byte.
        size: Number of bytes, least significant first.
        writable: Whether it can be written.
        initial: Value at power-on (RAM) or from the factory (EEPROM).
        low: Lowest value that can be written.
        high: Highest value that can be written.
        signed: Whether it is in two's complement.
        sign_bit: Whether bit 10 is its direction.
        scale: SI value of one unit.
        zero: Register value at SI value 0.
        limits: Registers that limit it: lowest and highest, or the largest amount.
    """

    name: str
    address: int
    size: int
    writable: bool = True
    initial: int = 0
    low: int = 0
    high: int = 0
    signed: bool = False
    sign_bit: bool = False
    scale: float = 1.0
    zero: int = 0
    limits: tuple[str, ...] = ()

    @property
    def end(self) -> int:
        """Address after its last byte."""
        return self.address + self.size

    def to_bytes(self, value: int) -> bytes:
        """Return the bytes of a register value."""
        if self.sign_bit and value < 0:
            value = SIGN - value
        return (value % (1 << 8 * self.size)).to_bytes(self.size, "little")

    def from_bytes(self, data: bytes | bytearray) -> int:
        """Return the register value of its bytes."""
        value = int.from_bytes(data, "little", signed=self.signed)
        if self.sign_bit and value & SIGN:
            value = -(value & (SIGN - 1))
        return value

    def to_si(self, value: int) -> float:
        """Return the SI value of a register value."""
        return (value - self.zero) * self.scale

    def from_si(self, value: float) -> int:
        """Return the register value nearest to an SI value."""
        return round(value / self.scale) + self.zero


@dataclass(frozen=True)
class Model:
    """Servo model: its protocol and control table.

    Attributes:
        name: Maker's name.
        number: Model number, which a ping returns or a read of register 0.
        family: ``AX``, ``MX`` or ``X``.
        protocol: Version of the protocol, 1 or 2.
        reads: Fastest read of several servos: ``single``, ``bulk`` or ``sync``.
        ram: First address of the RAM.
        size: Number of addresses.
        registers: Registers by name, in the order of addresses.
        moves_as: Servo of phasmid with the nearest motion.
        baud_divisor: Baud rate times (register + 1); 0: `baud_rates` counts.
        baud_rates: Baud rates by register value.
    """

    name: str
    number: int
    family: str
    protocol: int
    reads: Literal["single", "bulk", "sync"]
    ram: int
    size: int
    registers: Mapping[str, Register]
    moves_as: str
    baud_divisor: int = 0
    baud_rates: tuple[int, ...] = ()

    def register(self, name: str) -> Register:
        """Return a register.

        Raises:
            InvalidInput: The model has no such register.
        """
        try:
            return self.registers[name]
        except KeyError:
            guess = nearest(name, self.registers)
            raise InvalidInput(
                f'the {self.name} has no register "{name}".', hint=f'"{guess}"' if guess else ""
            ) from None

    def baud_of(self, value: int) -> float:
        """Return the baud rate of a value of the register ``baud_rate`` [1/s]."""
        if self.baud_divisor:
            return self.baud_divisor / (value + 1)
        return self.baud_rates[value]

    def baud_value(self, baud: float) -> int:
        """Return the value of the register ``baud_rate`` for a baud rate.

        Raises:
            InvalidInput: No value gives this rate within 3 %, the tolerance of the line.
        """
        register = self.register("baud_rate")
        known = {v: self.baud_of(v) for v in range(register.low, register.high + 1)}
        value = min(known, key=lambda v: abs(known[v] - baud))
        if abs(known[value] - baud) > 0.03 * baud:
            raise InvalidInput(
                f"the {self.name} has no baud rate of {baud:g}.", hint=f"{known[value]:.0f}"
            )
        return value


@cache
def models() -> Mapping[str, Model]:
    """Return all models by name."""
    path = Path(str(resources.files("phasmid.hardware") / "control_tables.toml"))
    content = read_toml(path)[0]
    return {
        name: _model(name, row, content["families"][row["family"]])
        for name, row in content["models"].items()
    }


def model(name: str) -> Model:
    """Return the model of a name.

    Raises:
        InvalidInput: There is no such model.
    """
    known = models()
    if name not in known:
        guess = nearest(name, known)
        hint = f'"{guess}"' if guess else f"one of {', '.join(known)}"
        raise InvalidInput(f'no control table of a servo called "{name}".', hint=hint)
    return known[name]


def model_of_number(number: int) -> Model | None:
    """Return the model of a model number, or None."""
    return next((one for one in models().values() if one.number == number), None)


def _model(name: str, row: Mapping[str, Any], family: Mapping[str, Any]) -> Model:
    """Return a model from its row and its family's table."""
    rows = {**family["registers"], **row.get("registers", {})}
    initial = {"model_number": row["number"], **row.get("initial", {})}
    ranges = row.get("range", {})
    registers = {
        key: _register(key, entry, family["units"], initial.get(key), ranges.get(key))
        for key, entry in rows.items()
    }
    return Model(
        name=name,
        number=row["number"],
        family=row["family"],
        protocol=family["protocol"],
        reads=family["reads"],
        ram=family["ram"],
        size=family["size"],
        registers=dict(sorted(registers.items(), key=lambda item: item[1].address)),
        moves_as=row["moves_as"],
        baud_divisor=family.get("baud_divisor", 0),
        baud_rates=tuple(family.get("baud_rates", ())),
    )


def _register(
    name: str,
    entry: Mapping[str, Any],
    units: Mapping[str, Mapping[str, float]],
    initial: int | None,
    bounds: list[int] | None,
) -> Register:
    """Return a register from its row, with a model's own initial value and range."""
    unit = units[entry["unit"]] if "unit" in entry else {}
    low, high = bounds or entry.get("range", [0, 0])
    return Register(
        name=name,
        address=entry["at"],
        size=entry["size"],
        writable=entry.get("access", "rw") == "rw",
        initial=entry.get("initial", 0) if initial is None else initial,
        low=low,
        high=high,
        signed=entry.get("signed", False),
        sign_bit=entry.get("sign_bit", False),
        scale=next((unit[key] * SI for key, SI in SCALES.items() if key in unit), 1.0),
        zero=int(unit.get("zero", 0)),
        limits=tuple(entry.get("limits", ())),
    )
