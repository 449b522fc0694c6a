"""A serial port for the maker's library, which waits without using the processor.

This module imports the library, of the extra ``hardware``.
"""

from __future__ import annotations

import errno
import time

import serial
from dynamixel_sdk import PortHandler

from phasmid.hardware.bus import PortLost

READ_TIMEOUT = 1e-3
"""Longest time that a read waits for its bytes [s]."""

LONGEST_DRAIN = 0.5
"""Time after which a line that is never silent is used again [s]."""


class Port(PortHandler):  # type: ignore[misc]
    """A serial port that this process alone has open.

    Args:
        path: The port.
        baud: Baud rate [1/s].

    Attributes:
        patience: Time for which an answer is awaited [s].
    """

    is_open: bool

    def __init__(self, path: str, baud: int) -> None:
        super().__init__(path)
        self.baudrate, self.patience = baud, 0.05
        self._deadline = 0.0
        self.setupPort(baud)

    def setupPort(self, cflag_baud: int) -> bool:
        """Open the port; the library calls it too."""
        if self.is_open:
            self.closePort()
        self.ser = serial.Serial(self.port_name, cflag_baud, timeout=READ_TIMEOUT, exclusive=True)
        self.is_open = True
        self.ser.reset_input_buffer()
        return True

    def clearPort(self) -> None:
        """Do nothing: the library waits here until all is sent, which a lost port never ends."""

    def readPort(self, length: int) -> bytes:
        """Read bytes that arrive before the timeout.

        Raises:
            PortLost: The adapter is gone.
        """
        try:
            return bytes(self.ser.read(length))
        except OSError as error:
            raise PortLost(self.port_name) from error

    def writePort(self, packet: bytes) -> int:
        """Write bytes.

        Raises:
            PortLost: The adapter is gone.
        """
        try:
            return int(self.ser.write(packet) or 0)
        except OSError as error:
            raise PortLost(self.port_name) from error

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
            if self.readPort(256):
                last = time.monotonic()


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
