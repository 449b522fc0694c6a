"""The servo of an imported robot has no name, and sentences about it are sentences."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from phasmid.advice import servo_verdict
from phasmid.cli import main
from phasmid.errors import PhasmidError
from phasmid.formats import load_robot, save_robot
from phasmid.motion import JointTrajectory, plan
from phasmid.scenario import load_scenario
from phasmid.scenario.relevance import idle_fields
from phasmid.servo.words import UNNAMED, servo_label, servo_quantity, servo_words
from phasmid.studio.bench import bench as bench_at
from phasmid.studio.messages import Bench
from phasmid.units import STANDARD_GRAVITY

bench = partial(bench_at, gravity=STANDARD_GRAVITY)


@pytest.fixture(scope="module")
def unnamed(tmp_path_factory):
    """The paper's robot, by way of a URDF file."""
    path = tmp_path_factory.mktemp("robot") / "mine.urdf"
    save_robot(load_robot("phantomx-paper"), path)
    return path


def said(call):
    with pytest.raises(PhasmidError) as caught:
        call()
    return caught.value.what


def test_a_servo_in_a_sentence():
    assert servo_label("AX-12A") == "AX-12A"
    assert servo_words("AX-12A") == "servo AX-12A"
    assert servo_quantity("AX-12A", "stall torque") == "AX-12A's stall torque"
    assert servo_label(UNNAMED) == servo_words(UNNAMED) == "servo in the file"
    assert servo_quantity(UNNAMED, "stall torque") == "stall torque in the file"


def test_no_sentence_has_the_name_of_a_servo_without_one(unnamed):
    robot = load_robot(unnamed)
    assert robot.servo.name == UNNAMED
    scenario = load_scenario("paper").for_robot(robot)
    motor = replace(robot.servo, stall_current=0.01)
    jump = np.zeros((2, 18))
    jump[1, 0] = 1.0
    heavy = servo_verdict(scenario.replace(payload=30.0, voltage=20.0))
    sentences = [
        *heavy.lines,
        *servo_verdict(scenario.replace(ambient_temperature=99.0)).lines,
        *idle_fields(scenario.replace(drive="servo", p_gain=5.0, compliance_slope=32.0)),
        said(lambda: plan(scenario.replace(period=0.05, step_height=0.08))),
        said(lambda: JointTrajectory(robot, np.array([0.0, 0.01]), jump.reshape(2, 6, 3))),
        said(lambda: robot.servo.motor),
        said(lambda: motor.motor),
        *bench(robot, Bench(leg=1, force=(0.0, 0.0, 500.0)))["remarks"],
    ]
    assert sum("in the file" in sentence for sentence in sentences) >= 8
    assert not [sentence for sentence in sentences if UNNAMED in sentence]


def test_a_walk_beyond_an_unnamed_servo_is_told_in_sentences(unnamed, capsys, monkeypatch):
    monkeypatch.chdir(unnamed.parent)
    walk = ["--payload-g", "6000", "--no-figures", "--duration", "2", "--out", "walk"]
    for command in (["check"], ["advise"], ["walk", *walk]):
        main([*command, "--robot", unnamed.name])
        told = " ".join("".join(capsys.readouterr()).replace("! ", "").split())
        assert "in the file" in told
        assert UNNAMED not in told
    assert re.search(r"torque is \d+ % of the stall torque in the file: these servos", told)
