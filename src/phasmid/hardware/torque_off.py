"""Switches the torque of servos off after the driver's process has ended or hangs.

    python torque_off.py FD HOLD SILENCE PACKET

The driver starts this program with the open port as file descriptor FD, and sends a byte through
its standard input in each period. PACKET (hexadecimal) goes to the port HOLD seconds after the end
of that stream, or after SILENCE seconds without a byte. The byte ``q`` ends the program without
it. It imports nothing of phasmid, so that it starts at once.
"""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

REPEATS, PAUSE = 5, 0.02
"""How often the packet is sent, and the time between [s]: one may be lost."""


@contextmanager
def torque_off_after_exit(
    port: int, packet: bytes, hold: float, silence: float
) -> Iterator[Callable[[], bool]]:
    """Run the program for as long as the context lasts.

    Args:
        port: File descriptor of the open port.
        packet: Instruction packet that switches the torque off.
        hold: Time from the end of this process to the packet [s].
        silence: Time without a call of the yielded function before the packet [s].

    Yields:
        A function to be called in each period, which returns whether the program still runs.
    """
    command = [sys.executable, "-I", __file__, str(port), f"{hold:g}", f"{silence:g}"]
    with subprocess.Popen(  # noqa: S603
        [*command, packet.hex()],
        stdin=subprocess.PIPE,
        pass_fds=(port,),
        bufsize=0,
        # Signals to the driver's group must not reach it.
        start_new_session=True,
    ) as program:
        pipe = program.stdin
        assert pipe is not None

        def alive() -> bool:
            with suppress(OSError):
                pipe.write(b".")
            return program.poll() is None

        try:
            yield alive
        finally:
            with suppress(OSError):
                pipe.write(b"q")


def main() -> None:
    """Wait for the end of the driver, then switch the torque off."""
    port, hold, silence = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
    packet = bytes.fromhex(sys.argv[4])
    for ignored in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_IGN)
    while select.select([0], [], [], silence)[0]:
        received = os.read(0, 4096)
        if b"q" in received:
            return
        if not received:
            time.sleep(hold)
            break
    # An adapter that was unplugged takes no packet.
    with suppress(OSError):
        for _ in range(REPEATS):
            os.write(port, packet)
            time.sleep(PAUSE)


if __name__ == "__main__":
    main()
