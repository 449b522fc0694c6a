"""A cable to an emulated bus that can be cut and unplugged, and processes that use it."""

import os
import pty
import select
import termios
import threading
import time
import tty
from contextlib import suppress
from pathlib import Path

PATIENCE = 60.0
"""Longest time for anything on a busy machine [s]."""


class Cable:
    """A pseudo-terminal behind a link, whose bytes go to a port and back.

    Attributes:
        path: The link, as is that of a USB adapter in ``/dev/serial/by-id``.
        is_cut: Whether bytes are dropped in both directions, as with a broken data line.
    """

    def __init__(self, path, port):
        self.path, self.is_cut, self._ends = path, False, threading.Event()
        self._port = os.open(port, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._port)
        # Emulated servos receive nothing at another rate.
        mode = termios.tcgetattr(self._port)
        mode[4] = mode[5] = termios.B1000000
        termios.tcsetattr(self._port, termios.TCSANOW, mode)
        self._near = None
        self._name = ""
        self._lock = threading.Lock()
        self.plug()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def plug(self):
        """Make a new pseudo-terminal, and let the link name it."""
        near, far = pty.openpty()
        if os.ttyname(far) == self._name:
            # The name of the last one must not come again.
            ends = near, far
            near, far = pty.openpty()
            for end in ends:
                os.close(end)
        tty.setraw(far)
        self._name = os.ttyname(far)
        os.close(far)
        with self._lock:
            self._near = near
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(self._name)

    def unplug(self):
        """Close the pseudo-terminal; its path ends with it."""
        self.path.unlink()
        with self._lock:
            near, self._near = self._near, None
        if near is not None:
            os.close(near)

    def close(self):
        self._ends.set()
        self._thread.join()
        if self._near is not None:
            self.unplug()
        os.close(self._port)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _carry(self):
        while not self._ends.is_set():
            with self._lock:
                near = self._near
                if near is not None:
                    # Without a client the pseudo-terminal reads as lost.
                    with suppress(OSError):
                        for end in select.select([near, self._port], [], [], 0.002)[0]:
                            data = os.read(end, 4096)
                            if not self.is_cut:
                                os.write(self._port if end == near else near, data)
            time.sleep(1e-4 if near is not None else 0.01)


def wait(condition, process=None, lines=()):
    """Wait for a condition, for as long as a process runs, which has printed lines."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        assert process is None or process.poll() is None, "".join(lines)
        time.sleep(0.01)


def runs(pid):
    status = Path(f"/proc/{pid}/status")
    return status.exists() and "State:\tZ" not in status.read_text()


def is_off(servos):
    return not any(servo["torque_enable"] for servo in servos)
