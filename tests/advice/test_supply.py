"""Currents, battery, wire and fuse: by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from phasmid.advice import Currents, Wiring, advise
from phasmid.advice.bounds import Postures, StaticLoads
from phasmid.advice.supply import (
    CELL_RESISTANCE,
    FUSES,
    REGULATOR_EFFICIENCY,
    USABLE,
    WIRES,
    currents,
    supply,
)
from phasmid.errors import InvalidInput
from phasmid.robot import load_robot
from phasmid.scenario import Scenario
from phasmid.servo import load_servo

SERVO = replace(
    load_servo("XL430-W250"),
    rated_voltage=12.0,
    maximum_voltage=12.0,
    rated_stall_torque=6.0,
    rated_no_load_speed=6.0,
    stall_current=3.0,
    friction=0.0,
    viscous_friction=0.0,
    external_loss=0.0,
    stribeck_friction=0.0,
    stribeck_load_loss=0.0,
    stribeck_external_loss=0.0,
    quadratic_load_loss=0.0,
    quadratic_external_loss=0.0,
    standby_current=0.05,
)
"""A servo without friction, with 4 Ω, 2 N·m/A and 2 V·s/rad."""

QUADRUPED = replace(load_robot("quadruped"), servo=SERVO)

AX = Scenario(robot="phantomx-ax")


def two_postures(first, second, help_share, robot=QUADRUPED, margin=0.1):
    """Loads of all twelve joints: in the walk at 0.5 rad/s, and standing [N·m]."""
    shape = (2, 4, 3)
    torque = np.broadcast_to(np.array([first, second])[:, None, None], shape)
    speed = np.broadcast_to(np.array([-0.5, 0.0])[:, None, None], shape)
    postures = Postures(
        q=np.zeros(shape),
        qd=speed,
        stance=np.ones((2, 4), dtype=bool),
        phase=np.array([0.0, math.nan]),
        weight=np.array([1.0, 0.0]),
        fastest=np.full((4, 3), 0.5),
    )
    loads = StaticLoads(robot, postures, 0.7, None, None, None, np.full(2, margin))
    # In place of those that it would compute.
    vars(loads)["torque"] = np.stack([torque, help_share * torque])
    return loads


def test_currents_of_a_servo_with_simple_numbers():
    # 1 N·m at 0.5 rad/s: 0.5 A in 4 Ω take 1 W, the motor gives 0.5 W. Twelve joints: 18 W of 12 V,
    # and 0.6 A for their electronics. 2 N·m at rest: 1 A and 4 W each. With help half of the
    # torque, a quarter of the loss, and no power of joints that hold.
    found = currents(two_postures(1.0, 2.0, 0.5), SERVO, 12.0)
    assert found.mean == found.walking == pytest.approx((1.5 + 0.6, 0.25 + 0.6), rel=1e-9)
    assert found.rising == pytest.approx((4.0 + 0.6, 1.0 + 0.6), rel=1e-9)
    assert found.largest == pytest.approx(4.6)
    assert (found.stall, found.leg_stall) == pytest.approx((36.0, 9.0))
    assert found.to_carry == pytest.approx(13.6)
    # Half of the voltage: twice the current for the same power, half of the stall current.
    low = currents(two_postures(1.0, 2.0, 0.5), SERVO.at(6.0), 6.0)
    assert low.rising == pytest.approx((8.0 + 0.6, 2.0 + 0.6), rel=1e-9)
    assert low.stall == pytest.approx(18.0)
    # A full battery has a larger stall current.
    full = currents(two_postures(1.0, 2.0, 0.5), SERVO, 16.0)
    assert full == replace(found, stall=pytest.approx(48.0), leg_stall=pytest.approx(12.0))
    # No servo takes more than at stall, whatever the load.
    stalled = currents(two_postures(1.0, 99.0, 1.0), SERVO, 12.0)
    assert stalled.rising[0] == pytest.approx(36.0 + 0.6)


def test_without_a_stall_current_or_stability_no_current_is_known():
    unknown = replace(SERVO, stall_current=None)
    assert currents(two_postures(1.0, 2.0, 0.5), unknown, 12.0) is None
    assert currents(two_postures(1.0, 2.0, 0.5, margin=-0.1), SERVO, 12.0) is None


def test_a_joint_of_two_servos_takes_twice_the_current():
    legs = tuple(replace(leg, strength=np.full(3, 2.0)) for leg in QUADRUPED.legs)
    double = currents(two_postures(2.0, 4.0, 1.0, replace(QUADRUPED, legs=legs)), SERVO, 12.0)
    single = currents(two_postures(1.0, 2.0, 1.0), SERVO, 12.0)
    assert double.mean[0] - 0.6 == pytest.approx(2 * (single.mean[0] - 0.6), rel=1e-12)
    assert double.stall == pytest.approx(2 * single.stall)


def test_three_cells_and_a_wire_by_hand():
    """Nearly empty cells of 3.3 V less the drop over 2 × 0.3 m of 0.75 mm² and 3 × 10 mΩ.

    The current is that at the voltage which is left; rounding is down to 10 mV.
    """
    wiring = Wiring(cells=3, wire_area=0.75e-6, wire_length=0.3)
    resistance = 2 * 0.3 * 0.020e-6 / 0.75e-6 + 3 * 0.010
    servo = load_servo("AX-12A")
    assert wiring.resistance(servo) == pytest.approx(resistance, rel=1e-12)
    found = advise(AX, wiring=wiring)
    drop = found.currents.largest * resistance
    assert 0.05 < drop < 0.2
    assert found.verdict.voltage == math.floor(100 * (9.9 - drop)) / 100
    # It takes the same power of that voltage.
    taken = currents(found.loads, servo.at(found.verdict.voltage), 12.6)
    assert found.currents.largest == pytest.approx(taken.largest, rel=1e-12)
    assert found.experiment.robot.servo.voltage == found.verdict.voltage
    assert (found.supply.cells, found.supply.regulator) == (3, None)
    # The battery to buy is the same whether it is named or not; its sag counts when it is.
    unnamed = advise(AX)
    assert found.currents.largest > unnamed.currents.largest
    assert replace(unnamed.supply, wire_drop=0, minutes=0) == replace(
        found.supply, wire_drop=0, minutes=0
    )
    # It stalls the servos of a leg when it is full, at 12.6 V.
    assert found.currents.leg_stall == pytest.approx(3 * 12.6 / servo.motor.resistance)
    # A quarter of the capacity has four times the resistance.
    small = replace(wiring, capacity=0.55)
    assert small.resistance(servo) - resistance == pytest.approx(3 * 3 * CELL_RESISTANCE)
    assert advise(AX, wiring=small).verdict.stall_torque < found.verdict.stall_torque
    assert advise(AX).verdict.voltage == 12


def test_cells_of_too_high_a_voltage_get_a_regulator():
    # Three full cells have 12.6 V; an MG996R stands 7.2 V.
    wiring = Wiring(cells=3)
    found = advise(AX.replace(servo="MG996R"), wiring=wiring)
    assert wiring.battery(load_servo("MG996R")) == (3, False)
    assert found.verdict.voltage == found.supply.regulator == 6
    assert found.supply.cells == 3
    # 2 cells have 6.6 V when they are nearly empty; a regulator takes 0.5 V of it.
    few = advise(AX.replace(servo="DS3218"), wiring=Wiring(cells=2))
    assert few.verdict.voltage == few.supply.regulator == pytest.approx(6.1)
    # A supply above the highest voltage of the data sheet makes no current look smaller.
    high = Wiring().voltages(load_servo("MG996R").at(12.0))
    assert high == (7.2, 7.2)


def needed(largest, leg_stall=6.0, stall=30.0):
    return Currents((largest, 1.0), (largest, 1.0), (0.0, 0.0), stall, leg_stall)


def test_fuse_and_wire_carry_a_caught_leg_beside_the_walk():
    # 4 A and 6 A: the next fuse is one of 10 A, and 1.5 mm² carry 12 A. 20 A open the fuse.
    found = supply(SERVO, needed(4.0), Wiring())
    assert (found.fuse, found.leg_fuse, found.wire_area) == (10, 7.5, 1.5e-6)
    assert found.leg_area == 0.75e-6
    assert found.wire_drop == pytest.approx(4 * 2 * 0.3 * 0.020e-6 / 1.5e-6, rel=1e-12)
    assert found.c_rating == math.ceil(20 / 2.2)
    minutes = 60 * USABLE * 2.2
    assert found.minutes == pytest.approx((minutes / 4, minutes / 1), rel=1e-12)
    # Over 5 m the drop decides: 3 % of 9.9 V at 4 A are 74 mΩ, and 2.7 mm² of copper.
    longer = supply(SERVO, needed(4.0), Wiring(wire_length=5.0))
    assert (longer.fuse, longer.wire_area) == (10, 4e-6)
    # Nothing usual carries 40 A.
    assert supply(SERVO, needed(34.1), Wiring()) is None
    # Every fuse has a wire that carries it.
    assert max(FUSES) <= max(WIRES.values())


def test_a_regulator_carries_the_servos_and_the_fuse_the_battery():
    # Two full cells have 8.4 V, above the 7.2 V of an MG996R. 10 A at 6 V take 10.1 A of 6.6 V with
    # an efficiency of 0.9; on average 4 A take 3.6 A of 7.4 V.
    found = supply(load_servo("MG996R"), needed(4.0), Wiring())
    assert (found.cells, found.regulator, found.regulator_current) == (2, 6.0, 10)
    assert (found.fuse, found.wire_area) == (15, 1.5e-6)
    drawn = 4 * 6 / (7.4 * REGULATOR_EFFICIENCY)
    assert found.minutes[0] == pytest.approx(60 * USABLE * 2.2 / drawn)


@pytest.mark.parametrize(("name", "cells"), [("AX-12A", 3), ("LX-16A", 2), ("STS3215", 3)])
def test_a_battery_that_fits_the_servo_needs_no_regulator(name, cells):
    # Three full cells have 12.6 V, 5 % above 12 V.
    found = supply(load_servo(name), needed(4.0), Wiring())
    assert (found.cells, found.regulator, found.regulator_current) == (cells, None, 0)


@pytest.mark.parametrize(
    ("name", "voltage", "cells"), [("LX-16A", 5.0, 2), ("AX-12A", 9.2, 3), ("AX-12A", 8.4, 2)]
)
def test_a_full_battery_has_the_voltage_of_the_verdict(name, voltage, cells):
    assert Wiring().battery(load_servo(name).at(voltage)) == (cells, True)


@pytest.mark.parametrize(
    ("numbers", "what"),
    [
        ({"cells": 0}, "cells is 0; it must be from 1 to 14."),
        ({"cells": 15}, "cells is 15; it must be from 1 to 14."),
        ({"cells": 2.5}, "cells is 2.5; it must be a whole number."),
        ({"capacity": 0.0}, "capacity is 0; it must be from 0.01 to 1000."),
        ({"capacity": math.nan}, "capacity is nan; it must be from 0.01 to 1000."),
        ({"wire_area": 0.0}, "wire_area is 0; it must be from 3e-08 to 0.0001."),
        ({"wire_length": -0.1}, "wire_length is -0.1; it must be from 0 to 20."),
    ],
)
def test_a_number_out_of_range_is_refused_in_one_sentence(numbers, what):
    with pytest.raises(InvalidInput) as caught:
        Wiring(**numbers)
    assert caught.value.what == what


def test_a_wire_that_leaves_nothing_is_refused_with_a_way_out():
    thin = Wiring(wire_area=0.03e-6, wire_length=20.0)
    with pytest.raises(InvalidInput, match="no servo works on the rest") as caught:
        advise(AX, wiring=thin)
    assert "a larger --wire-mm2" in caught.value.hint
