"""Advice on servos: the catalogue on the same robot, and what the command prints."""

from dataclasses import replace

import numpy as np
import pytest

from phasmid.advice import Grade, Holding, Wiring, advise, servo_verdict
from phasmid.cli import main
from phasmid.errors import InfeasibleWalk, InvalidInput
from phasmid.robot import load_robot, robot_to_toml
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
    order = [Grade.GOOD, Grade.TIGHT, Grade.NO]
    keys = [(order.index(c.verdict.grade), -c.verdict.margin[0]) for c in choices]
    assert keys == sorted(keys)
    assert advice.best is choices[0]


def test_each_row_is_the_verdict_with_that_servo_whichever_is_fitted(advice):
    for choice in advice.choices:
        verdict = servo_verdict(TRIPOD.replace(servo=choice.servo.name))
        assert choice.verdict.as_dict() == verdict.as_dict()
    fitted = advise(TRIPOD.replace(servo="MX-28", voltage=11.0))
    rows = [(c.servo, c.verdict.as_dict(), c.payload) for c in advice.choices]
    assert [(c.servo, c.verdict.as_dict(), c.payload) for c in fitted.choices] == rows


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
    period = f"{0.04 / 0.5 / 0.06:.3g}"
    assert f"60 mm/s (steps of 40 mm, period {period} s), payload 500 g" in printed
    # 22 mΩ of three cells, and 16 mΩ of the wire.
    assert f"{found.verdict.voltage:g} V reach the servos, through 38 mΩ" in printed
    for line in found.verdict.lines:
        assert line in printed
    for name in servo_names():
        assert f" {name} " in printed
    assert f"Best at 60 mm/s: {found.best.servo.name} (~${found.best.price:.0f})." in printed
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
    captured = capsys.readouterr()
    assert "TOO SLOW: the walk needs" in captured.out
    assert "Supply: not advised, since the robot cannot walk so." in captured.out
    assert "try  longer steps at the same speed" in captured.err


def test_a_supply_that_is_too_high_gives_status_2(capsys):
    assert main(["advise", "--robot", "phantomx-ax", "--voltage", "20"]) == 2
    assert "HOLDS" in (captured := capsys.readouterr()).out
    assert "the supply is too high.\n  try  --voltage 12" in captured.err


def test_a_battery_and_a_voltage_are_two_supplies(capsys):
    arguments = ["advise", "--robot", "phantomx-ax", "--cells", "3", "--voltage", "11"]
    assert main(arguments) == 2
    assert "3 cells are connected to the servos and set their voltage." in capsys.readouterr().err
    # Without battery and wire the verdict is for the very voltage that is named.
    named = TRIPOD.replace(voltage=11.1234567)
    assert advise(named).verdict.as_dict() == servo_verdict(named).as_dict()
    # Four cells need a regulator, whose output is named.
    assert main([*arguments[:4], "4", *arguments[5:]]) == 0
    printed = capsys.readouterr().out
    assert "11 V reach the servos. The table is at rated voltage." in printed
    assert "Regulator (BEC): 11 V, " in printed
    assert "all that" not in printed
    # Its battery may sag; only the wire behind it loses voltage.
    assert main([*arguments[:4], "4", *arguments[5:], "--wire-mm2", "1.5"]) == 0
    assert "through 8 mΩ of wire." in capsys.readouterr().out


def test_few_cells_and_a_quick_walk_are_explained(capsys):
    arguments = ["advise", "--robot", "phantomx-ax", "--servo", "STS3215-7.4V"]
    assert main([*arguments, "--cells", "2", "--speed-mm-s", "60"]) == 0
    printed = capsys.readouterr().out
    assert "6.1 V reach the servos. The table" in printed
    assert "Regulator (BEC): 6.1 V, all that 2 nearly empty cells allow, " in printed
    assert "More margin: longer steps at the same speed" in printed
    assert "see phasmid walk --drive servo --period 1.33 --voltage 6.1, " in printed


def test_little_margin_gets_a_remedy(capsys):
    assert main(["advise", "--robot", "phantomx-ax", "--servo", "MG996R"]) == 0
    assert "More margin: feet nearer to the hips (--stance-radius-mm)" in capsys.readouterr().out


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
