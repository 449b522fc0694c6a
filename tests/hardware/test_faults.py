"""Faults of the emulated bus, its protection, and what a client sees of them."""

import numpy as np
import pytest

from phasmid.errors import InvalidInput
from phasmid.hardware import StatusError, make_servos
from phasmid.hardware.emulated_servo import Reading
from phasmid.hardware.faults import FaultSource, parse_fault
from phasmid.hardware.line import Line
from phasmid.hardware.packets import Instruction, Packet
from phasmid.hardware.status import status_error

NAMES = {1: "AX-12A", 2: "XL430-W250"}
BAUD = 1_000_000


def line_of(protocol, *faults, seed=0):
    source = FaultSource(faults, seed)
    return Line(make_servos(NAMES[protocol], [1, 2, 3], baud=BAUD), source), source


def ping(line, id_=1):
    return line.execute(Packet(id_, Instruction.PING), 0.0)


def read_packet(protocol, register, id_=1):
    address = register.address.to_bytes(protocol, "little")
    return Packet(id_, Instruction.READ, address + register.size.to_bytes(protocol, "little"))


@pytest.mark.parametrize("protocol", [1, 2])
def test_a_dead_servo_is_silent_for_its_time(protocol):
    line, source = line_of(protocol, "2 dead at 1 s for 2 s")
    heard = []
    for source.time in (0.5, 1.5, 3.5):
        heard.append(bool(ping(line, 2)))
        assert ping(line, 1)
    assert heard == [True, False, True]


@pytest.mark.parametrize("protocol", [1, 2])
def test_phantom_values_come_in_one_answer_of_five(protocol):
    line, _ = line_of(protocol, "1 phantom")
    packet = read_packet(protocol, line.servos[0].model.register("present_position"))
    answers = [line.execute(packet, 0.0)[0][1] for _ in range(1000)]
    true = max(set(answers), key=answers.count)
    # Binomial, five standard deviations: 5 sqrt(0.2 0.8 / 1000) = 0.063.
    assert 1 - answers.count(true) / 1000 == pytest.approx(0.2, abs=0.063)


def test_packets_are_lost_by_their_share_and_garbled_by_one_bit():
    def lost(seed):
        source = FaultSource(["lost 0.1"], seed)
        return [bool(source.happens("lost")) for _ in range(2000)]

    # Five standard deviations: 5 sqrt(0.1 0.9 / 2000) = 0.034.
    assert np.mean(lost(1)) == pytest.approx(0.1, abs=0.034)
    assert lost(1) == lost(1) != lost(2)
    packet = bytes(range(20))
    garbled = FaultSource(["garbled 1"]).garbled(packet)
    turned = [a ^ b for a, b in zip(packet, garbled, strict=True)]
    assert sum(bits.bit_count() for bits in turned) == 1


def test_a_fault_is_read():
    fault = parse_fault("late 0.25 by 30 ms at 2 s for 1 s")
    assert (fault.kind, fault.rate, fault.amount) == ("late", 0.25, 0.03)
    assert [fault.is_active(t) for t in (1.9, 2.0, 3.1)] == [False, True, False]


AX = make_servos("AX-12A", [1, 2], baud=BAUD)


@pytest.mark.parametrize(
    ("servos", "faults", "words"),
    [
        (AX, ["5 daed"], r'no fault of a bus(.|\n)*"dead"'),
        (AX, ["lost 2"], "must be 0 to 1"),
        (AX, ["7 dead"], "there is no servo 7; there are 1, 2"),
        (AX[:1] + AX[:1], [], "two servos have the id 1"),
        (AX[:1] + make_servos("XL430-W250", [2], baud=BAUD), [], "a bus needs one of them"),
        ([], [], "a bus has 1 to 253 servos; there are 0"),
    ],
)
def test_what_is_no_bus_is_refused(servos, faults, words):
    with pytest.raises(InvalidInput, match=words):
        Line(servos, FaultSource(faults))


def running(protocol):
    servo = make_servos(NAMES[protocol], [1], baud=BAUD)[0]
    servo.update(Reading(), 0.0)
    address = servo.model.register("torque_enable").address.to_bytes(protocol, "little")
    servo.handle(Packet(1, Instruction.WRITE, address + b"\1"), 0.0)
    assert servo.enabled
    return servo


def test_an_overloaded_ax_loses_its_torque_until_the_limit_is_written():
    servo = running(1)
    servo.update(Reading(overloaded=True), 1.0)
    assert (servo.enabled, servo["torque_limit"]) == (False, 0)
    assert servo.hardware_error() == StatusError.OVERLOAD
    assert servo.handle(Packet(1, Instruction.PING), 1.0).error == 0x20
    servo.update(Reading(), 2.0)
    assert servo.hardware_error() == StatusError.OVERLOAD
    # Torque limit 1023 at address 34.
    servo.handle(Packet(1, Instruction.WRITE, bytes([34, 255, 3])), 2.0)
    assert servo.enabled
    assert servo.handle(Packet(1, Instruction.PING), 2.0).error == 0


def test_an_overloaded_x_servo_alerts_until_it_is_rebooted():
    servo = running(2)
    servo.update(Reading(overloaded=True), 1.0)
    assert (servo["torque_enable"], servo["hardware_error_status"]) == (0, 0x20)
    servo.update(Reading(), 2.0)
    error = status_error(2, servo.handle(Packet(1, Instruction.PING), 2.0).error)
    assert error == StatusError.ALERT
    servo.handle(Packet(1, Instruction.REBOOT), 2.0)
    assert servo["hardware_error_status"] == 0
    assert servo.handle(Packet(1, Instruction.PING), 2.0).error == 0


@pytest.mark.parametrize("protocol", [1, 2])
@pytest.mark.parametrize(
    ("reading", "flag", "shuts_down"),
    [
        (Reading(temperature=80.0), StatusError.OVERHEATING, True),
        # The makers leave the supply out of what shuts a servo down.
        (Reading(voltage=15.0), StatusError.VOLTAGE, False),
        (Reading(voltage=5.0), StatusError.VOLTAGE, False),
    ],
)
def test_heat_and_supply_beyond_the_limits(protocol, reading, flag, shuts_down):
    servo = running(protocol)
    servo.update(reading, 1.0)
    assert servo.hardware_error() == flag
    assert servo.enabled is not shuts_down


def test_the_watchdog_of_an_x_servo_holds_it_and_locks_the_goal():
    servo = running(2)
    goal = servo.model.register("goal_position")

    def write_goal(value, now):
        data = goal.address.to_bytes(2, "little") + goal.to_bytes(value)
        return status_error(2, servo.handle(Packet(1, Instruction.WRITE, data), now).error)

    # 5 times 20 ms.
    servo.handle(Packet(1, Instruction.WRITE, bytes([98, 0, 5])), 0.0)
    assert write_goal(3000, 0.05) == StatusError(0)
    servo.update(Reading(), 0.14)
    assert servo["bus_watchdog"] == 5
    servo.update(Reading(position=goal.to_si(2500)), 0.2)
    assert (servo["bus_watchdog"], servo["goal_position"], servo.enabled) == (-1, 2500, True)
    assert write_goal(3000, 0.3) == StatusError.RANGE
    servo.handle(Packet(1, Instruction.WRITE, bytes([98, 0, 0])), 0.3)
    assert write_goal(3000, 0.3) == StatusError(0)
