"""Calibration files: written, read, and refused."""

import json
from dataclasses import replace

import pytest

from phasmid.errors import AlreadyExists, InvalidInput
from phasmid.hardware import default_calibration, load_calibration, model, save_calibration
from phasmid.robot import load_robot


@pytest.mark.parametrize("name", ["phantomx-ax", "octopod", "quadruped"])
@pytest.mark.parametrize("servo", ["AX-12A", "XL430-W250"])
def test_a_file_loads_to_what_was_saved(tmp_path, name, servo):
    robot, path = load_robot(name), tmp_path / "robot.toml"
    rows = default_calibration(robot, model(servo), range(101, 101 + 3 * len(robot.legs)))
    save_calibration(path, rows, robot.name)
    assert load_calibration(path, robot) == rows
    with pytest.raises(AlreadyExists, match="nothing was written"):
        save_calibration(path, rows[:3], robot.name)
    # The order of a file does not matter.
    save_calibration(path, rows[::-1], robot.name, force=True)
    assert load_calibration(path, robot) == rows


BROKEN = [
    ('robot = "phantomx-ax"', 'robot = "octopod"', 'of the robot "octopod"', 4),
    ("[joint.right_front.coxa]", "[joint.right_frnt.coxa]", 'no joint "right_frnt.coxa"', 6),
    ("[joint.right_front.coxa]", "[joint.right_front.cxa]", "right_front.coxa", 6),
    ("id = 2\n", "id = 1\n", "right_front.coxa and right_front.femur both have the id 1", 15),
    ("id = 1\n", "id = 254\n", "id of right_front.coxa is 254; the AX-12A takes 0 to 253", 6),
    ("id = 1\n", 'id = "1"\n', 'id is "1"; it must be a whole number', 7),
    ('model = "AX-12A"', 'model = "AX-12"', '"AX-12A"', 6),
    ("drive_mode = 0", "drive_mode = 2", "it must be 0 or more and 1 or less", 9),
    ("range_min = 256", "range_min = 768", "it must be below range_max, 768", 6),
    ("range_min = 256", "range_min = -1", "the AX-12A takes 0 to 1023", 6),
    ("range_max = 768", "range_max = 1024", "the AX-12A takes 0 to 1023", 6),
    ("homing_offset = 0", "homing_offset = 600", "-250.8° to -100.8°, outside", 6),
    ("homing_offset = 0", f"homing_offset = 1{400 * '0'}", "and 1.04858e+06 or less", 10),
    ("range_max = 768", "range_mx = 768", 'unknown key "range_mx"', 12),
]


@pytest.mark.parametrize(("old", "new", "words", "line"), BROKEN)
def test_a_wrong_file_is_refused_with_its_line(tmp_path, old, new, words, line):
    robot, path = load_robot("phantomx-ax"), tmp_path / "robot.toml"
    save_calibration(path, default_calibration(robot, model("AX-12A")), robot.name)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InvalidInput) as caught:
        load_calibration(path, robot)
    assert words in str(caught.value)
    assert caught.value.where == f"robot.toml, line {line}"
    assert caught.value.what.count("\n") == 0


@pytest.mark.parametrize("space", ["", "\n  "])
def test_a_calibration_of_lerobot_is_told_from_ours(tmp_path, space):
    """LeRobot's names are ours, its numbers are not: no number is the position at angle 0."""
    motor = {"id": 1, "drive_mode": 0, "homing_offset": -20, "range_min": 900, "range_max": 3100}
    path, robot = tmp_path / "arm.json", load_robot("phantomx-mk4")
    path.write_text(space + json.dumps({"right_front_coxa": motor}, indent=4))
    with pytest.raises(InvalidInput, match=r"of LeRobot, (.|\n)*try  phasmid bus calibrate /dev"):
        load_calibration(path, robot)
    path.write_text(space + '{"joints": []}')
    with pytest.raises(InvalidInput, match=r"arm\.json is JSON; a calibration is a TOML file\."):
        load_calibration(path, replace(robot, name="mine"))


def test_a_missing_joint_is_named(tmp_path):
    robot, path = load_robot("phantomx-ax"), tmp_path / "robot.toml"
    rows = default_calibration(robot, model("AX-12A"))
    save_calibration(path, rows[:-1], robot.name)
    with pytest.raises(InvalidInput, match=r"the joint left_front.tibia is missing"):
        load_calibration(path, robot)


def test_the_default_servo_is_that_of_the_robot():
    """The model is the robot's, or one that is named; other numbers of ids are refused."""
    robot = load_robot("phantomx-mk4")
    rows = default_calibration(robot)
    assert rows == default_calibration(robot, "XL430-W250")
    assert rows == default_calibration(robot, model("XL430-W250"), range(1, 19))
    with pytest.raises(InvalidInput, match=r"^2 ids are given; the robot has 18 servos\."):
        default_calibration(robot, ids=[1, 2])
    with pytest.raises(InvalidInput, match='no control table of a servo called "MG996R"'):
        default_calibration(load_robot("markwtech"))
