"""Emulated servos behind a port: official clients, and the bus of phasmid, talk to them."""

import math
import sys
import time

import pytest

from phasmid.errors import InvalidInput
from phasmid.hardware import (
    Bus,
    BusError,
    Emulator,
    SimulatedRobot,
    StatusError,
    default_calibration,
    make_servos,
    model,
)
from phasmid.scenario import load_scenario

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

BAUD = 1_000_000


def emulated(name, ids=(1, 2, 3), **settings):
    servos = make_servos(name, ids, baud=settings.pop("baud", BAUD))
    for servo in servos:
        servo["return_delay_time"] = 0
    return Emulator(servos, latency=1e-3, **settings)


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Let all clients wait longer than a busy machine takes."""
    handler = pytest.importorskip("dynamixel_sdk.port_handler")
    monkeypatch.setattr(handler, "LATENCY_TIMER", 500)
    monkeypatch.setattr("phasmid.hardware.bus.ANSWER_MARGIN", 0.5)
    monkeypatch.setattr("phasmid.hardware.bus.PING_MARGIN", 0.3)


def settled(read, goal, tolerance, within=5.0):
    """Wait until a reading is near a goal; return whether it came there."""
    end = time.monotonic() + within
    while time.monotonic() < end:
        if abs(read() - goal) <= tolerance:
            return True
        time.sleep(0.02)
    return False


@pytest.mark.parametrize(
    ("name", "protocol", "goal_at", "enable_at", "position_at", "size", "goal"),
    [
        ("AX-12A", 1.0, 30, 24, 36, 2, 700),
        ("MX-28", 1.0, 30, 24, 36, 2, 2600),
        ("XL430-W250", 2.0, 116, 64, 132, 4, 2600),
    ],
)
def test_the_makers_library_moves_a_servo(
    name, protocol, goal_at, enable_at, position_at, size, goal
):
    sdk = pytest.importorskip("dynamixel_sdk")
    with emulated(name) as emulator:
        port, packets = sdk.PortHandler(emulator.port), sdk.PacketHandler(protocol)
        assert port.openPort()
        assert port.setBaudRate(BAUD)
        try:
            number, result, error = packets.ping(port, 2)
            assert (number, result, error) == (model(name).number, 0, 0)
            if protocol == 2.0:
                found, result = packets.broadcastPing(port)
                assert found == {i: [1060, 45] for i in (1, 2, 3)}
            middle = model(name).register("goal_position").zero
            write, read = (
                (packets.write2ByteTxRx, packets.read2ByteTxRx)
                if size == 2
                else (packets.write4ByteTxRx, packets.read4ByteTxRx)
            )
            assert read(port, 2, position_at) == (middle, 0, 0)
            assert packets.write1ByteTxRx(port, 2, enable_at, 1) == (0, 0)
            assert write(port, 2, goal_at, goal) == (0, 0)
            # Beyond the limits of the table: an angle limit error, a limit error.
            assert write(port, 2, goal_at, 4096)[1] == (2 if protocol == 1.0 else 6)
            # Gravity and friction hold a servo without integral gain back.
            near = 0.02 * 2 * middle
            assert settled(lambda: read(port, 2, position_at)[0], goal, near)
            if protocol == 2.0:
                group = sdk.GroupSyncRead(port, packets, position_at, size)
                assert all(group.addParam(i) for i in (1, 2, 3))
                assert group.txRxPacket() == 0
                assert abs(group.getData(2, position_at, size) - goal) <= near
        finally:
            port.closePort()


@pytest.mark.parametrize(
    ("name", "controller", "raw"),
    [
        ("AX-12A", "AxPyController", "raw_"),
        ("MX-28", "MxPyController", "raw_"),
        ("XL430-W250", "Xl430PyController", ""),
    ],
)
def test_rustypot_finds_reads_and_moves_servos(name, controller, raw):
    rustypot = pytest.importorskip("rustypot")
    table = model(name)
    with emulated(name) as emulator:
        client = getattr(rustypot, controller)(emulator.port, BAUD, 2.0)
        found = {}
        # Its pings wait for a few milliseconds, whatever the machine does.
        assert settled(lambda: found.update(client.scan(range(1, 5))) or len(found), 3, 0)
        assert found == dict.fromkeys((1, 2, 3), table.number)
        read, write = (
            getattr(client, f"{verb}_{raw}{register}_position")
            for verb, register in (("read", "present"), ("sync_write", "goal"))
        )
        middle = table.register("goal_position").zero
        assert read(1)[0] == middle
        for id_ in (1, 2, 3):
            client.write_torque_enable(id_, True)
        if table.reads == "sync":
            assert client.sync_read_present_position([1, 2, 3]) == [middle] * 3
        way = middle // 5
        write([1, 2, 3], [middle + way, middle - way, middle])
        assert settled(lambda: read(1)[0], middle + way, way / 5)
        assert settled(lambda: read(2)[0], middle - way, way / 5)


@pytest.fixture(params=["AX-12A", "MX-28", "XL430-W250"])
def pair(request):
    """An emulator and a bus on its port."""
    pytest.importorskip("dynamixel_sdk")
    with emulated(request.param) as emulator:
        protocol = model(request.param).protocol
        with Bus(emulator.port, BAUD, protocol, latency=1e-3) as bus:
            yield emulator, bus


def test_the_bus_scans_reads_and_moves(pair):
    emulator, bus = pair
    name = emulator.servos[0].model.name
    assert bus.scan(range(1, 5)) == {i: model(name) for i in (1, 2, 3)}
    for id_ in (1, 2, 3):
        bus.write(id_, "torque_enable", 1)
    bus.write_all("goal_position", {1: 0.3, 2: -0.3, 3: 0.1})
    assert settled(lambda: bus.read(1, "present_position"), 0.3, 0.1)
    readings = bus.read_all([1, 2, 3])
    assert [readings[i].values["present_voltage"] for i in (1, 2, 3)] == [12.0] * 3
    assert readings[2].values["present_position"] == pytest.approx(-0.3, abs=0.1)
    assert all(reading.error == StatusError(0) for reading in readings.values())
    with pytest.raises(BusError, match=r"servo 1 refuses writing .* limit"):
        bus.write(1, "goal_position", math.pi + 0.1)
    with pytest.raises(BusError, match="no servo with the id 9 answers"):
        bus.read(9, "present_position")
    with pytest.raises(InvalidInput, match='no register "present_positon"'):
        bus.read(1, "present_positon")
    with pytest.raises(InvalidInput, match="one owner"):
        Bus(emulator.port, BAUD)
    emulator.servo(2)["baud_rate"] = emulator.servo(2).model.baud_value(57_600)
    assert sorted(bus.scan([1, 2, 3])) == [1, 3]


def test_a_late_answer_is_not_taken_for_the_next(pair):
    emulator, bus = pair
    bus.scan([1, 2])
    emulator.add_fault("late 1 by 30 ms for 0.4 s")
    with pytest.raises(BusError, match="servo 1, reading return_delay_time: "):
        bus.read(1, "return_delay_time")
    time.sleep(0.5)
    assert bus.read(1, "id") == 1.0
    assert bus.read(2, "id") == 2.0
    assert bus.traffic.lost >= 1


def test_a_simulated_robot_stands_up_behind_a_port():
    """Limp legs give way; switched on, the servos lift the trunk by most of its height."""
    pytest.importorskip("dynamixel_sdk")
    scenario = load_scenario("paper").replace(robot="phantomx-ax")
    robot = scenario.load_robot()
    rows = default_calibration(robot, model("AX-12A"))
    plant = SimulatedRobot(scenario, rows)
    standing = {row.id: float(q) for row, q in zip(rows, plant.position, strict=True)}
    servos = make_servos("AX-12A", [row.id for row in rows], baud=BAUD, servo=robot.servo)
    with Emulator(servos, plant) as emulator, Bus(emulator.port, BAUD, 1, latency=1e-3) as bus:
        for row in rows:
            bus.models[row.id] = model("AX-12A")
        qpos = plant.run.data.qpos
        # The trunk, 50 mm high, lies on the ground, and then stands 100 mm above its feet.
        assert settled(lambda: qpos[2], 0.025, 0.01)
        bus.write_all("goal_position", standing)
        assert settled(lambda: qpos[2], 0.1, 0.02)
