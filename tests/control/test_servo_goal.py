"""Servos without torque input give the torque that is fed forward."""

from __future__ import annotations

from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

from phasmid.control.dynamics.servo_goal import goal_numbers, goals_for_torque
from phasmid.robot import load_robot
from simulation.servo_bench import Bench

AX = load_robot("phantomx-ax").servo
PID = replace(AX, law="pid", p_gain=800.0)


def goal(servo, q, qd, torque, voltage=12.0):
    numbers = goal_numbers(servo, voltage)
    return float(goals_for_torque(*np.array([[q], [qd], [torque]]), numbers)[0])


@pytest.mark.parametrize("servo", [AX, PID], ids=["compliance", "pid"])
@pytest.mark.parametrize("voltage", [9.0, 12.0])
@pytest.mark.parametrize("qd", [-2.0, -0.5, 0.5, 2.0])
def test_a_turning_servo_gives_the_torque_that_is_fed_forward(servo, voltage, qd) -> None:
    # Motor: k i = d V k / R - k² w / R; of it the gears lose c1 |k i| + c0 against the motion, and
    # b w. The law sees whole ticks of goal and angle, so the output misses by up to one tick of
    # slope: 1/32 of full output for AX (1/885 * 6.25 for PID), hence that share of the stall push.
    for torque in (-0.6, -0.2, 0.3, 0.7):
        numbers = goal_numbers(servo, voltage)
        wanted = goal(servo, 0.0, qd, torque, voltage)
        error = wanted / servo.resolution
        duty = _output(servo, error)
        motor = servo.motor
        push = motor.constant * (duty * voltage - motor.constant * qd) / motor.resistance
        friction = np.sign(qd) * (motor.coulomb + motor.load_loss * abs(push))
        given = push - friction - motor.viscous * qd
        if abs(duty) < servo.torque_limit - 1e-12 and abs(duty) > servo.punch / 1023:
            assert given == pytest.approx(torque, abs=1e-12 * (1 + numbers[8]))


def _output(servo, error: float) -> float:
    """The position law, from its definition, without the rounding to ticks."""
    if servo.law == "pid":
        duty = servo.p_gain / 128 / 885 * error
    else:
        side = 0 if error < 0 else 1
        beyond = abs(error) - servo.compliance_margin[side]
        duty = 0.0
        if beyond > 0:
            duty = servo.punch / 1023 + (1 - servo.punch / 1023) * beyond / 32.0
        duty = np.copysign(duty, error)
    return float(np.clip(duty, -servo.torque_limit, servo.torque_limit))


def test_a_loaded_servo_stays_where_it_shall_be() -> None:
    # Lifting 0.5 N m, AX-12A's law alone rests below its goal by the margin of 1 tick and 32 ticks
    # per full output; a joint at rest is held by friction anywhere in a band, so from below: the
    # servo climbs until push (1 - c1) - c0 = 0.5, 0.52 of 2.93 N m: more than 8 ticks short. With
    # its law inverted for the torque it rests within a tick of rounding and the band of friction.
    ticks = {}
    for fed in (False, True):
        bench = Bench(AX, load=0.5)
        target = 100 * AX.resolution
        bench.put(target - 12 * AX.resolution)
        bench.run(3.0, goal(AX, target, 0.0, 0.5) if fed else target)
        ticks[fed] = (target - float(bench.angle[0])) / AX.resolution
    assert ticks[False] > 8
    assert abs(ticks[True]) < 6
    print(ticks)
