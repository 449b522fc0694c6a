"""The second process, which switches the torque off after the driver's process: in real time."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

import pytest

from phasmid.errors import InvalidInput
from phasmid.hardware import Bus, Emulator, make_servos, model
from phasmid.hardware.torque_off import torque_off_after_exit
from support.cable import Cable, is_off, runs, wait
from support.virtual_bus import FollowingPlant

pytest.importorskip("dynamixel_sdk")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

IDS = [1, 2, 3]

HOLDER = """
import sys, time
from phasmid.hardware import Bus
from phasmid.hardware.torque_off import torque_off_after_exit
port, protocol, gives_up = sys.argv[1], int(sys.argv[2]), sys.argv[3]
with Bus(port, protocol=protocol) as bus:
    ids = [1, 2, 3]
    while len(bus.models) < 3:
        # On a busy machine an answer may be late.
        bus.scan(ids)
    with torque_off_after_exit(bus, ids, 0.3, 5.0) as second:
        for id_ in ids:
            while not bus.write_once(id_, "torque_enable", 1.0):
                pass
        print(second.pid, flush=True)
        while gives_up == "no":
            second.alive()
            time.sleep(0.02)
        sys.stdin.read()
"""
"""Holds the torque of three servos: until it is killed, or its input ends."""


@contextmanager
def held(tmp_path, name="AX-12A", *, gives_up=False):
    """Yield servos whose torque is on, their cable, the holder and the second process's number."""
    servos = make_servos(name, IDS, baud=1_000_000)
    emulator = Emulator(servos, FollowingPlant(len(IDS)))
    with emulator, Cable(tmp_path / "port", emulator.port) as cable:
        arguments = [str(cable.path), str(servos[0].protocol), "yes" if gives_up else "no"]
        with subprocess.Popen(
            [sys.executable, "-P", "-c", HOLDER, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        ) as holder:
            second = 0
            try:
                second = int(holder.stdout.readline())
                assert all(servo["torque_enable"] for servo in servos)
                yield servos, cable, holder, second
            finally:
                holder.kill()
                if second and runs(second):
                    os.kill(second, signal.SIGKILL)


@pytest.mark.parametrize("name", ["AX-12A", "XL430-W250"])
def test_torque_is_off_after_the_driver_was_killed(tmp_path, name):
    with held(tmp_path, name) as (servos, _, holder, second):
        holder.kill()
        wait(lambda: is_off(servos) and not runs(second))


@pytest.mark.parametrize("fault", ["broken line", "unplugged adapter"])
def test_it_goes_on_until_the_bus_is_repaired(tmp_path, fault):
    with held(tmp_path) as (servos, cable, holder, second):
        if fault == "broken line":
            cable.is_cut = True
        else:
            cable.unplug()
        holder.kill()
        # 0.3 s of hold and the first attempts of 0.9 s.
        with pytest.raises(subprocess.TimeoutExpired):
            subprocess.run(["tail", f"--pid={second}", "-f", "/dev/null"], timeout=2.5, check=False)
        assert not is_off(servos)
        cable.is_cut = False
        if fault == "unplugged adapter":
            cable.plug()
        wait(lambda: is_off(servos) and not runs(second))


def test_it_goes_on_where_the_driver_gives_up(tmp_path):
    with held(tmp_path, gives_up=True) as (servos, cable, holder, second):
        cable.is_cut = True
        holder.stdin.close()
        assert holder.wait() == 0
        assert runs(second)
        assert not is_off(servos)
        cable.is_cut = False
        wait(lambda: is_off(servos) and not runs(second))


def test_it_waits_while_another_program_has_the_port_open(tmp_path):
    with held(tmp_path) as (servos, cable, holder, second):
        cable.is_cut = True
        holder.kill()
        holder.wait()
        # For the first attempts the second process keeps others out.
        with opened(cable.path):
            # An attempt that had begun ends within 0.5 s.
            time.sleep(1.0)
            cable.is_cut = False
            time.sleep(2.0)
            assert not is_off(servos)
            assert runs(second)
        wait(lambda: is_off(servos) and not runs(second))


def opened(path):
    """Open a port as soon as it is free; between two attempts another process may open it."""
    buses = []

    def attempt():
        with suppress(InvalidInput):
            buses.append(Bus(str(path)))
        return buses

    wait(attempt)
    return buses[0]


def test_a_stopped_second_process_does_not_block_the_driver(tmp_path):
    """The pipe takes 65,536 bytes."""
    with held(tmp_path) as (_, cable, _, _), Bus(str(cable.path), exclusive=False) as bus:
        bus.models[1] = model("AX-12A")
        with torque_off_after_exit(bus, [1], 0.3, 60.0) as second:
            os.kill(second.pid, signal.SIGSTOP)
            for _ in range(70_000):
                second.alive()
            wait(lambda: not second.alive())
            os.kill(second.pid, signal.SIGCONT)
            wait(second.alive)
            second.is_confirmed = True


def test_signals_do_not_reach_it(tmp_path):
    with held(tmp_path) as (servos, _, holder, second):
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
            os.kill(second, number)
            os.killpg(os.getpgid(second), number)
        holder.kill()
        wait(lambda: is_off(servos))
