"""Advice on servos: the catalogue on the same robot, and what the command prints."""

from dataclasses import replace

import numpy as np
import pytest

from phasmid.advice import Grade, Holding, Wiring, advise, servo_verdict
from phasmid.advice.adviser import ORDER, at_speed
from phasmid.cli import main
from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.robot import load_robot, robot_to_toml, with_payload
from phasmid.scenario import Scenario
from phasmid.servo import load_servo, servo_names

AX = load_robot("phantomx-ax")
TRIPOD = Scenario(robot=AX, gait="tripod")


@pytest.fixture(scope="module")
def advice():
    return advise(TRIPOD)


def test_the_verdict_is_that_of_the_robot(advice):
    assert advice.verdict.as_dict() == servo_verdict(TRIPOD).as_dict()
    assert advise(TRIPOD.build()).verdict.as_dict() == advice.verdict.as_dict()


def test_each_servo_of_the_catalogue_is_judged_once_the_best_first(advice):
    choices = advice.choices
    assert sorted(choice.servo.name for choice in choices) == sorted(servo_names())
    for choice in choices:
        assert choice.verdict.servo == choice.servo.name
        assert choice.price == 18 * load_servo(choice.servo.name).price
    keys = [(ORDER.index(c.verdict.grade), -c.verdict.margin[0]) for c in choices]
    assert keys == sorted(keys)
    assert advice.best is choices[0]


def test_the_robot_s_own_servo_is_a_row_of_the_catalogue(advice):
    (own,) = (choice for choice in advice.choices if choice.servo.name == "AX-12A")
    assert own.verdict.as_dict() == advice.verdict.as_dict()


def test_heavier_servos_count_in_the_trunk(advice):
    # An MX-28 weighs 22.4 g more than an AX-12A.
    (heavier,) = (choice for choice in advice.choices if choice.servo.name == "MX-28")
    more = 18 * (load_servo("MX-28").mass - AX.servo.mass)
    assert more == pytest.approx(18 * 0.0224, abs=1e-3)
    loaded = replace(with_payload(AX, more), servo=load_servo("MX-28"))
    expected = servo_verdict(TRIPOD.replace(robot=loaded))
    assert heavier.verdict.torque == pytest.approx(expected.torque, rel=1e-12)
    lighter = [c for c in advice.choices if c.servo.mass <= AX.servo.mass]
    assert {choice.verdict.torque for choice in lighter} == {advice.verdict.torque}


@pytest.mark.parametrize("now", [0.0, 0.4])
def test_a_servo_holds_the_payload_of_its_row_and_no_more(now):
    """Beside the payload by 1 % the least margin without help is on either side of 1."""
    scenario = TRIPOD.replace(payload=now)
    rows = {choice.servo.name: choice for choice in advise(scenario).choices}
    for part, holds in ((0.99, True), (1.01, False)):
        for name in ("AX-12A", "XL430-W250"):
            found = advise(scenario.replace(payload=part * rows[name].payload))
            (row,) = (choice for choice in found.choices if choice.servo.name == name)
            assert (row.verdict.margin[0] > 1) is holds
            # The payload does not depend on the one that is carried now.
            assert row.payload == pytest.approx(rows[name].payload, rel=1e-6)


def test_a_robot_that_no_servo_holds_has_no_best_and_no_cheapest():
    found = advise(TRIPOD.replace(payload=40.0, friction=0.1))
    assert found.verdict.holding is Holding.DOES_NOT_HOLD
    assert (found.best, found.cheapest) == (None, ())
    assert all(choice.verdict.grade is Grade.NO for choice in found.choices)
    # Too heavy without its payload, too, if the floor does not help.
    heavy = replace(AX, body=replace(AX.body, mass=40.0))
    assert {choice.payload for choice in advise(TRIPOD.replace(robot=heavy)).choices} == {0.0}


def test_the_cheapest_holds_without_help_from_the_floor(advice):
    holding = [choice for choice in advice.choices if choice.verdict.margin[0] >= 1]
    assert 0 < len(holding) < len(advice.choices)
    least = min(choice.price for choice in holding)
    assert advice.cheapest == tuple(choice for choice in holding if choice.price == least)
    # Where all need help, none is named.
    heavy = advise(TRIPOD.replace(payload=5.0))
    assert all(choice.verdict.margin[0] < 1 for choice in heavy.choices)
    assert heavy.best.verdict.grade is Grade.TIGHT
    assert heavy.cheapest == ()


def test_an_unstable_robot_has_no_payload():
    leaning = replace(AX, body=replace(AX.body, com=np.array([0.24, 0.0, 0.0])))
    found = advise(TRIPOD.replace(robot=leaning))
    assert found.verdict.holding is Holding.NOT_STABLE
    # Heavier servos may bring the centre of mass back between the feet.
    (own,) = (choice for choice in found.choices if choice.servo.name == "AX-12A")
    assert own.payload == 0
    assert (found.currents, found.supply) == (None, None)
    # Nor does a battery change that.
    assert advise(TRIPOD.replace(robot=leaning), wiring=Wiring(cells=3)).currents is None


def test_a_speed_sets_the_period(advice):
    # 40 mm in half of the period.
    assert advice.speed == pytest.approx(0.04 / (0.5 * TRIPOD.build().course.stride.period))
    faster = advise(TRIPOD, speed=0.05)
    assert faster.speed == pytest.approx(0.05, rel=1e-12)
    assert faster.experiment.course.stride.period == pytest.approx(0.04 / 0.5 / 0.05)
    ratio = faster.verdict.speed_share / advice.verdict.speed_share
    assert ratio == pytest.approx(0.05 / advice.speed, rel=1e-9)
    assert at_speed(advice.experiment, None) is advice.experiment
    with pytest.raises(InfeasibleWalk, match="step of 400 mm is too much"):
        advise(TRIPOD.replace(step_length=0.4))
    with pytest.raises(InvalidInput, match="a speed needs a step ahead"):
        advise(TRIPOD.replace(step_length=0.0), speed=0.05)


def test_a_speed_that_the_servos_cannot_follow_is_a_margin_below_1():
    # The walk at 40 mm/s leaves 3.3 times as much speed.
    found = advise(TRIPOD, speed=0.3)
    rows = {choice.servo.name: choice.verdict for choice in found.choices}
    assert found.verdict.speed_share > 1
    assert (found.verdict.deciding, found.verdict.grade) == ("speed", Grade.NO)
    assert rows["AX-12A"].grade is Grade.NO
    assert rows["AX-12A"].speed_share / rows["MX-28"].speed_share == pytest.approx(
        load_servo("MX-28").no_load_speed / load_servo("AX-12A").no_load_speed, rel=1e-9
    )


@pytest.mark.parametrize("number", [0.0, -1.0, np.nan, np.inf])
def test_a_speed_must_be_positive(number):
    with pytest.raises(InvalidInput, match="speed is"):
        advise(TRIPOD, speed=number)


def test_a_payload_increases_torque_heat_and_current(advice):
    loaded = advise(TRIPOD.replace(payload=1.0))
    assert loaded.verdict.torque > 1.2 * advice.verdict.torque
    assert loaded.verdict.hour_temperature[0] > advice.verdict.hour_temperature[0]
    assert loaded.currents.mean[0] > advice.currents.mean[0]
    assert loaded.supply.minutes[0] < advice.supply.minutes[0]
    larger = advise(TRIPOD, wiring=Wiring(capacity=4.4))
    assert larger.supply.minutes[0] == pytest.approx(2 * advice.supply.minutes[0], rel=1e-12)


# The command -------------------------------------------------------------------------------------


def words(text):
    return " ".join(text.split())


def test_the_command_prints_verdict_catalogue_and_supply(capsys, tmp_path):
    figure = tmp_path / "advice.svg"
    arguments = ["advise", "--robot", "phantomx-ax", "--payload-g", "500", "--speed-mm-s", "60"]
    wiring = ["--cells", "3", "--wire-mm2", "0.75", "--battery-mah", "3000"]
    assert main([*arguments, *wiring, "--out", str(figure)]) == 0
    printed = words(capsys.readouterr().out)
    found = advise(
        Scenario(robot="phantomx-ax", gait="tripod").replace(payload=0.5),
        speed=0.06,
        wiring=Wiring(cells=3, capacity=3.0, wire_area=0.75e-6),
    )
    assert "60 mm/s, payload 500 g" in printed
    assert f"{found.verdict.voltage:g} V reach the servos, through 36 mΩ" in printed
    for line in found.verdict.lines:
        assert line in printed
    for name in servo_names():
        assert f" {name} " in printed
    assert f"Best at 60 mm/s: {found.best.servo.name}." in printed
    assert f"Supply: LiPo 3S, 3000 mAh, at least {found.supply.c_rating} C" in printed
    assert f"fuse {found.supply.fuse:g} A at the battery" in printed
    assert f"Wire before the legs divide: {1e6 * found.supply.wire_area:g} mm² or more" in printed
    thin = ["--wire-mm2", "0.34"]
    assert main([*arguments[:3], *thin]) == 0
    assert "0.34 mm² are too thin." in words(capsys.readouterr().out)
    assert figure.read_text(encoding="utf-8").startswith("<?xml")


def test_servos_that_do_not_hold_give_status_2(capsys):
    arguments = ["advise", "--robot", "phantomx-ax", "--payload-g", "40000", "--friction", "0.1"]
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out.splitlines()[1].startswith("DOES NOT HOLD")
    assert "None of them holds." in captured.out
    assert "phantomx-ax with the AX-12A: DOES NOT HOLD; margin" in captured.err
    assert main(["advise", "--robot", "phantomx-ax", "--speed-mm-s", "500"]) == 2
    assert "TOO SLOW: the walk needs" in capsys.readouterr().out


def test_without_a_stall_current_supply_and_heat_are_unknown(capsys, tmp_path):
    servo = replace(load_servo("AX-12A"), stall_current=None, sources={"stall_current": "unknown"})
    own = tmp_path / "own.toml"
    own.write_text(robot_to_toml(replace(AX, servo=servo)), encoding="utf-8")
    figure = tmp_path / "advice.svg"
    assert main(["advise", "--robot", str(own), "--out", str(figure)]) == 0
    printed = words(capsys.readouterr().out)
    assert "Heat: unknown, since the servo has no stall current." in printed
    assert "Supply: unknown, since the servo has no stall current." in printed
    assert figure.exists()
