"""Rates of the servo bus by protocol arithmetic.

A byte takes ten bits on the wire: start, eight data bits, stop. A servo answers after its return
delay. A USB adapter passes full blocks on at once, and the rest when its latency timer has run out.
"""

from __future__ import annotations

from collections.abc import Sequence

from phasmid.hardware.control_table import Model

BITS = 10
"""Bits of a byte on the wire."""

BLOCK = 62
"""Bytes of a full block of a USB adapter: 64 less two of status (FTDI, AN232B-04)."""

FACTORY_LATENCY = 16e-3
"""Latency timer of a USB adapter as the maker sets it [s]."""

FRAME = {1: 6, 2: 11}
"""Bytes of a status packet without data."""


def wire_time(size: int, baud: float) -> float:
    """Return the time of a number of bytes on the wire [s]."""
    return size * BITS / baud


def exchange_time(
    request: int, answers: Sequence[int], *, baud: float, return_delay: float, latency: float
) -> float:
    """Return the time from sending a request to having its answers [s].

    Args:
        request: Bytes of the instruction packet.
        answers: Bytes of each status packet, in their order.
        baud: Baud rate [1/s].
        return_delay: Return delay of each servo [s].
        latency: Latency timer of the USB adapter [s].
    """
    time = wire_time(request + sum(answers), baud) + len(answers) * return_delay
    return time + latency if answers and sum(answers) % BLOCK else time


def read_time(
    model: Model,
    count: int,
    size: int,
    *,
    baud: float,
    return_delay: float,
    latency: float,
) -> float:
    """Return the time to read a block of registers of servos in the model's fastest way [s].

    Args:
        model: Model of all servos.
        count: Number of servos.
        size: Bytes that are read from each.
        baud: Baud rate [1/s].
        return_delay: Return delay of each servo [s].
        latency: Latency timer of the USB adapter [s].
    """
    settings = {"baud": baud, "return_delay": return_delay, "latency": latency}
    answer = FRAME[model.protocol] + size
    if model.reads == "single":
        return count * exchange_time(8, [answer], **settings)
    if model.reads == "bulk":
        return exchange_time(7 + 3 * count, [answer] * count, **settings)
    return exchange_time(14 + count, [answer] * count, **settings)


def write_time(model: Model, count: int, size: int, *, baud: float) -> float:
    """Return the time of a sync write of `size` bytes to each of `count` servos [s]."""
    frame = 8 if model.protocol == 1 else 14
    return wire_time(frame + count * (size + 1), baud)


def achievable_rate(
    model: Model,
    count: int,
    *,
    baud: float,
    return_delay: float = 0.0,
    latency: float = 1e-3,
    read_size: int = 2,
    read_servos: int | None = None,
) -> float:
    """Return how often goals can be written and servos be read [1/s].

    Each tick is a sync write of all goals and a read.

    Args:
        model: Model of all servos.
        count: Number of servos.
        baud: Baud rate [1/s].
        return_delay: Return delay of each servo [s].
        latency: Latency timer of the USB adapter [s].
        read_size: Bytes that are read from a servo.
        read_servos: Servos that are read in a tick; None: all.
    """
    goals = write_time(model, count, model.register("goal_position").size, baud=baud)
    servos = count if read_servos is None else read_servos
    read = read_time(
        model, servos, read_size, baud=baud, return_delay=return_delay, latency=latency
    )
    return 1 / (goals + read)
