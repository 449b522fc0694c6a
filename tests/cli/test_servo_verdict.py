"""Ten builders ask whether their servos hold; every command and the studio answer alike."""

import json
import re
from dataclasses import replace

import pytest

from phasmid.cli import main
from phasmid.gait import gaits_of
from phasmid.robot import complete_servo, load_robot, load_servo, robot_to_toml, with_payload
from phasmid.scenario import load_scenario
from phasmid.studio.setting import setting_of

STRONG = complete_servo(
    {
        "name": "strong",
        "stall_torque": 6.0,
        "no_load_speed": 6.6,
        "armature": 0.012,
        "friction": 0.09,
        "viscous_friction": 0.01,
        "stall_current": 4.1,
    }
)
"""Four times as strong as an AX-12A, and heavier in armature and friction."""

LOAD = 5.0
"""Payload that overloads small servos on any of the robots [kg]."""


def answered(capsys, *arguments):
    capsys.readouterr()
    status = main([*map(str, arguments)])
    return status, capsys.readouterr().out


def unwrapped(text):
    return re.sub(r"\s+", " ", text.replace("servos: ", ""))


@pytest.mark.parametrize("servo", [STRONG, load_servo("AX-12A")], ids=lambda servo: servo.name)
@pytest.mark.parametrize("name", ["phantomx-paper", "octopod"])
def test_every_command_and_the_studio_give_one_verdict(tmp_path, capsys, monkeypatch, name, servo):
    monkeypatch.chdir(tmp_path)
    robot = load_robot(name)
    overloaded = servo is not STRONG
    robot = with_payload(replace(robot, name="mine", servo=servo), LOAD if overloaded else 0.0)
    (tmp_path / "mine.toml").write_text(robot_to_toml(robot), encoding="utf-8")
    gait = next(iter(gaits_of(len(robot.legs))))

    scenario = load_scenario("paper").replace(robot=robot, gait=gait, drive="servo")
    verdict = setting_of(scenario).servo_verdict
    assert verdict["holding"] == ("DOES NOT HOLD" if overloaded else "HOLDS")
    words = " ".join(verdict["lines"])
    assert words.startswith(verdict["holding"])
    status, told = answered(capsys, "check", "mine.toml")
    assert status == (2 if overloaded else 0)
    assert words in unwrapped(told)

    fields = ["--robot", "mine.toml", "--gait", gait, "--drive", "servo", "--duration", "0.05"]
    fields += ["--step-length-mm", "20", "--step-height-mm", "15", "--no-figures"]
    for command in (["walk"], ["drive", "--velocity", "0.01,0,0"]):
        folder = tmp_path / command[0]
        status, printed = answered(capsys, *command, *fields, "--out", folder)
        assert status in (0, 3)
        assert words in unwrapped(printed)
        # In the first lines: before anything else that is measured.
        assert printed.index(verdict["holding"]) < printed.index("Duration")
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        # What is unknown or infinite is left out there.
        assert summary["servo_verdict"].items() <= verdict.items()
        assert summary["servo_verdict"]["lines"] == verdict["lines"]


def test_the_studios_verdict_follows_payload_servo_and_gait():
    setting = setting_of(load_scenario("paper").replace(drive="servo"))
    said = {
        setting.servo_verdict["lines"][0],
        replace(setting, payload=4.0).servo_verdict["lines"][0],
        replace(setting, servo="MX-28").servo_verdict["lines"][0],
        replace(setting, scenario=setting.scenario.replace(gait="wave")).servo_verdict["lines"][0],
    }
    assert len(said) == 4
    assert replace(setting, payload=4.0).servo_verdict["holding"] == "DOES NOT HOLD"


def test_a_scenario_whose_servos_do_not_hold_is_refused_by_check(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    heavy = with_payload(load_robot("phantomx-paper"), 2.0)
    (tmp_path / "heavy.toml").write_text(robot_to_toml(heavy), encoding="utf-8")
    (tmp_path / "trip.toml").write_text('robot = "heavy.toml"\n', encoding="utf-8")
    status = main(["check", "trip.toml"])
    told = capsys.readouterr()
    assert status == 2
    assert "DOES NOT HOLD: right_middle.femur needs 1.7 N·m" in told.out
    assert "the AX-12A does not hold this robot in the tripod gait." in told.err
    assert "try  --gait wave" in told.err
    assert main(["check", "trip.toml", "--gait", "wave"]) == 0
    assert "HOLDS FOR A LIMITED TIME" in capsys.readouterr().out
