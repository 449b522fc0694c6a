"""Advice on servos: loads, heat, battery, and the choice of another servo."""

from dataclasses import replace

import numpy as np
import pytest

from phasmid import load_robot, simulate
from phasmid.advice import advise, simulate_load
from phasmid.advice.advice import MEASURED, USABLE, WARM_UP, plan_cycles
from phasmid.cli import main
from phasmid.errors import InvalidInput
from phasmid.forces import Holding
from phasmid.robot import robot_to_toml
from phasmid.scenario import Scenario
from phasmid.servo import load_servo, servo_names

ROBOT = Scenario(robot="phantomx-ax").replace(gait="tripod", period=1.0)


@pytest.fixture(scope="module")
def advice():
    return advise(ROBOT)


def test_the_load_is_that_of_the_recorded_walk(advice):
    # Sums over blocks and over the recording differ by round-off of 3000 samples.
    recording = simulate(*plan_cycles(ROBOT)[:2])
    assert recording.time.values[-1] == WARM_UP + MEASURED
    part = recording.isel(time=recording.time.values >= WARM_UP)
    torque, current = part["joint_torque"].values, part["servo_current"].values
    load = advice.load
    np.testing.assert_array_equal(load.peak_torque, np.abs(torque).max(axis=0))
    np.testing.assert_allclose(load.rms_torque, np.sqrt((torque**2).mean(axis=0)), rtol=1e-12)
    motor = advice.servo.motor
    heat = motor.resistance * (current**2).mean(axis=0)
    np.testing.assert_allclose(load.heat, heat, rtol=1e-12)
    assert (load.unaided_heat >= load.heat).all()
    drawn = np.maximum(part["servo_duty"].values * current, 0).sum(axis=(1, 2))
    standby = 18 * advice.servo.standby_current
    assert load.supply_current == pytest.approx(drawn.mean() + standby, rel=1e-12)
    assert load.peak_supply_current == pytest.approx(drawn.max() + standby, rel=1e-12)


def test_the_extrapolated_temperature_is_that_of_a_longer_walk(advice):
    # Heat varies from cycle to cycle by 3 % of the warmest servo's, since feet creep.
    scenario, walk, _ = plan_cycles(advice.experiment, cycles=60)
    simulated = simulate_load(scenario, walk).temperature - 25.0
    rise = advice.temperature(1.0)[1] - 25.0
    assert np.abs(rise - simulated).max() < 0.05 * simulated.max()
    assert simulated.max() > 0.3


def test_the_battery_lasts_in_proportion_to_its_capacity(advice):
    larger = advise(ROBOT, capacity=4.4)
    assert larger.battery_minutes == pytest.approx(2 * advice.battery_minutes, rel=1e-12)
    current = advice.load.supply_current
    assert advice.battery_minutes == pytest.approx(60 * USABLE * 2.2 / current, rel=1e-12)


def test_a_speed_sets_the_period():
    experiment, walk, speed = plan_cycles(ROBOT, 0.05)
    assert experiment.course.stride.period == pytest.approx(0.04 / 0.5 / 0.05)
    way = np.ptp(walk.trunk.position[:, 0])
    assert speed == pytest.approx(0.05)
    assert way / experiment.duration == pytest.approx(0.05, rel=1e-6)


def test_a_payload_increases_torque_and_heat(advice):
    loaded = advise(ROBOT.replace(payload_g=1000))
    assert loaded.load.rms_torque.max() > 1.2 * advice.load.rms_torque.max()
    assert loaded.verdict.torque > 1.2 * advice.verdict.torque
    assert loaded.battery_minutes < advice.battery_minutes


def test_each_servo_of_the_catalogue_holds_or_lacks_something(advice):
    assert [choice.servo.name for choice in advice.choices] == list(servo_names())
    for choice in advice.choices:
        assert bool(choice.lacks) == (choice.verdict.holding is not Holding.HOLDS)
        assert choice.price == 18 * choice.servo.price
    # Heavier servos count: the MX-28 weighs 22.4 g more than the AX-12A.
    torque = {choice.servo.name: choice.verdict.torque for choice in advice.choices}
    assert torque["MX-28"] > 1.05 * torque["AX-12A"]
    # A walk that no servo can follow lacks speed.
    fast = advise(ROBOT, speed=0.12)
    lacks = {choice.servo.name: choice.lacks for choice in fast.choices}
    assert "speed 4.7 of" in lacks["STS3215"]
    assert "speed" not in lacks["AX-18A"]


def test_the_cheapest_servo_that_holds():
    light = replace(load_robot("quadruped"), servo=load_servo("AX-12A"))
    light = replace(light, body=replace(light.body, mass=0.1))
    found = advise(Scenario(robot=light, gait="crawl"))
    holding = [choice for choice in found.choices if not choice.lacks]
    assert holding
    assert found.cheapest in holding
    assert found.cheapest.price == min(choice.price for choice in holding)


def test_without_a_stall_current_heat_is_unknown(capsys, tmp_path):
    servo = replace(load_servo("AX-12A"), stall_current=None, sources={"stall_current": "unknown"})
    robot = replace(load_robot("phantomx-ax"), servo=servo)
    found = advise(ROBOT.replace(robot=robot))
    assert found.load.heat is None
    assert found.battery_minutes is None
    assert found.temperature(5.0) is None
    assert found.load.peak_torque.max() > 0.3
    (tmp_path / "own.toml").write_text(robot_to_toml(robot), encoding="utf-8")
    assert main(["advise", "--robot", str(tmp_path / "own.toml")]) == 0
    assert "heat, current and battery time are unknown" in capsys.readouterr().out


def test_the_command_prints_all_joints_and_servos(capsys, tmp_path):
    figure = tmp_path / "advice.svg"
    arguments = ["advise", "--robot", "phantomx-ax", "--payload-g", "500", "--speed-mm-s", "60"]
    assert main([*arguments, "--out", str(figure)]) == 0
    printed = capsys.readouterr().out
    assert "60 mm/s, payload 500 g, air 25 °C" in printed
    for word in ("left_rear.tibia", "STS3215", "battery of 2200 mAh", "HOLDS"):
        assert word in printed
    assert figure.read_text(encoding="utf-8").startswith("<?xml")


def test_servos_that_do_not_hold_give_status_2(capsys):
    assert main(["advise", "--robot", "phantomx-ax", "--payload-g", "6000"]) == 2
    captured = capsys.readouterr()
    assert "DOES NOT HOLD" in captured.out
    assert "the AX-12A does not hold it in the tripod gait." in captured.err


@pytest.mark.parametrize("number", [0.0, -1.0, np.nan])
def test_speed_and_capacity_must_be_positive(number):
    with pytest.raises(InvalidInput, match="speed is"):
        advise(ROBOT, speed=number)
    with pytest.raises(InvalidInput, match="capacity is"):
        advise(ROBOT, capacity=number)
