"""Packets of the servo bus, protocols 1.0 and 2.0, as the emulator receives and sends them.

The rules are those of the maker's e-manual (emanual.robotis.com, protocol 1 and 2). The bus itself
uses the maker's library.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

BROADCAST = 0xFE

HEADERS = {1: b"\xff\xff", 2: b"\xff\xff\xfd\x00"}
STATUS = 0x55
STUFFED, UNSTUFFED = b"\xff\xff\xfd\xfd", b"\xff\xff\xfd"
POLYNOMIAL = 0x8005
LONGEST = 1024
"""Longest packet of protocol 2.0 that a servo accepts, in bytes after its length."""


class Instruction(IntEnum):
    """Instructions; reboot and sync read belong to protocol 2.0, bulk read to protocol 1.0."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REBOOT = 0x08
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    BULK_READ = 0x92


@dataclass(frozen=True)
class Packet:
    """Instruction packet.

    Attributes:
        id: Receiver, or `BROADCAST`.
        instruction: Number of the instruction, known or not.
        parameters: Its parameters, without byte stuffing.
        intact: Whether checksum or CRC fit.
    """

    id: int
    instruction: int
    parameters: bytes = b""
    intact: bool = True


def checksum(data: bytes) -> int:
    """Return the checksum of protocol 1.0: the inverse of the sum of all bytes after the header."""
    return ~sum(data) & 0xFF


def _crc_row(high: int) -> int:
    crc = high << 8
    for _ in range(8):
        crc = (crc << 1) ^ (POLYNOMIAL if crc & 0x8000 else 0)
    return crc & 0xFFFF


_CRC = [_crc_row(high) for high in range(256)]


def crc16(data: bytes) -> int:
    """Return the CRC of protocol 2.0 (polynomial 0x8005, not reflected)."""
    crc = 0
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _CRC[crc >> 8 ^ byte]
    return crc


def encode(protocol: int, id_: int, kind: int, parameters: bytes = b"") -> bytes:
    """Return the bytes of a packet.

    Args:
        protocol: 1 or 2.
        id_: Of the receiver, in a status packet of the sender.
        kind: The instruction. Of a status packet: in protocol 1.0 its error byte, in 2.0 `STATUS`,
            and the error byte is the first parameter.
        parameters: Its parameters.
    """
    if protocol == 1:
        content = bytes([id_, len(parameters) + 2, kind]) + parameters
        return HEADERS[1] + content + bytes([checksum(content)])
    body = (bytes([kind]) + parameters).replace(UNSTUFFED, STUFFED)
    packet = HEADERS[2] + bytes([id_]) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc16(packet).to_bytes(2, "little")


def status_packet(protocol: int, id_: int, error: int, data: bytes = b"") -> bytes:
    """Return the bytes of a status packet with an error byte and data."""
    if protocol == 1:
        return encode(1, id_, error, data)
    return encode(2, id_, STATUS, bytes([error]) + data)


def decode(protocol: int, stream: bytearray) -> Packet | None:
    """Take the next packet from a stream of bytes; bytes that begin no packet are dropped.

    Args:
        protocol: 1 or 2.
        stream: Received bytes; what is decoded or no packet is removed from its beginning.

    Returns:
        The packet; None if it is not complete.
    """
    header = HEADERS[protocol]
    while True:
        start = stream.find(header)
        if start < 0:
            # The header may have begun.
            parts = (header[:n] for n in range(len(header) - 1, 0, -1))
            keep = next((len(part) for part in parts if stream.endswith(part)), 0)
            del stream[: len(stream) - keep]
            return None
        del stream[:start]
        packet, length = (_decode_1 if protocol == 1 else _decode_2)(stream)
        if length == 0:
            return None
        del stream[:length]
        if packet:
            return packet


def _decode_1(stream: bytearray) -> tuple[Packet | None, int]:
    """Return the packet at the beginning and its length; no packet: what to drop, 0 to wait."""
    if len(stream) < 4:
        return None, 0
    id_, length = stream[2], stream[3]
    if id_ == 0xFF or length < 2:
        return None, 1
    if len(stream) < 4 + length:
        return None, 0
    content, last = bytes(stream[2 : 3 + length]), stream[3 + length]
    intact = checksum(content) == last
    return Packet(id_, content[2], content[3:], intact), 4 + length


def _decode_2(stream: bytearray) -> tuple[Packet | None, int]:
    """Return the packet at the beginning and its length; no packet: what to drop, 0 to wait."""
    if len(stream) < 7:
        return None, 0
    id_, length = stream[4], int.from_bytes(stream[5:7], "little")
    if id_ in (0xFD, 0xFF) or not 3 <= length <= LONGEST:
        return None, 1
    if len(stream) < 7 + length:
        return None, 0
    content = bytes(stream[: 5 + length])
    intact = crc16(content) == int.from_bytes(stream[5 + length : 7 + length], "little")
    body = content[7:].replace(STUFFED, UNSTUFFED)
    end = 7 + length
    if not intact:
        # Byte stuffing keeps headers out of packets: another one means that this was cut off.
        again = stream.find(HEADERS[2], 7, end + 3)
        end = end if again < 0 else again
    return Packet(id_, body[0], body[1:], intact), end
