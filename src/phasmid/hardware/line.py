"""The line of an emulated bus: which servos execute an instruction, and what they answer.

Times are arguments; the emulator adds the time on the wire.
"""

from __future__ import annotations

from collections.abc import Sequence

from phasmid.errors import InvalidInput
from phasmid.hardware.emulated_servo import Answer, EmulatedServo
from phasmid.hardware.faults import FaultSource
from phasmid.hardware.packets import BROADCAST, Instruction, Packet, status_packet

MOST_SERVOS = 253
"""Most servos on a bus: all ids."""

LINE_TOLERANCE = 0.03
"""Largest relative difference of baud rates at which a packet is received."""


class Line:
    """Servos on one line.

    Args:
        servos: The servos, all of one protocol, with different ids.
        faults: Faults of the servos.

    Raises:
        InvalidInput: The servos do not fit on one bus.
    """

    def __init__(self, servos: Sequence[EmulatedServo], faults: FaultSource) -> None:
        self.servos, self._faults = list(servos), faults
        ids = [one.id for one in self.servos]
        if not 1 <= len(ids) <= MOST_SERVOS:
            raise InvalidInput(f"a bus has 1 to {MOST_SERVOS} servos; there are {len(ids)}.")
        twice = next((id_ for id_ in ids if ids.count(id_) > 1), None)
        if twice is not None:
            raise InvalidInput(f"two servos have the id {twice}; ids must differ.")
        if len({one.protocol for one in self.servos}) > 1:
            raise InvalidInput("the servos speak protocol 1.0 and 2.0; a bus needs one of them.")
        faults.check(ids)
        self.protocol = self.servos[0].protocol

    def execute(
        self, packet: Packet, now: float, baud: float = 0.0
    ) -> list[tuple[EmulatedServo, bytes]]:
        """Execute an instruction.

        Args:
            packet: The instruction.
            now: Time [s].
            baud: Baud rate at which it was sent [1/s]; 0: any. Servos of another rate
                receive nothing.

        Returns:
            Status packets in their order, and the servos that send them.
        """
        listening = [one for one in self.servos if self._listens(one, baud)]
        kind, several = packet.instruction, packet.id == BROADCAST
        if several and packet.intact and kind == Instruction.SYNC_WRITE:
            for id_, address, content in self._write_parts(packet.parameters):
                for servo in listening:
                    if servo.id == id_:
                        servo.write(address, content, now)
            return []
        group_read = Instruction.BULK_READ if self.protocol == 1 else Instruction.SYNC_READ
        if several and packet.intact and kind == group_read:
            return self._group_answers(packet.parameters, listening, now)
        answers = []
        for servo in sorted(listening, key=lambda one: one.id):
            if several or packet.id == servo.id:
                # A write may change the servo's id; it answers with the one that was called.
                id_, answer = servo.id, servo.handle(packet, now)
                if answer is not None:
                    answers.append((servo, self._status(id_, servo, answer)))
        return answers

    def _listens(self, servo: EmulatedServo, baud: float) -> bool:
        """Return whether a servo is alive and receives packets of a baud rate."""
        is_heard = not baud or abs(servo.baud - baud) <= LINE_TOLERANCE * baud
        return is_heard and not self._faults.strikes("dead", servo.id)

    def _group_answers(
        self, data: bytes, servos: Sequence[EmulatedServo], now: float
    ) -> list[tuple[EmulatedServo, bytes]]:
        """Return the answers to a sync or bulk read.

        Each servo waits for the answer of the one before it; behind a silent one all are silent.
        """
        answers: list[tuple[EmulatedServo, bytes]] = []
        for id_, address, length in self._read_parts(data):
            servo = next((one for one in servos if one.id == id_), None)
            if servo is None or servo.model.reads == "single":
                break
            answer = servo.read_answer(address, length, now)
            if answer is None:
                break
            answers.append((servo, self._status(id_, servo, answer)))
        return answers

    def _write_parts(self, data: bytes) -> list[tuple[int, int, bytes]]:
        """Return id, address and content of each part of a sync write."""
        width = self.protocol
        if len(data) < 2 * width:
            return []
        address, length = (int.from_bytes(data[k : k + width], "little") for k in (0, width))
        rows = data[2 * width :]
        starts = range(0, len(rows) - length, length + 1)
        return [(rows[k], address, rows[k + 1 : k + 1 + length]) for k in starts]

    def _read_parts(self, data: bytes) -> list[tuple[int, int, int]]:
        """Return id, address and length of each part of a sync or bulk read."""
        if self.protocol == 1:
            # The first parameter is 0; an id counts once.
            parts = [(data[k + 1], data[k + 2], data[k]) for k in range(1, len(data) - 2, 3)]
            return list({part[0]: part for part in reversed(parts)}.values())[::-1]
        if len(data) < 4:
            return []
        address, length = (int.from_bytes(data[k : k + 2], "little") for k in (0, 2))
        return [(id_, address, length) for id_ in data[4:]]

    def _status(self, id_: int, servo: EmulatedServo, answer: Answer) -> bytes:
        """Return the status packet of a servo that was called by an id, with its faults."""
        data = self._faults.phantom(servo.id, answer.data)
        return status_packet(self.protocol, self._faults.own_id(id_), answer.error, data)
