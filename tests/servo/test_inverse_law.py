"""Servos without torque input give the torque that is fed forward."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from phasmid.robot import load_robot
from phasmid.servo.law import inverse_law
from phasmid.servo.law_kernels import goal_memory, goals_for_torque
from support.servo_bench import Bench

# The bench without delay; `test_a_goal_is_ahead...` has it.
AX = replace(load_robot("phantomx-ax").servo, delay=0.0)
PID = replace(AX, law="pid", p_gain=800.0)


def goal(servo, q, qd, torque, voltage=12.0):
    law = inverse_law(servo.at(voltage))
    rows = (np.array([[value]]) for value in (q, qd, torque))
    return float(goals_for_torque(*rows, law, 1e-3, goal_memory(1))[0, 0])


@pytest.mark.parametrize("servo", [AX, PID], ids=["compliance", "pid"])
@pytest.mark.parametrize(("voltage", "qd"), [(9.0, -2.0), (9.0, 0.5), (12.0, -0.5), (12.0, 2.0)])
def test_a_turning_servo_gives_the_torque_that_is_fed_forward(servo, voltage, qd) -> None:
    # Motor: k i = d V k / R - k² w / R; of it the gears lose c1 |k i| + c0 against the motion, and
    # b w. The law sees whole ticks of goal and angle, so the output misses by up to one tick of
    # slope: 1/32 of full output for AX (1/885 * 6.25 for PID), hence that share of the stall push.
    for torque in (-0.6, -0.2, 0.3, 0.7):
        law = inverse_law(servo.at(voltage))
        wanted = goal(servo, 0.0, qd, torque, voltage)
        error = wanted / servo.resolution
        duty = _output(servo, error)
        motor = servo.motor
        push = motor.constant * (duty * voltage - motor.constant * qd) / motor.resistance
        friction = np.sign(qd) * (motor.coulomb + motor.load_loss * abs(push))
        given = push - friction - motor.viscous * qd
        if abs(duty) < servo.torque_limit - 1e-12 and abs(duty) > servo.punch / 1023:
            assert given == pytest.approx(torque, abs=1e-12 * (1 + law.per_torque))


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


@pytest.mark.parametrize("robot", ["phantomx-ax", "phantomx-mk4"])
def test_a_servo_that_is_fed_forward_follows_a_fast_swing(robot) -> None:
    # A joint swings at 2 Hz with up to 4 rad/s, two thirds of what its servo can. The law sees
    # whole ticks, so its output misses by half a tick at the least: 1/64 of full output, a bit of
    # which friction takes, makes up to 2.9 N m / 64 / 4e-3 kg m2 = 11 rad/s2, or 0.1 deg at 2 Hz.
    # Without feed-forward the servo lags by what its law needs for the speed: 0.65 of full output
    # is 20 ticks for AX-12A. XL430's law answers to the error's change as well.
    servo, inertia, w, most = load_robot(robot).servo, 3e-3, 4 * np.pi, 4.0
    # In the play of the gears no law moves the joint.
    servo = replace(servo, delay=0.0, backlash=0.0)
    law, memory = inverse_law(servo.at(12.0)), goal_memory(1)
    worst = {}
    for fed in (False, True):
        bench, errors = Bench(servo, inertia=inertia), []
        bench.speed[:] = bench["speed"] = most
        for k in range(1500):
            t = 1e-3 * k
            q, qd = most / w * np.sin(w * t), most * np.cos(w * t)
            torque = -(inertia + servo.armature) * most * w * np.sin(w * t)
            rows = (np.array([[value]]) for value in (q, qd, torque))
            bench.step(float(goals_for_torque(*rows, law, 1e-3, memory)[0, 0]) if fed else q)
            errors.append(bench.angle[0] - most / w * np.sin(w * (t + 1e-3)))
        worst[fed] = np.degrees(np.std(errors[500:]))
    assert worst[False] > 3
    assert worst[True] < 0.2


def test_a_goal_is_ahead_of_the_motion_by_the_servos_delay() -> None:
    # At constant speed the servo is the same at each instant, so that a lead of the goal by T w
    # moves the joint ahead by T w, to within a tick of the rounded position: 11 ms at 2 rad/s are
    # 4.3 ticks. With it the joint is as far from its target as that of a servo without delay.
    servo, speed, errors = load_robot("phantomx-ax").servo, 2.0, []
    for known, delayed in ((servo, True), (replace(servo, delay=0.0), True), (AX, False)):
        bench, law = Bench(servo, delayed=delayed), inverse_law(known.at(12.0))
        memory, away = goal_memory(1), []
        bench.speed[:] = bench["speed"] = speed
        for k in range(1000):
            rows = (np.array([[value]]) for value in (1e-3 * k * speed, speed, 0.0))
            bench.step(float(goals_for_torque(*rows, law, 1e-3, memory)[0, 0]))
            away.append(bench.angle[0] - 1e-3 * (k + 1) * speed)
        errors.append(np.mean(away[500:]))
    led, unled, undelayed = errors
    assert led - unled == pytest.approx(servo.delay * speed, abs=servo.resolution)
    assert led == pytest.approx(undelayed, abs=servo.resolution)
