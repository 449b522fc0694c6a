"""Switch the torque of servos off, confirmed by reading back.

The driver starts this module as a second process, which switches the torque off after the driver's
process has ended or hangs. It loads the bus alone, so that it starts in 0.3 s.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any, Protocol

from phasmid.hardware.bus import Bus, BusError, PortLost
from phasmid.hardware.control_table import model

READ_BACK = "torque_enable", "present_temperature"
"""Registers that are read back as one block. No other read has as many bytes, so that a late answer
to an earlier request is not taken for this one."""

CONFIRMATIONS = 2
"""Readings in a row without torque that confirm it: a single one may be damaged undetected."""

REOPEN_PAUSE = 0.05
"""Time between attempts with a port that fails [s]."""

START_TIME = 20.0
"""Longest time for the start of the second process [s]; it takes 0.3 s without other work."""

RETRY_TIME = 0.5
"""Time for which the second process sends torque off without a pause [s]; 18 servos confirm in
0.1 s."""

RETRY_PAUSE = 0.5
"""Pause of the second process between two such times [s], in which other programs can read."""

ANSWER_TIME = 2.0
"""Time without an answer after which the second process counts as stopped [s]; it answers at once
on a machine without other work."""

QUIT_TIME = 5.0
"""Longest time for the end of the second process [s]."""

PORT = "path", "baud", "protocol", "latency"
"""Arguments of `Bus` that the second process gets."""

READY = b"r"
"""Message of the second process: it can switch the torque off. It answers each message."""

ALIVE = b"."
"""Message of the driver: it does not hang."""

GIVES_UP = b"g"
"""Message of the driver: it could not confirm that the torque is off."""

QUIT = b"q"
"""Message of the driver: the torque is off."""


def switch_torque_off(
    bus: Bus,
    ids: Sequence[int],
    duration: float,
    alive: Callable[[], object] = lambda: None,
) -> list[int]:
    """Send torque off until all servos confirm it by reading back.

    A port that fails is tried again, and opened anew.

    Args:
        bus: The bus, with the models of the servos.
        ids: Ids of the servos.
        duration: Longest time [s].
        alive: Called before each reading.

    Returns:
        Ids of the servos that have not confirmed it.
    """
    end = time.monotonic() + duration
    confirmed = dict.fromkeys(ids, 0)
    remaining, fails = list(ids), 0
    while remaining:
        alive()
        id_, reading = remaining[0], None
        try:
            # One packet may be lost, or reach some servos only.
            bus.write_all("torque_enable", dict.fromkeys(remaining, 0.0))
            reading = bus.read_all([id_], READ_BACK)[id_]
            fails = 0
        except PortLost:
            fails += 1
            if fails > 1:
                with suppress(PortLost):
                    bus.port.reopen()
            time.sleep(REOPEN_PAUSE)
        if reading is not None and reading.values:
            is_off = reading.values["torque_enable"] == 0
            confirmed[id_] = confirmed[id_] + 1 if is_off else 0
        remaining = remaining[1:] + [id_] * (confirmed[id_] < CONFIRMATIONS)
        if time.monotonic() > end:
            break
    return sorted(remaining)


# The second process, as the driver sees it --------------------------------------------------------


class Guard(Protocol):
    """Process that switches the torque off after this one, see `TorqueOffProcess`."""

    is_confirmed: bool

    @property
    def pid(self) -> int:
        """Number of the process; 0 for none."""

    def alive(self) -> bool:
        """Report that this process does not hang; return whether the guard answers."""

    def has_acted(self) -> bool:
        """Return whether the guard has ended after torque off."""


class NoGuard:
    """Guard that does nothing: the servos hold after the end of this process."""

    is_confirmed, pid = True, 0

    def alive(self) -> bool:
        """Return True."""
        return True

    def has_acted(self) -> bool:
        """Return False."""
        return False


class TorqueOffProcess:
    """A second process that switches the torque off after this one has ended or hangs.

    Args:
        settings: Port, models of the servos, and times, see `torque_off_after_exit`.

    Attributes:
        is_confirmed: Whether the servos have confirmed that their torque is off. Otherwise the
            second process goes on with it.
    """

    def __init__(self, settings: Mapping[str, Any]) -> None:
        self.is_confirmed = False
        # Without -P a file of the working folder could replace a module.
        command = [sys.executable, "-P", "-m", __name__, json.dumps(settings)]
        self._process = subprocess.Popen(  # noqa: S603
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            # It may outlive this process; readers of its streams would wait for its end.
            stderr=subprocess.DEVNULL,
            bufsize=0,
            # Signals to the driver's group must not reach it.
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to, self._from = self._process.stdin, self._process.stdout
        # A process that was stopped must not block this one.
        for stream in (self._to, self._from):
            os.set_blocking(stream.fileno(), False)
        self._answered_at = time.monotonic()

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    def is_ready(self) -> bool:
        """Wait until it can switch the torque off; return False where it ends before."""
        ready = select.select([self._from], [], [], START_TIME)[0]
        self._answered_at = time.monotonic()
        return bool(ready) and self._from.read(1) == READY

    def alive(self) -> bool:
        """Report that this process does not hang; return whether the second one answers."""
        self._send(ALIVE)
        now = time.monotonic()
        if self._from.read(4096):
            self._answered_at = now
        return self._process.poll() is None and now - self._answered_at < ANSWER_TIME

    def has_acted(self) -> bool:
        """Return whether it has ended of itself, after torque off."""
        return self._process.poll() == 0

    def close(self) -> None:
        """Request its end where torque off is confirmed; let it go on otherwise."""
        self._send(QUIT if self.is_confirmed else GIVES_UP)
        self._to.close()
        self._from.close()
        if self.is_confirmed:
            try:
                self._process.wait(timeout=QUIT_TIME)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def _send(self, message: bytes) -> None:
        # The pipe is full where the process was stopped.
        with suppress(OSError):
            self._to.write(message)


@contextmanager
def torque_off_after_exit(
    bus: Bus, ids: Sequence[int], hold: float, silence: float
) -> Iterator[TorqueOffProcess]:
    """Run the second process for as long as the context lasts.

    Args:
        bus: The bus, with the models of the servos.
        ids: Ids of the servos.
        hold: Time from the end of this process to torque off [s].
        silence: Time without a call of `TorqueOffProcess.alive` before torque off [s].

    Raises:
        BusError: It does not start.
    """
    second = TorqueOffProcess(
        {
            "port": {name: getattr(bus, name) for name in PORT},
            "models": {id_: bus.model(id_).name for id_ in ids},
            "hold": hold,
            "silence": silence,
        }
    )
    try:
        if not second.is_ready():
            raise BusError("the process that switches the torque off does not start.")
        yield second
    finally:
        second.close()


# The second process -------------------------------------------------------------------------------


def main() -> None:
    """Wait for the end of the driver, then switch the torque off."""
    settings = json.loads(sys.argv[1])
    for ignored in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_IGN)
    models = {int(id_): model(name) for id_, name in settings["models"].items()}
    # The driver has the port, too.
    with Bus(**settings["port"], models=models, exclusive=False) as bus:
        os.write(1, READY)
        hangs = True
        while select.select([0], [], [], settings["silence"])[0]:
            received = os.read(0, 4096)
            if QUIT in received:
                return
            if GIVES_UP in received or not received:
                hangs = False
                break
            with suppress(OSError):
                os.write(1, READY)
        if not hangs and not received:
            # No other program may come between.
            bus.port.lock()
            time.sleep(settings["hold"])
        _keep_switching_off(bus, sorted(models), hangs)


def _keep_switching_off(bus: Bus, ids: list[int], hangs: bool) -> None:
    """Send torque off until it is confirmed, or the port is gone.

    While another program of phasmid has the port open, nothing is sent, unless that is the driver
    that hangs.
    """
    while not bus.port.is_gone() and (ids := switch_torque_off(bus, ids, RETRY_TIME)):
        bus.port.unlock()
        time.sleep(RETRY_PAUSE)
        while not (hangs or bus.port.lock()):
            time.sleep(RETRY_PAUSE)
        # Others may open it.
        bus.port.unlock()


if __name__ == "__main__":
    main()
