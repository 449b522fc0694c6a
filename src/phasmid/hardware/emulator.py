"""An emulated servo bus behind a pseudo-terminal, in real time.

Any client of such servos opens the port as that of a USB adapter. A thread receives its packets,
advances the servos' motion, and answers when the bytes would have arrived.
"""

from __future__ import annotations

import heapq
import os
import select
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import count
from typing import Any

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.hardware.control_table import model
from phasmid.hardware.emulated_servo import Answer, EmulatedServo, phantom
from phasmid.hardware.faults import Fault, parse_fault
from phasmid.hardware.packets import (
    BROADCAST,
    STATUS,
    Instruction,
    Packet,
    crc16,
    decode,
    status_packet,
)
from phasmid.hardware.plant import Bench, Plant
from phasmid.hardware.rates import BLOCK, wire_time
from phasmid.hardware.status import StatusError
from phasmid.robot import Servo, load_servo

MOST_SERVOS = 253
"""Most servos on a bus: all ids."""

TICK = 2e-3
"""Longest time between two advances of the motion [s]."""

SPIN = 1.5e-4
"""Time before a deadline during which the thread does not sleep [s]; sleeping ends later than asked
by about 0.1 ms."""

SILENCE = 0.02
"""Silence after which an incomplete packet is dropped [s]."""

LINE_TOLERANCE = 0.03
"""Difference of baud rates that a line bears."""

PHANTOMS = 0.2
"""Share of answers with random data of a servo with phantom values."""

OVERHEAT = 5.0
"""Temperature of a hot servo above its limit [°C]."""


def make_servos(
    model_name: str, ids: Sequence[int], *, baud: float, servo: Servo | None = None
) -> list[EmulatedServo]:
    """Return servos of one model.

    Args:
        model_name: Name of the model.
        ids: Their ids.
        baud: Baud rate that they are set to [1/s].
        servo: The servo whose motion they have; None: that of the model.
    """
    table = model(model_name)
    servo = servo or load_servo(table.moves_as)
    return [EmulatedServo(table, id_, baud=baud, servo=servo) for id_ in ids]


class Emulator:
    """Servos on an emulated bus.

    Requests take their time on the wire, one after the other. Answers begin after the return delay
    and reach the client when the USB adapter passes them on. Answers never collide.

    Args:
        servos: The servos, all of one protocol, with different ids.
        plant: Their motion, in their order; None: pendulums on a bench.
        latency: Latency timer of the USB adapter [s].
        faults: Sentences, see `parse_fault`; times count from the start.
        seed: Of the random faults.

    Attributes:
        servos: The servos.
        port: Path of the port; empty before the start.

    Raises:
        InvalidInput: The servos do not fit on one bus, or a fault is not understood.
        OSError: No pseudo-terminal can be opened.
    """

    def __init__(
        self,
        servos: Sequence[EmulatedServo],
        plant: Plant | None = None,
        *,
        latency: float = 1e-3,
        faults: Sequence[str] = (),
        seed: int = 0,
    ) -> None:
        self.servos = list(servos)
        _check(self.servos)
        self.protocol = self.servos[0].protocol
        self.plant: Plant = plant or Bench([one.servo for one in self.servos])
        self.latency = latency
        self.port = ""
        self._faults = [self._checked(parse_fault(text)) for text in faults]
        self._struck: set[Fault] = set()
        self._random = np.random.default_rng(seed)
        self._supply = self.plant.reading(0).voltage
        self._brown_out = False
        self._lock, self._closing = threading.Lock(), threading.Event()
        self._stream, self._events = bytearray(), list[tuple[float, int, Callable[..., None], Any]]()
        self._order = count()
        self._wire_free = self._last_byte = self._simulated = self._began = 0.0
        self._thread: threading.Thread | None = None
        self._speeds: dict[int, int] = {}
        # Compiles, and sets the registers before anybody reads them.
        goals, limp = np.zeros(len(self.servos)), np.zeros(len(self.servos), dtype=bool)
        self.plant.advance(1, goals, limp)
        for index, servo in enumerate(self.servos):
            servo.update(self.plant.reading(index), 0.0)
            servo.reboot()

    # Life ----------------------------------------------------------------------------------------

    def start(self) -> str:
        """Open the port and begin to answer; return the port's path."""
        try:
            import pty
            import termios
            import tty
        except ModuleNotFoundError:
            raise InvalidInput(
                "the emulator needs pseudo-terminals, which Windows does not have.",
                hint="Linux, macOS or the Windows Subsystem for Linux",
            ) from None
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._speeds = {
            value: int(name[1:])
            for name, value in vars(termios).items()
            if name.startswith("B") and name[1:].isdigit()
        }
        self.port = os.ttyname(self._slave)
        self._began = self._simulated = time.monotonic()
        self._thread = threading.Thread(target=self._run, name="servo bus", daemon=True)
        self._thread.start()
        return self.port

    def close(self) -> None:
        """Close the port."""
        self._closing.set()
        if self._thread:
            self._thread.join()
            self._thread = None
            for file in (self._master, self._slave):
                os.close(file)

    def __enter__(self) -> Emulator:
        """Start."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Close the port."""
        self.close()

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return time.monotonic() - self._began if self._began else 0.0

    def add_fault(self, text: str) -> None:
        """Add a fault, whose time counts from now.

        Raises:
            InvalidInput: It is not understood.
        """
        fault = self._checked(parse_fault(text))
        with self._lock:
            begin = fault.at + self.time
            self._faults.append(Fault(**{**vars(fault), "at": begin}))

    def servo(self, id_: int) -> EmulatedServo:
        """Return the servo of an id."""
        return next(one for one in self.servos if one.id == id_)

    def _checked(self, fault: Fault) -> Fault:
        """Refuse a fault of a servo that is not there."""
        ids = [one.id for one in self.servos]
        if fault.id >= 0 and fault.id not in ids:
            raise InvalidInput(f"there is no servo {fault.id}; there are {_ranges(ids)}.")
        return fault

    # Thread --------------------------------------------------------------------------------------

    def _run(self) -> None:
        """Receive, advance and answer until the port is closed."""
        while not self._closing.is_set():
            now = time.monotonic()
            next_event = self._events[0][0] if self._events else now + TICK
            rest = min(next_event - now, TICK) - SPIN
            ready = select.select([self._master], [], [], max(rest, 0.0))[0]
            with self._lock:
                if ready:
                    self._receive(time.monotonic())
                while self._events and self._events[0][0] - time.monotonic() < SPIN:
                    due = self._events[0][0]
                    while time.monotonic() < due:
                        pass
                    _, _, action, argument = heapq.heappop(self._events)
                    action(due, argument)
                self._advance(time.monotonic())

    def _later(self, due: float, action: Callable[[float, Any], None], argument: Any) -> None:
        """Call an action with an argument at a time [s]."""
        heapq.heappush(self._events, (due, next(self._order), action, argument))

    def _receive(self, now: float) -> None:
        """Take bytes from the client, and handle each packet when it has arrived on the wire."""
        with suppress(BlockingIOError, OSError):
            data = os.read(self._master, 65536)
            baud = self._line_speed()
            if now - self._last_byte > SILENCE:
                self._stream.clear()
            self._last_byte = now
            rate = baud or self.servos[0].baud
            begin = max(now, self._wire_free)
            self._wire_free = begin + wire_time(len(data), rate)
            self._stream += data
            while (packet := decode(self.protocol, self._stream)) is not None:
                # What is left in the stream arrives after the packet.
                arrival = self._wire_free - wire_time(len(self._stream), rate)
                self._later(arrival, self._handle, (packet, baud))

    def _line_speed(self) -> int:
        """Return the baud rate that the client has set; 0 where it is not known."""
        import termios

        return self._speeds.get(termios.tcgetattr(self._slave)[5], 0)

    def _handle(self, due: float, received: tuple[Packet, int]) -> None:
        """Let the servos handle a packet, and send their answers."""
        packet, baud = received
        if self._happens("lost") or self._brown_out:
            return
        if self._happens("garbled"):
            packet = Packet(packet.id, packet.instruction, packet.parameters, intact=False)
        self._advance(due)
        listening = [one for one in self.servos if self._listens(one, baud)]
        answers = self._answers(packet, {one.id: one for one in listening}, due)
        self._send(due, answers, baud)

    def _listens(self, servo: EmulatedServo, baud: int) -> bool:
        """Return whether a servo understands the line's baud rate, and lives."""
        is_heard = not baud or abs(servo.baud - baud) <= LINE_TOLERANCE * baud
        return is_heard and not self._is("dead", servo.id)

    def _answers(
        self, packet: Packet, servos: dict[int, EmulatedServo], now: float
    ) -> list[tuple[EmulatedServo, bytes]]:
        """Execute an instruction; return status packets in their order, and who sends them."""
        kind, several = packet.instruction, packet.id == BROADCAST
        if several and packet.intact:
            if kind == Instruction.SYNC_WRITE or (
                kind == Instruction.BULK_WRITE and self.protocol == 2
            ):
                for id_, address, content in self._write_parts(packet):
                    if id_ in servos:
                        servos[id_].write(address, content, now)
                return []
            if kind in self._group_reads():
                return self._group_answers(packet, servos, now)
        answers = []
        for servo in sorted(servos.values(), key=lambda one: one.id):
            if several or packet.id == servo.id:
                id_, answer = servo.id, servo.handle(packet, now)
                if answer is not None:
                    answers.append((servo, self._status(id_, servo, answer)))
        return answers

    def _group_reads(self) -> tuple[Instruction, ...]:
        if self.protocol == 2:
            return Instruction.SYNC_READ, Instruction.BULK_READ, Instruction.FAST_SYNC_READ
        return (Instruction.BULK_READ,)

    def _group_answers(
        self, packet: Packet, servos: dict[int, EmulatedServo], now: float
    ) -> list[tuple[EmulatedServo, bytes]]:
        """Return the answers to a sync or bulk read.

        Each servo waits for the answer of the one before it; behind a silent one all are silent.
        """
        answers: list[tuple[EmulatedServo, Answer]] = []
        for id_, address, length in self._read_parts(packet):
            servo = servos.get(id_)
            if servo is None or servo.model.reads == "single":
                break
            answer = servo.read_answer(address, length, now)
            if answer is None:
                break
            answers.append((servo, answer))
        if packet.instruction == Instruction.FAST_SYNC_READ:
            return self._fast_answer(answers)
        return [(servo, self._status(servo.id, servo, answer)) for servo, answer in answers]

    def _fast_answer(
        self, answers: Sequence[tuple[EmulatedServo, Answer]]
    ) -> list[tuple[EmulatedServo, bytes]]:
        """Return the one packet of a fast sync read: error, id, data and CRC of each servo."""
        if not answers:
            return []
        size = 1 + sum(4 + len(answer.data) for _, answer in answers)
        header = b"\xff\xff\xfd\x00" + bytes([BROADCAST]) + size.to_bytes(2, "little")
        content = header + bytes([STATUS])
        for servo, answer in answers:
            content += bytes([answer.error, self._own_id(servo)]) + answer.data
            content += crc16(content).to_bytes(2, "little")
        return [(answers[0][0], content)]

    def _write_parts(self, packet: Packet) -> list[tuple[int, int, bytes]]:
        """Return id, address and content of each part of a sync or bulk write."""
        data, parts = packet.parameters, []
        if packet.instruction == Instruction.BULK_WRITE:
            while len(data) >= 5:
                address, length = (int.from_bytes(data[k : k + 2], "little") for k in (1, 3))
                if len(data) < 5 + length:
                    break
                parts.append((data[0], address, data[5 : 5 + length]))
                data = data[5 + length :]
            return parts
        width = self.protocol
        if len(data) < 2 * width:
            return []
        address, length = (int.from_bytes(data[k : k + width], "little") for k in (0, width))
        rows = data[2 * width :]
        for k in range(0, len(rows) - length, length + 1):
            parts.append((rows[k], address, rows[k + 1 : k + 1 + length]))
        return parts

    def _read_parts(self, packet: Packet) -> list[tuple[int, int, int]]:
        """Return id, address and length of each part of a sync or bulk read."""
        data, parts = packet.parameters, []
        if self.protocol == 1:
            # The first parameter is 0; an id counts once.
            parts = [(data[k + 1], data[k + 2], data[k]) for k in range(1, len(data) - 2, 3)]
            return list({part[0]: part for part in reversed(parts)}.values())[::-1]
        if packet.instruction == Instruction.BULK_READ:
            for k in range(0, len(data) - 4, 5):
                address, length = (
                    int.from_bytes(data[j : j + 2], "little") for j in (k + 1, k + 3)
                )
                parts.append((data[k], address, length))
            return parts
        if len(data) < 4:
            return []
        address, length = (int.from_bytes(data[k : k + 2], "little") for k in (0, 2))
        return [(id_, address, length) for id_ in data[4:]]

    # Answers -------------------------------------------------------------------------------------

    def _own_id(self, servo: EmulatedServo) -> int:
        """Return the id with which a servo answers."""
        other = next((f for f in self._active() if f.kind == "answers" and f.id == servo.id), None)
        return servo.id if other is None else int(other.amount)

    def _status(self, id_: int, servo: EmulatedServo, answer: Answer) -> bytes:
        """Return a servo's status packet, with the faults of the servo."""
        data = answer.data
        if data and self._is("phantom", servo.id) and self._random.random() < PHANTOMS:
            data = phantom(data, self._random)
        id_ = self._own_id(servo) if self._faults else id_
        return status_packet(self.protocol, id_, answer.error, data)

    def _send(
        self, due: float, answers: Sequence[tuple[EmulatedServo, bytes]], baud: int
    ) -> None:
        """Send status packets: wire time, return delays, and blocks of the USB adapter."""
        now, waiting = max(due, self._wire_free), bytearray()
        extra = 0.0
        for servo, packet in answers:
            now += servo.return_delay
            if self._happens("lost"):
                continue
            if self._happens("garbled"):
                packet = self._garbled(packet)
            if late := self._happens("late"):
                extra = late.amount
            for byte in packet:
                now += wire_time(1, baud or servo.baud)
                waiting.append(byte)
                if len(waiting) == BLOCK:
                    self._later(now + extra, self._deliver, bytes(waiting))
                    waiting.clear()
        if waiting:
            self._later(now + self.latency + extra, self._deliver, bytes(waiting))
        if answers:
            self._wire_free = now

    def _deliver(self, _: float, data: bytes) -> None:
        with suppress(OSError):
            os.write(self._master, data)

    def _garbled(self, packet: bytes) -> bytes:
        """Return a packet with one bit turned."""
        damaged = bytearray(packet)
        damaged[self._random.integers(len(packet))] ^= 1 << self._random.integers(8)
        return bytes(damaged)

    # Faults --------------------------------------------------------------------------------------

    def _active(self) -> list[Fault]:
        if not self._faults:
            return []
        now = self.time
        return [fault for fault in self._faults if fault.is_active(now)]

    def _happens(self, kind: str) -> Fault | None:
        """Return the fault of packets that happens to the present one, or None."""
        for fault in self._active():
            if fault.kind == kind and self._random.random() < fault.rate:
                return fault
        return None

    def _is(self, kind: str, id_: int) -> bool:
        """Return whether a servo has a fault."""
        return any(fault.kind == kind and fault.id == id_ for fault in self._active())

    def _strike(self) -> None:
        """Apply faults that change the servos."""
        active = self._active()
        brown_out = next((fault for fault in active if fault.kind == "brown-out"), None)
        if bool(brown_out) != self._brown_out:
            self._brown_out = brown_out is not None
            for index, servo in enumerate(self.servos):
                voltage = brown_out.amount if brown_out else self._supply
                self.plant.set_law(index, servo.law(), voltage)
                # A servo without supply forgets its RAM.
                servo.reboot()
        for index, servo in enumerate(self.servos):
            for fault in active:
                if fault.id != servo.id:
                    continue
                if fault.kind == "hot":
                    self.plant.heat(index, servo["temperature_limit"] + OVERHEAT)
                elif fault.kind == "overload" and fault not in self._struck:
                    self._struck.add(fault)
                    servo.latch(StatusError.OVERLOAD)

    # Motion --------------------------------------------------------------------------------------

    def _advance(self, now: float) -> None:
        """Advance the motion to a time [s], and update the registers."""
        steps = int((now - self._simulated) / self.plant.dt)
        if steps < 1:
            return
        if self._faults:
            self._strike()
        dt = steps * self.plant.dt
        self._simulated += dt
        goals, enabled = np.zeros(len(self.servos)), np.zeros(len(self.servos), dtype=bool)
        for index, servo in enumerate(self.servos):
            if servo.law_changed:
                servo.law_changed = False
                voltage = self.plant.reading(index).voltage
                self.plant.set_law(index, servo.law(), voltage)
            goals[index] = servo.advance_goal(dt)
            enabled[index] = servo.enabled and not (self._faults and self._is("dead", servo.id))
        self.plant.advance(steps, goals, enabled)
        for index, servo in enumerate(self.servos):
            servo.update(self.plant.reading(index), now)


def _check(servos: Sequence[EmulatedServo]) -> None:
    """Refuse servos that do not fit on one bus."""
    if not servos or len(servos) > MOST_SERVOS:
        raise InvalidInput(f"a bus has 1 to {MOST_SERVOS} servos; there are {len(servos)}.")
    ids = [one.id for one in servos]
    twice = next((id_ for id_ in ids if ids.count(id_) > 1), None)
    if twice is not None:
        raise InvalidInput(f"two servos have the id {twice}; ids must differ.")
    if len({one.protocol for one in servos}) > 1:
        raise InvalidInput("the servos speak protocol 1.0 and 2.0; a bus needs one of them.")


def _ranges(ids: Sequence[int]) -> str:
    """Return ids as text."""
    return ", ".join(map(str, ids))
