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
from phasmid.hardware.emulated_servo import EmulatedServo
from phasmid.hardware.faults import Fault, FaultSource
from phasmid.hardware.line import Line
from phasmid.hardware.packets import Packet, decode
from phasmid.hardware.plant import Bench, Plant
from phasmid.hardware.rates import BLOCK, wire_time
from phasmid.hardware.status import StatusError
from phasmid.servo import Servo, load_servo

TICK = 2e-3
"""Longest time between two advances of the motion [s]."""

LONGEST_ADVANCE = 0.05
"""Longest time by which the motion advances at once [s]."""

SPIN = 1.5e-4
"""Time before a deadline during which the thread does not sleep [s]; a sleep lasts about
0.1 ms too long."""

HANDOVERS = 51
"""Bytes that are passed through the pseudo-terminal to measure how long the system takes."""

SILENCE = 0.02
"""Silence after which an incomplete packet is dropped [s]."""

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
    and reach the client when the USB adapter passes them on. Answers never collide. The time that
    the system itself takes to pass bytes on is measured at the start and subtracted.

    Args:
        servos: The servos, all of one protocol, with different ids.
        plant: Their motion, in their order; None: pendulums on a bench.
        latency: Latency timer of the USB adapter [s].
        faults: Sentences, see `parse_fault`; times count from the start.
        seed: Of the random faults.

    Attributes:
        servos: The servos.
        faults: Faults, with the random generator.
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
        self.faults = FaultSource(faults, seed)
        self._line = Line(servos, self.faults)
        self.protocol = self._line.protocol
        self.plant: Plant = plant or Bench([one.servo for one in self.servos])
        self.latency = latency
        self.port = ""
        self._struck: set[Fault] = set()
        self._supply = self.plant.reading(0).voltage
        self._brown_out = False
        self._lock, self._closing = threading.Lock(), threading.Event()
        self._stream = bytearray()
        self._events: list[tuple[float, int, Callable[..., None], Any]] = []
        self._order = count()
        self._wire_free = self._last_byte = self._simulated = self._began = 0.0
        self._handover = 0.0, 0.0
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
        ends = self._slave, self._master
        self._handover = _handover(*ends), _handover(*ends[::-1])
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
        with self._lock:
            self.faults.add(text, self.time)

    def servo(self, id_: int) -> EmulatedServo:
        """Return the servo of an id."""
        return next(one for one in self.servos if one.id == id_)

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
                    self._receive()
                while self._events and self._events[0][0] - time.monotonic() < SPIN:
                    while time.monotonic() < self._events[0][0]:
                        pass
                    self._happen()
                if time.monotonic() - self._simulated > TICK / 2:
                    self._advance(time.monotonic())

    def _later(self, due: float, action: Callable[[float, Any], None], argument: Any) -> None:
        """Call an action with an argument at a time [s]."""
        heapq.heappush(self._events, (due, next(self._order), action, argument))

    def _happen(self) -> None:
        """Let the next event happen."""
        due, _, action, argument = heapq.heappop(self._events)
        action(due, argument)

    def _receive(self) -> None:
        """Take what the client has sent."""
        with suppress(BlockingIOError, OSError):
            data, now = os.read(self._master, 65536), time.monotonic()
            self._accept(data, self._line_speed(), now)

    def _accept(self, data: bytes, baud: int, now: float) -> None:
        """Take bytes from the client, and handle each packet when it has arrived on the wire."""
        if now - self._last_byte > SILENCE:
            self._stream.clear()
        self._last_byte = now
        rate = baud or self.servos[0].baud
        begin = max(now - self._handover[0], self._wire_free)
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
        self.faults.time = due - self._began
        if self.faults.happens("lost") or self._brown_out:
            return
        if self.faults.happens("garbled"):
            packet = Packet(packet.id, packet.instruction, packet.parameters, intact=False)
        self._advance(due)
        self._send(due, self._line.execute(packet, due, baud), baud)

    # Answers -------------------------------------------------------------------------------------

    def _send(self, due: float, answers: Sequence[tuple[EmulatedServo, bytes]], baud: int) -> None:
        """Send status packets: wire time, return delays, and blocks of the USB adapter."""
        now, waiting = max(due, self._wire_free), bytearray()
        extra = 0.0
        for servo, packet in answers:
            now += servo.return_delay
            if self.faults.happens("lost"):
                continue
            if self.faults.happens("garbled"):
                packet = self.faults.garbled(packet)
            if late := self.faults.happens("late"):
                extra = late.amount
            for byte in packet:
                now += wire_time(1, baud or servo.baud)
                waiting.append(byte)
                if len(waiting) == BLOCK:
                    self._later(now + extra - self._handover[1], self._deliver, bytes(waiting))
                    waiting.clear()
        if waiting:
            due = now + self.latency + extra - self._handover[1]
            self._later(due, self._deliver, bytes(waiting))
        if answers:
            self._wire_free = now

    def _deliver(self, _: float, data: bytes) -> None:
        with suppress(OSError):
            os.write(self._master, data)

    def _strike(self) -> None:
        """Apply faults that change the servos."""
        active = self.faults.active()
        brown_out = next((fault for fault in active if fault.kind == "brown-out"), None)
        if bool(brown_out) != self._brown_out:
            self._brown_out = brown_out is not None
            for index, servo in enumerate(self.servos):
                voltage = brown_out.amount if brown_out else self._supply
                self.plant.set_law(index, servo.law().at(voltage))
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
        # A plant that is slower than the time falls behind, and the bus goes on.
        self._simulated = max(self._simulated, now - LONGEST_ADVANCE)
        steps = int((now - self._simulated) / self.plant.dt)
        if steps < 1:
            return
        if self.faults:
            self.faults.time = now - self._began
            self._strike()
        dt = steps * self.plant.dt
        self._simulated += dt
        goals, enabled = np.zeros(len(self.servos)), np.zeros(len(self.servos), dtype=bool)
        for index, servo in enumerate(self.servos):
            if servo.law_changed:
                servo.law_changed = False
                voltage = self.plant.reading(index).voltage
                self.plant.set_law(index, servo.law().at(voltage))
            goals[index] = servo.advance_goal(dt)
            enabled[index] = servo.enabled and not self.faults.strikes("dead", servo.id)
        self.plant.advance(steps, goals, enabled)
        for index, servo in enumerate(self.servos):
            servo.update(self.plant.reading(index), now)


def _handover(sender: int, receiver: int) -> float:
    """Return the median time that bytes take through the pseudo-terminal to a thread [s]."""
    sent, received = [], []

    def receive() -> None:
        for _ in range(HANDOVERS):
            select.select([receiver], [], [], 1.0)
            os.read(receiver, 1)
            received.append(time.monotonic())

    thread = threading.Thread(target=receive)
    thread.start()
    for _ in range(HANDOVERS):
        # As between two packets: a processor that rests takes longer to begin.
        time.sleep(TICK)
        sent.append(time.monotonic())
        os.write(sender, b"\0")
    thread.join()
    return sorted(b - a for a, b in zip(sent, received, strict=True))[HANDOVERS // 2]
