"""The servo bus: registers of servos by name, over the maker's library (extra ``hardware``)."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from phasmid.errors import InvalidInput, PhasmidError
from phasmid.extras import install_hint
from phasmid.hardware.control_table import Model, Register, model_of_number
from phasmid.hardware.rates import FACTORY_LATENCY, exchange_time, wire_time
from phasmid.hardware.status import StatusError, hardware_error, status_error

if TYPE_CHECKING:
    from phasmid.hardware.port import Port

BAUDS = 1_000_000, 57_600, 115_200, 2_000_000, 3_000_000, 4_000_000
"""Baud rates that a scan tries, those of the factories first."""

ANSWER_MARGIN = 10e-3
"""Time for which an answer is awaited beyond the computed one [s]: the system may be busy."""

TRIES = 3
"""How often one register is read or written until an intact answer comes."""

PING_MARGIN = 20e-3
"""The same for a ping of a scan, after which a servo counts as absent [s]."""

SILENCE, LONG_SILENCE = 3e-3, 50e-3
"""Silence after a lost answer before the next request [s], while controlling and otherwise. A late
answer would be taken for that of the next request to the same servo, if it has the same size."""

MOST_LATENCY = 8e-3
"""Latency above which the adapter's timer is not set for control [s]."""

LATENCY_READS = 20
"""Reads of which the median gives the adapter's latency."""

MONITORED = "present_position", "present_load", "present_voltage", "present_temperature"
"""Registers that `Bus.read_all` reads by default."""


class BusError(PhasmidError):
    """A servo that does not answer, or refuses an instruction."""

    exit_status = 1


class PortLost(BusError):
    """The port fails: its adapter was unplugged or hangs, or another process reads it.

    The same port, or the port opened anew, may work later.

    Args:
        path: The port.
        reason: Error of the operating system or of the library.
    """

    def __init__(self, path: str, reason: str) -> None:
        super().__init__(
            f"the port {path} fails: its adapter was unplugged, or another process reads it "
            f"({reason.strip().rstrip('.')})."
        )


class ServoReading(NamedTuple):
    """Registers of a servo in SI units, and the errors that it reported with them."""

    values: dict[str, float]
    error: StatusError


@dataclass
class Traffic:
    """Packets since the port was opened.

    Attributes:
        answers: Intact answers.
        lost: Answers that did not come.
        damaged: Answers with a wrong checksum or CRC.
    """

    answers: int = 0
    lost: int = 0
    damaged: int = 0


@dataclass
class Bus:
    """Servos on a serial port.

    Angles are in rad from the servo's middle, loads are shares of the full output, all other values
    are in SI units.

    Args:
        path: The port, such as ``/dev/ttyUSB0``.
        baud: Baud rate [1/s].
        protocol: 1 or 2.
        latency: Latency timer of the USB adapter [s]; None: that of the system, else the
            factory's. It sets how long answers are awaited.
        models: Models of servos that are known without a scan, by id.
        exclusive: Whether no other process may open the port meanwhile.

    Attributes:
        models: Models of the servos that are known, by id; `scan` adds some.
        traffic: Counters of packets.
        port: The open port.

    Raises:
        InvalidInput: The extra is not installed, or the port cannot be opened.
    """

    path: str
    baud: int = 1_000_000
    protocol: int = 1
    latency: float | None = None
    models: dict[int, Model] = field(default_factory=dict)
    exclusive: bool = True
    traffic: Traffic = field(default_factory=Traffic, init=False)

    def __post_init__(self) -> None:
        try:
            import dynamixel_sdk

            from phasmid.hardware import port
        except ModuleNotFoundError:
            raise InvalidInput(
                "the servo bus needs the extra hardware, which is not installed.",
                hint=install_hint("hardware"),
            ) from None
        self._sdk = dynamixel_sdk
        if self.latency is None:
            self.latency = usb_latency(self.path) or FACTORY_LATENCY
        self._packets: Any = dynamixel_sdk.PacketHandler(float(self.protocol))
        try:
            self.port: Port = port.Port(self.path, self.baud, exclusive=self.exclusive)
        except port.FAILURES as error:
            raise InvalidInput(port.open_error(self.path, error)) from None

    def close(self) -> None:
        """Close the port."""
        self.port.closePort()

    def __enter__(self) -> Bus:
        """Return the bus, whose port closes at the end of the block."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the port."""
        self.close()

    # Discovery -----------------------------------------------------------------------------------

    def scan(self, ids: Iterable[int] | None = None) -> dict[int, Model | int]:
        """Ping ids; return the models of those that answer, or the number of an unknown model.

        Args:
            ids: Ids, of which silent ones are pinged twice; None: all.
        """
        found: dict[int, Model | int] = {}
        for id_ in range(253) if ids is None else ids:
            number = self._ping(id_)
            if number is None and ids is not None:
                number = self._ping(id_)
            if number is not None:
                found[id_] = model_of_number(number) or number
        self.models |= {id_: m for id_, m in found.items() if isinstance(m, Model)}
        return found

    def _ping(self, id_: int) -> int | None:
        """Return the model number of a servo, or None where none answers."""
        self._await(14, margin=PING_MARGIN)
        for _ in range(2):
            try:
                number, result, _error = self._packets.ping(self.port, id_)
            except IndexError:
                # The library expects data where the servo answers that the request was damaged.
                continue
            if result == self._sdk.COMM_SUCCESS:
                return int(number)
            if result == self._sdk.COMM_RX_TIMEOUT:
                return None
        return None

    def model(self, id_: int) -> Model:
        """Return the model of a servo.

        Raises:
            BusError: It was not found by `scan`.
        """
        if id_ not in self.models and isinstance(self.scan([id_]).get(id_), int | None):
            raise BusError(
                f"no servo with the id {id_} answers on {self.path} at {self.baud} baud.",
                hint=f"phasmid bus scan {self.path}",
            )
        return self.models[id_]

    # One servo -----------------------------------------------------------------------------------

    def read(self, id_: int, name: str) -> float:
        """Return the value of a register in SI units.

        Raises:
            BusError: The servo does not answer, or refuses.
        """
        register = self.model(id_).register(name)
        return register.to_si(self.read_raw(id_, register))

    def read_raw(self, id_: int, register: Register) -> int:
        """Return the value of a register in its own unit."""
        work = f"reading {register.name}"
        block = register.address, register.size
        for tries in range(TRIES, 0, -1):
            data, result, error = self._read_block(id_, *block, silence=LONG_SILENCE)
            if self._is_intact(result, error) or tries == 1:
                break
        return register.from_bytes(self._checked(id_, data, result, error, work))

    def write(self, id_: int, name: str, value: float) -> None:
        """Write the value of a register in SI units.

        Raises:
            BusError: The servo does not answer, or refuses.
        """
        register = self.model(id_).register(name)
        self.write_raw(id_, register, register.from_si(value))

    def write_raw(self, id_: int, register: Register, value: int) -> None:
        """Write the value of a register in its own unit."""
        for tries in range(TRIES, 0, -1):
            result, error = self._write_block(id_, register, value, LONG_SILENCE)
            if self._is_intact(result, error) or tries == 1:
                break
        self._checked(id_, b"", result, error, f"writing {value} to {register.name}")

    def write_once(self, id_: int, name: str, value: float) -> bool:
        """Write the value of a register in SI units once; return whether the servo confirms it."""
        register = self.model(id_).register(name)
        result, error = self._write_block(id_, register, register.from_si(value), SILENCE)
        refused = status_error(self.protocol, error) & REFUSALS
        return result == self._sdk.COMM_SUCCESS and not refused

    def _write_block(
        self, id_: int, register: Register, value: int, silence: float
    ) -> tuple[int, int]:
        """Write a register once; return the library's result and the error byte."""
        data = list(register.to_bytes(value))
        self._await(11)
        result, error = self._packets.writeTxRx(self.port, id_, register.address, len(data), data)
        self._count(result, silence)
        return result, error

    def _is_intact(self, result: int, error: int) -> bool:
        """Return whether an answer came, and the request had arrived undamaged."""
        if result != self._sdk.COMM_SUCCESS:
            return False
        return not status_error(self.protocol, error) & StatusError.CHECKSUM

    def _read_block(
        self, id_: int, address: int, size: int, silence: float = SILENCE
    ) -> tuple[bytes, int, int]:
        """Return a part of a servo's table, the library's result and the error byte."""
        self._await(14 + 11 + size)
        data, result, error = self._packets.readTxRx(self.port, id_, address, size)
        result = self._of_size(size, data, result)
        self._count(result, silence)
        return bytes(data), result, error

    def _of_size(self, size: int, data: Sequence[int], result: int) -> int:
        """Return the result of a read; data that are too short answer an earlier request."""
        is_short = 0 < len(data) < size
        return int(self._sdk.COMM_RX_CORRUPT) if is_short else result

    def _checked(self, id_: int, data: bytes, result: int, error: int, work: str) -> bytes:
        """Return data, unless the servo did not answer or refused."""
        if result != self._sdk.COMM_SUCCESS:
            reason = self._packets.getTxRxResult(result).rpartition("] ")[2].rstrip("!.")
            raise BusError(f"servo {id_}, {work}: {reason[:1].lower()}{reason[1:]}.")
        refused = status_error(self.protocol, error) & REFUSALS
        if refused:
            raise BusError(f"servo {id_} refuses {work}: {', '.join(refused.names)}.")
        return data

    def errors(self, id_: int) -> StatusError:
        """Return the errors of a servo itself, such as an overload.

        Raises:
            BusError: It does not answer.
        """
        model = self.model(id_)
        if self.protocol == 2:
            return hardware_error(self.read_raw(id_, model.register("hardware_error_status")))
        number = model.register("model_number")
        for _ in range(TRIES):
            _data, result, error = self._read_block(
                id_, number.address, number.size, silence=LONG_SILENCE
            )
            if result == self._sdk.COMM_SUCCESS:
                return status_error(1, error)
        raise BusError(f"servo {id_} does not answer.")

    # Several servos ------------------------------------------------------------------------------

    def write_all(
        self, names: str | Sequence[str], values: Mapping[int, float | Sequence[float]]
    ) -> None:
        """Write a register, or adjacent ones, of several servos by one sync write; none answers.

        Args:
            names: Name of the register; names of adjacent registers.
            values: SI values by id: a number, or one for each name.

        Raises:
            InvalidInput: The registers are not adjacent, or lie elsewhere in one of the models.
            PortLost: The port does not take the packet.
        """
        address, size, content = self._sync_write(names, values)
        result = self._packets.syncWriteTxOnly(self.port, address, size, content, len(content))
        if result != self._sdk.COMM_SUCCESS:
            raise PortLost(self.path, self._packets.getTxRxResult(result).rpartition("] ")[2])

    def _sync_write(
        self, names: str | Sequence[str], values: Mapping[int, float | Sequence[float]]
    ) -> tuple[int, int, list[int]]:
        """Return address, size and content of a sync write."""
        names = (names,) if isinstance(names, str) else tuple(names)
        blocks = {id_: _block(self.model(id_), names) for id_ in values}
        address, size = block = next(iter(blocks.values()))
        if any(each != block for each in blocks.values()):
            where = " and ".join(names)
            raise InvalidInput(f"the servos' {where} lie at different addresses; write them apart.")
        content: list[int] = []
        for id_, value in values.items():
            registers = [self.models[id_].register(name) for name in names]
            if sum(r.size for r in registers) != size:
                raise InvalidInput(f"{' and '.join(names)} are not adjacent; write them apart.")
            numbers = zip(registers, np.atleast_1d(value), strict=True)
            data = {r.address: r.to_bytes(r.from_si(float(number))) for r, number in numbers}
            content += [id_, *b"".join(data[at] for at in sorted(data))]
        return address, size, content

    def read_all(
        self, ids: Sequence[int], names: Sequence[str] = MONITORED
    ) -> dict[int, ServoReading | None]:
        """Read registers of several servos in the fastest way of their model.

        The registers are read as one block from the first to the last: by sync read (X series),
        bulk read (MX series), or one servo after the other (AX series).

        Returns:
            Values and errors by id; None where the answer was lost or damaged.
        """
        blocks = {id_: _block(self.model(id_), names) for id_ in ids}
        ways = {self.models[id_].reads for id_ in ids}
        if ways == {"sync"} and len(set(blocks.values())) == 1:
            data = self._sync_read(ids, *next(iter(blocks.values())))
        elif ways == {"bulk"} and len(ids) > 1:
            data = self._bulk_read(blocks)
        else:
            data = {id_: self._read_block(id_, *block) for id_, block in blocks.items()}
        return {
            id_: self._reading(id_, names, blocks[id_][0], *data[id_]) if id_ in data else None
            for id_ in ids
        }

    def _sync_read(self, ids: Sequence[int], address: int, size: int) -> dict[int, Any]:
        self._await(14 + len(ids) + len(ids) * (11 + size), answers=len(ids))
        self._packets.syncReadTx(self.port, address, size, list(ids), len(ids), False)
        return self._group_answers(dict.fromkeys(ids, size))

    def _bulk_read(self, blocks: Mapping[int, tuple[int, int]]) -> dict[int, Any]:
        content = [n for id_, (address, size) in blocks.items() for n in (size, id_, address)]
        sizes = {id_: size for id_, (_, size) in blocks.items()}
        self._await(
            7 + len(content) + sum(6 + size for size in sizes.values()), answers=len(blocks)
        )
        self._packets.bulkReadTx(self.port, content, len(content))
        return self._group_answers(sizes)

    def _group_answers(self, sizes: Mapping[int, int]) -> dict[int, Any]:
        """Return data, result and error byte by id; behind a lost answer all are lost."""
        found: dict[int, Any] = {}
        # The library ends its exchange when it has received a packet.
        for id_, size in sizes.items():
            data, result, error = self._packets.readRx(self.port, id_, size)
            result = self._of_size(size, data, result)
            self._count(result)
            if result == self._sdk.COMM_RX_TIMEOUT:
                break
            found[id_] = data, result, error
        return found

    def _reading(
        self, id_: int, names: Sequence[str], address: int, data: Any, result: int, error: int
    ) -> ServoReading | None:
        if result != self._sdk.COMM_SUCCESS:
            return None
        if status_error(self.protocol, error) & REFUSALS:
            return ServoReading({}, status_error(self.protocol, error))
        table, values = self.models[id_], {}
        for name in names:
            r = table.register(name)
            part = bytes(data[r.address - address : r.end - address])
            if len(part) < r.size:
                # A servo that refuses sends no data.
                return ServoReading({}, status_error(self.protocol, error))
            values[name] = r.to_si(r.from_bytes(part))
        return ServoReading(values, status_error(self.protocol, error))

    # Time ----------------------------------------------------------------------------------------

    def _await(self, size: int, answers: int = 1, margin: float = ANSWER_MARGIN) -> None:
        """Set how long the next answers are awaited, for bytes on the wire in both directions."""
        assert self.latency is not None
        delay = 508e-6
        self.port.patience = wire_time(size, self.baud) + answers * delay + self.latency
        self.port.patience += margin

    def _count(self, result: int, silence: float = SILENCE) -> None:
        """Count an answer; after a lost one let what may still come pass."""
        if result == self._sdk.COMM_SUCCESS:
            self.traffic.answers += 1
        elif result == self._sdk.COMM_RX_CORRUPT:
            self.traffic.damaged += 1
            self.port.drain(silence)
        else:
            self.traffic.lost += 1
            self.port.drain(silence)

    def measure_latency(self, id_: int) -> float:
        """Return the USB adapter's latency [s]: the median time of a read less that on the wire."""
        table = self.model(id_)
        delay = self.read(id_, "return_delay_time")
        register, times = table.register("model_number"), []
        request, answer = (8, 8) if self.protocol == 1 else (14, 13)
        for _ in range(LATENCY_READS):
            begin = time.perf_counter()
            self.read_raw(id_, register)
            times.append(time.perf_counter() - begin)
        known = exchange_time(request, [answer], baud=self.baud, return_delay=delay, latency=0.0)
        return max(sorted(times)[LATENCY_READS // 2] - known, 0.0)


REFUSALS = (
    StatusError.INSTRUCTION
    | StatusError.CHECKSUM
    | StatusError.RANGE
    | StatusError.ANGLE_LIMIT
    | StatusError.RESULT
    | StatusError.LENGTH
    | StatusError.LIMIT
    | StatusError.ACCESS
)
"""Errors of an instruction, which was not executed."""


def usb_latency(path: str) -> float | None:
    """Return the latency timer of a port's USB adapter [s], None where the system has none."""
    timer = Path("/sys/bus/usb-serial/devices") / Path(path).resolve().name / "latency_timer"
    try:
        return int(timer.read_text()) / 1000
    except (OSError, ValueError):
        return None


def latency_advice(path: str) -> str:
    """Return how to set the latency timer of a port's USB adapter to 1 ms."""
    name = Path(path).resolve().name
    return f"echo 1 | sudo tee /sys/bus/usb-serial/devices/{name}/latency_timer"


def _block(model: Model, names: Sequence[str]) -> tuple[int, int]:
    """Return address and size of the block that holds registers of a model."""
    registers = [model.register(name) for name in names]
    address = min(register.address for register in registers)
    return address, max(register.end for register in registers) - address
