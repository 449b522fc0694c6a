"""Random requests: the emulated servos answer as a second statement of the manuals says."""

import random

import pytest

from phasmid.hardware.emulator import make_servos
from phasmid.hardware.faults import FaultSource
from phasmid.hardware.line import Line
from phasmid.hardware.packets import decode
from support.servo_manuals import AX, Manual, X, packet

REQUESTS, FRESH = 10_000, 250
NAMES = {1: "AX-12A", 2: "XL430-W250"}
UNKNOWN = 0x77
EXCLUDED = {1: {3, 4, 11, 12, 13, 14, 34}, 2: {7, 8, 31, 32, 34, 36, 98}}
"""Registers whose writes make later requests unheard, or trip the protection of the servo."""


def line_of(protocol):
    servos = make_servos(NAMES[protocol], [1, 2, 3], baud=1_000_000)
    for servo in servos:
        servo["goal_position"] = servo["present_position"]
    return Line(servos, FaultSource())


def value_bytes(rng, row):
    """A value of a register, mostly within its bounds, often at one of them."""
    _, size, _, low, high, _ = row
    values = [low, high, rng.randint(low, high), rng.randint(low, high), high + 1, low - 1]
    return (rng.choice(values) % 256**size).to_bytes(size, "little")


def written(rng, protocol):
    """Address and bytes of a write: one register or several, now and then a part of one."""
    rows = [row for row in (AX if protocol == 1 else X) if row[0] not in EXCLUDED[protocol]]
    first = rng.randrange(len(rows))
    data = b""
    for k, row in enumerate(rows[first : first + rng.choice([1, 1, 1, 2, 3])]):
        if k and row[0] != rows[first][0] + len(data):
            break
        data += value_bytes(rng, row)
    if rng.random() < 0.1:
        data = data[: rng.randint(1, len(data))]
    at = rows[first][0]
    beside = at + 1 not in EXCLUDED[protocol] and rng.random() < 0.05
    return at + beside, data


def address(protocol, number):
    return list(number.to_bytes(protocol, "little"))


def one_request(rng, protocol):
    id_ = rng.choice([1, 1, 2, 3, 9, 254])
    kind = rng.choice([1, 2, 2, 2, 3, 3, 3, 4, 5, 0x83, 0x82, 0x92, 0x93, 8, 16, UNKNOWN])
    size = 50 if protocol == 1 else 148
    if kind == 2:
        at, length = rng.randint(0, size), rng.randint(0, 12)
        return id_, kind, address(protocol, at) + address(protocol, length)
    if kind == 3:
        at, data = written(rng, protocol)
        return id_, kind, address(protocol, at) + list(data)
    if kind == 0x83:
        at, data = written(rng, protocol)
        head = address(protocol, at) + address(protocol, len(data))
        ids = rng.sample([1, 2, 3, 9], rng.randint(1, 4))
        return 254, kind, head + [byte for i in ids for byte in [i, *data]]
    if kind == 0x82 and protocol == 2:
        head = address(2, rng.randint(0, size)) + address(2, rng.randint(1, 12))
        return 254, kind, head + rng.sample([1, 2, 3, 9], rng.randint(1, 4))
    if kind == 0x92 and protocol == 1:
        parts = [0]
        for i in rng.sample([1, 2, 3, 9], rng.randint(1, 3)):
            parts += [rng.randint(1, 12), i, rng.randint(0, size)]
        return 254, kind, parts
    extra = rng.choice([[], [0xFF, 0xFF, 0xFD], [0xFF, 0xFF, 0xFD, 0xFD, 7]])
    return id_, kind, extra if kind == UNKNOWN else []


def expected(protocol, manuals, id_, kind, parameters, intact):
    servos = {one.id: one for one in manuals}
    if id_ == 254 and intact:
        number = lambda k: int.from_bytes(bytes(parameters[k : k + protocol]), "little")  # noqa: E731
        if kind == 0x83:
            at, length = number(0), number(protocol)
            rows = parameters[2 * protocol :]
            for k in range(0, len(rows), length + 1):
                if rows[k] in servos:
                    servos[rows[k]].write(at, bytes(rows[k + 1 : k + 1 + length]))
            return b""
        if kind == 0x92 and protocol == 1:
            # No servo of the AX series answers a bulk read.
            return b""
        if kind == 0x82 and protocol == 2:
            answers = b""
            for i in parameters[4:]:
                answer = servos[i].part(number(0), number(2)) if i in servos else b""
                if not answer:
                    # Who waits for a silent servo stays silent.
                    break
                answers += answer
            return answers
    return b"".join(
        one.request(id_, kind, parameters, intact) for one in manuals if id_ in (254, one.id)
    )


@pytest.mark.parametrize("protocol", [1, 2])
def test_random_requests_are_answered_as_the_manual_says(protocol):
    rng = random.Random(protocol)
    stream, answered, refused = bytearray(), 0, 0
    for k in range(REQUESTS):
        if k % FRESH == 0:
            # Locks and status return levels would silence the servos one after the other.
            line, manuals = line_of(protocol), [Manual(protocol, id_) for id_ in (1, 2, 3)]
        id_, kind, parameters = one_request(rng, protocol)
        sent, intact = bytearray(packet(protocol, id_, kind, parameters)), rng.random() > 0.05
        if not intact:
            # The last byte belongs to checksum or CRC; damaged lengths have a test of their own.
            sent[-1] ^= 1 << rng.randrange(8)
        if rng.random() < 0.1:
            stream += bytes(rng.randrange(255) for _ in range(rng.randint(1, 5)))
        stream += sent
        received = decode(protocol, stream)
        assert received is not None
        assert (received.id, received.instruction) == (id_, kind)
        assert received.parameters == bytes(parameters)
        got = b"".join(data for _, data in line.execute(received, 0.0))
        wanted = expected(protocol, manuals, id_, kind, parameters, intact)
        assert got == wanted, (id_, kind, parameters)
        answered += bool(got)
        refused += len(got) > 5 and bool(got[4 if protocol == 1 else 8])
    assert not stream
    # The requests reach both kinds of answers.
    assert answered > REQUESTS / 4
    assert refused > REQUESTS / 10


def test_a_packet_that_was_cut_off_does_not_swallow_the_next():
    """Byte stuffing makes the header of protocol 2.0 unique."""
    whole = packet(2, 1, 2, address(2, 0) + address(2, 4))
    stream = bytearray(b"\xff" + whole[:9] + whole + whole)
    found = [decode(2, stream) for _ in range(3)]
    assert [one.intact for one in found] == [False, True, True]
    assert not stream
