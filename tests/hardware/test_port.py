"""Serial ports that fail, change or never fall silent; pseudo-terminals stand for adapters."""

import os
import threading
from contextlib import suppress
from types import SimpleNamespace

import pytest

from phasmid.hardware import Bus, model
from phasmid.hardware.bus import PortLost
from phasmid.hardware.packets import status_packet

pytest.importorskip("dynamixel_sdk")
pty = pytest.importorskip("pty")


@pytest.fixture
def ends():
    """The adapter's end of a line, and the path of the port."""
    master, slave = pty.openpty()
    yield master, os.ttyname(slave)
    os.close(slave)
    os.close(master)


def test_a_port_that_takes_no_bytes_fails_in_time(ends):
    """A pseudo-terminal that nobody reads takes 4 kB, as an adapter that hangs does."""

    def fill(bus):
        for _ in range(100):
            bus.port.writePort(bytes(1000))

    with Bus(ends[1]) as bus, pytest.raises(PortLost):
        fill(bus)


def test_another_adapter_with_the_same_path_is_not_opened(ends, monkeypatch):
    adapter = SimpleNamespace(
        device=ends[1], vid=0x0403, pid=0x6014, serial_number="A", location="1"
    )
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [adapter])
    with Bus(ends[1]) as bus:
        bus.port.reopen()
        adapter.serial_number = "B"
        with pytest.raises(PortLost, match="6014 B is another device"):
            bus.port.reopen()


def test_a_device_that_never_stops_talking_does_not_block_a_reading(ends):
    """Intact packets of servo 9 come without an end, while servo 1 is read."""
    os.set_blocking(ends[0], False)
    ended = threading.Event()

    def talk():
        while not ended.is_set():
            with suppress(BlockingIOError):
                os.write(ends[0], 10 * status_packet(1, 9, 0, b"\1"))

    thread = threading.Thread(target=talk)
    with Bus(ends[1], models={1: model("AX-12A")}) as bus:
        thread.start()
        assert bus.read_all([1], ["torque_enable"])[1] is None
        ended.set()
        thread.join()
