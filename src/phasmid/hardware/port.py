"""A serial port for the maker's library, which waits without using the processor.

This module imports the library, of the extra ``hardware``.
"""

from __future__ import annotations

import errno
import os
import time
from contextlib import suppress
from typing import TYPE_CHECKING

import serial
from serial.tools import list_ports

from phasmid.hardware.bus import PortLost

if TYPE_CHECKING:

    class PortHandler:
        """What `Port` has of the library's port, which has no types."""

        is_open: bool
        is_using: bool
        port_name: str
        ser: serial.Serial

        def __init__(self, port_name: str) -> None: ...

else:
    from dynamixel_sdk import PortHandler

try:
    import termios
except ModuleNotFoundError:
    # Windows
    FAILURES: tuple[type[Exception], ...] = OSError, ValueError
else:
    FAILURES = OSError, ValueError, termios.error
"""Errors of a port that fails, or cannot be opened."""

READ_TIMEOUT = 1e-3
"""Longest time that a read waits for its bytes [s]."""

WRITE_TIMEOUT = 0.1
"""Longest time in which the system must take a packet [s]. A packet takes 5 ms at 57,600 baud; an
adapter that hangs takes none, and must not block the driver."""

TERMINALS = "/dev/pts/", "/dev/ttys"
"""Beginnings of the names of pseudo-terminals on Linux and macOS, such as those of emulated servos.
The system gives a name to another terminal later, such as the user's shell."""

BABBLE_TIME = 0.25
"""Time after the deadline of an answer from which on nothing is read [s]. The library reads packets
of other devices for as long as they come. On a busy machine an answer may wait in the system for
0.1 s."""

LONGEST_DRAIN = 0.5
"""Time after which a line that is never silent is used again [s]."""


class Port(PortHandler):
    """A serial port.

    Args:
        path: The port.
        baud: Baud rate [1/s].
        exclusive: Whether no other process may open it.

    Attributes:
        patience: Time for which an answer is awaited [s].
    """

    def __init__(self, path: str, baud: int, *, exclusive: bool = True) -> None:
        super().__init__(path)
        self.baudrate, self.patience = baud, 0.05
        self._deadline, self._exclusive = 0.0, exclusive
        self._device = device_of(path)
        self.setupPort(baud)

    def setupPort(self, cflag_baud: int) -> bool:
        """Open the port; the library calls it too."""
        if self.is_open:
            self.closePort()
        self.ser = serial.Serial(
            self.port_name,
            cflag_baud,
            timeout=READ_TIMEOUT,
            write_timeout=WRITE_TIMEOUT,
            exclusive=self._exclusive,
        )
        self.is_open = True
        self.ser.reset_input_buffer()
        return True

    def closePort(self) -> None:
        """Close the port; the library calls it too."""
        with suppress(*FAILURES):
            # The system waits for up to 30 s until an adapter has taken what was written.
            self.ser.reset_output_buffer()
        self.ser.close()
        self.is_open = False

    def reopen(self) -> None:
        """Close the port, and open it anew by its path.

        Raises:
            PortLost: It cannot be opened, or the path may be that of another device.
        """
        device, was_terminal = device_of(self.port_name), self._device.startswith(TERMINALS)
        # The name of a pseudo-terminal is another one later; an adapter must be the same one.
        if (device == self._device) == was_terminal:
            raise PortLost(self.port_name, f"{device} is another device")
        self.closePort()
        self.is_using = False
        try:
            self.setupPort(self.baudrate)
        except FAILURES as error:
            raise self._failure(error) from error
        self._device = device

    def is_gone(self) -> bool:
        """Return whether the port is a pseudo-terminal that has ended."""
        if not self.port_name.startswith(TERMINALS):
            return False
        try:
            termios.tcgetattr(self.ser.fileno())
        except FAILURES:
            return True
        return False

    def lock(self) -> bool:
        """Keep other programs of phasmid from opening the port; return False where one has it."""
        import fcntl

        if self.ser.is_open:
            try:
                fcntl.flock(self.ser.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                return False
        return True

    def unlock(self) -> None:
        """Let other programs of phasmid open the port."""
        import fcntl

        if self.ser.is_open:
            fcntl.flock(self.ser.fileno(), fcntl.LOCK_UN)

    def _failure(self, error: Exception) -> PortLost:
        """Return the error of a port that fails; the next packet may be sent all the same."""
        self.is_using = False
        return PortLost(self.port_name, str(error))

    def clearPort(self) -> None:
        """Drop what has arrived before a request: answers to earlier ones.

        The library's own waits until all is sent, which a lost port never ends.
        """
        with suppress(*FAILURES):
            self.ser.reset_input_buffer()

    def readPort(self, length: int) -> bytes:
        """Read bytes that arrive before the timeout.

        Raises:
            PortLost: The port fails.
        """
        if time.monotonic() > self._deadline + BABBLE_TIME:
            return b""
        return self._read(length)

    def _read(self, length: int) -> bytes:
        try:
            return bytes(self.ser.read(length))
        except FAILURES as error:
            raise self._failure(error) from error

    def writePort(self, packet: bytes) -> int:
        """Write bytes.

        Raises:
            PortLost: The port fails, or takes no packet.
        """
        try:
            return int(self.ser.write(packet) or 0)
        except FAILURES as error:
            raise self._failure(error) from error

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: ARG002
        """Begin to wait for an answer: as long as `patience`, whatever the library thinks."""
        self._deadline = time.monotonic() + self.patience

    def setPacketTimeoutMillis(self, msec: float) -> None:
        """Begin to wait for an answer for a time [ms]."""
        self._deadline = time.monotonic() + msec / 1000

    def isPacketTimeout(self) -> bool:
        """Return whether the time for an answer is over."""
        return time.monotonic() > self._deadline

    def drain(self, silence: float) -> None:
        """Drop what arrives, until there has been silence for a time [s]."""
        begin = last = time.monotonic()
        while time.monotonic() - last < silence and last - begin < LONGEST_DRAIN:
            if self._read(256):
                last = time.monotonic()


def device_of(path: str) -> str:
    """Return what a port's path names: its USB adapter, or else its device file.

    An adapter is told by its maker's numbers and its serial number, or else its USB socket.
    """
    device = os.path.realpath(path)
    for port in list_ports.comports():
        if port.device == device and port.vid is not None:
            number = port.serial_number or port.location
            return f"USB {port.vid:04x}:{port.pid:04x} {number}"
    return device


def open_error(path: str, error: Exception) -> str:
    """Return one sentence on why a port could not be opened."""
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return f"there is no port {path}."
    if number == errno.EACCES:
        return f"{path} may not be opened by this user; add the user to the group dialout."
    if number in (errno.EAGAIN, errno.EBUSY) or "lock" in str(error):
        return f"{path} is open in another process; a bus has one owner."
    return f"{path} cannot be opened as a serial port: {error}."
