"""The fields of the setting, and settings that leave the page and come back as files."""

import math
from dataclasses import replace
from itertools import chain
from typing import get_args

import numpy as np
import pytest

from phasmid import Scenario, load_robot, load_scenario, save_robot
from phasmid.errors import InvalidInput
from phasmid.servo import load_servo
from phasmid.studio.fields import catalogue, field_of, values
from phasmid.studio.messages import Load
from phasmid.studio.setting import setting_of
from phasmid.studio.settings_io import scenario_file, with_file
from phasmid.tables import leaves

PAPER = setting_of(load_scenario("paper"))


def with_values(setting, changes):
    for name, value in changes.items():
        setting = field_of(name).changed(setting, value)
    return setting


def told(setting, name):
    return next(one for one in chain(*catalogue(setting).values()) if one["name"] == name)


def choices(setting, name):
    return told(setting, name)["choices"]


def test_values_are_in_the_units_of_people_and_kept_in_si():
    raised = field_of("body_height").changed(PAPER, 12)
    assert raised.pose == (0.0, 0.0, 0.012, 0.0, 0.0, 0.0)
    leaning = field_of("roll").changed(raised, -5.0)
    assert leaning.pose[3] == pytest.approx(math.radians(-5), rel=1e-15)
    assert values(leaning)["roll"] == -5.0
    assert values(leaning)["body_height"] == 12.0
    assert field_of("step_height").changed(PAPER, 25).scenario.stride.step_height == 0.025


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("friction", -1, "terrain.friction is -1; it must be 0 or more."),
        ("friction", 5, "friction is 5; it must be at least 0 and at most 2."),
        ("friction", True, "friction is True; it must be a number."),
        ("gait", "tripode", 'gait is "tripode"; it must be one of tripod, wave'),
        ("ground_sensing", 1, "senses the ground is 1; it must be true or false."),
        ("payload", -1, "model.payload is -1 kg; it must be 0 or more and 100 or less."),
        ("payload", 50, "payload is 50 kg; it must be at most 5.3 kg, 2 times the robot."),
        ("step_height", -1, "stride.step_height is -0.001 m; it must be 0 or more."),
        ("colour", 1, 'the setting has no field "colour".'),
    ],
)
def test_a_value_that_cannot_be_is_refused_in_a_sentence(name, value, sentence):
    with pytest.raises(InvalidInput) as refusal:
        field_of(name).changed(PAPER, value)
    assert refusal.value.what.startswith(sentence)


def test_what_the_robot_is_asked_to_do_needs_no_new_run():
    for name, value in (
        ("gait", "wave"),
        ("period", 1.5),
        ("step_height", 20),
        ("roll", 2),
        ("walks", "by hand"),
        ("force_model", "friction-cone"),
        ("step_length", 20),
    ):
        assert field_of(name).changed(PAPER, value).built_of() == PAPER.built_of(), name
    for name, value in (
        ("walks", "the plan"),
        ("robot", "octopod"),
        ("terrain", "stairs"),
        ("drive", "ideal-servo"),
        ("servo", "MX-28"),
        ("contact_law", "mujoco"),
        ("friction", 0.5),
        ("ground_sensing", False),
        ("controller", "walk"),
    ):
        assert field_of(name).changed(PAPER, value).built_of() != PAPER.built_of(), name


CHANGED = {
    "walks": "by hand",
    "robot": "phantomx-ax",
    "gait": "ripple",
    "period": 1.25,
    "payload": 0.3,
    "drive": "servo",
    "servo": "MX-28",
    "terrain": "stairs",
    "rise": 15.0,
    "friction": 0.45,
    "pitch": -4.0,
    "force_model": "friction-cone",
    "ground_sensing": False,
}


def test_a_scenario_file_loads_to_the_same_experiment(tmp_path):
    setting = with_values(PAPER, CHANGED)
    file = scenario_file(setting)
    assert file.keys() == {"name", "text"}
    (tmp_path / file["name"]).write_text(file["text"])
    loaded = load_scenario(tmp_path / file["name"])
    assert loaded == setting.scenario
    assert loaded.load_robot().servo == setting.robot.servo


def test_the_servo_is_the_scenarios_and_leaves_and_comes_with_its_file(tmp_path):
    setting = field_of("servo").changed(PAPER, "MX-28")
    assert setting.scenario == PAPER.scenario.replace(servo="MX-28")
    assert setting.robot.servo == load_servo("MX-28")
    assert values(setting_of(setting.scenario))["servo"] == "MX-28"
    file = scenario_file(setting)
    load = Load(what="scenario", name=file["name"], content=file["text"].encode())
    loaded = with_file(PAPER, load, tmp_path)
    assert values(loaded)["servo"] == "MX-28"
    back = field_of("servo").changed(loaded, choices(loaded, "servo")[0])
    assert back.scenario == PAPER.scenario


def test_a_robot_from_a_file_keeps_its_own_servo_beside_the_chosen_one(tmp_path):
    save_robot(replace(load_robot("octopod"), name="mine"), tmp_path / "mine.toml")
    robot = str(tmp_path / "mine.toml")
    setting = setting_of(Scenario().replace(robot=robot, gait="wave", servo="MX-28"))
    file = scenario_file(setting)
    (tmp_path / file["robot"]["name"]).write_text(file["robot"]["text"])
    (tmp_path / file["name"]).write_text(file["text"])
    saved = load_scenario(tmp_path / file["name"])
    for one in (setting.scenario, saved):
        assert one.load_robot().servo == load_servo("MX-28")
        assert one.replace(servo=None).load_robot().servo == load_robot("octopod").servo


def test_a_payload_is_the_scenario_s_and_leaves_the_ground_as_it_is():
    """The contact law follows the robot's weight without what it carries."""
    loaded = field_of("payload").changed(PAPER, 1.0)
    assert loaded.scenario.model.payload == 1.0
    assert loaded.robot.mass == pytest.approx(PAPER.robot.mass + 1.0, rel=1e-12)
    assert loaded.experiment.world.contact == PAPER.experiment.world.contact


def test_a_robot_file_of_the_start_can_be_gone_back_to(tmp_path):
    save_robot(replace(load_robot("octopod"), name="mine"), tmp_path / "mine.toml")
    setting = setting_of(
        load_scenario("paper").replace(robot=str(tmp_path / "mine.toml"), gait="wave")
    )
    assert setting.robot_name == "mine.toml"
    assert choices(setting, "robot")[-1] == "mine.toml"
    back = field_of("robot").changed(field_of("robot").changed(setting, "quadruped"), "mine.toml")
    assert len(back.base.legs) == 8
    # It stays when a scenario is loaded.
    load = Load(what="scenario", name="x.toml", content=b'robot = "phantomx-ax"')
    assert choices(with_file(setting, load, tmp_path), "robot")[-1] == "mine.toml"


def test_scenarios_and_height_maps_are_taken_from_files(tmp_path):
    hills = Load(what="terrain", name="hills.csv", content=b"0,0,0\n0,0.005,0\n0,0,0\n")
    ground = with_file(PAPER, hills, tmp_path)
    assert ground.terrain_name == "hills.csv"
    place = np.array([0.31]), np.array([0.0])
    assert float(ground.scenario.load_terrain().height(*place)[0]) > 0
    text = b'gait = "wave"\n[terrain]\nkind = "height-map"\nheight_map = "hills.csv"\n'
    load = Load(what="scenario", name="x.toml", content=text)
    again = with_file(ground, load, tmp_path)
    assert (again.gait.name, again.terrain_name) == ("wave", "hills.csv")
    with pytest.raises(InvalidInput, match="a file that was not loaded"):
        with_file(PAPER, load, tmp_path)
    # A saved scenario comes back.
    saved = scenario_file(with_values(PAPER, {"gait": "wave", "terrain": "stairs"}))
    load = Load(what="scenario", name=saved["name"], content=saved["text"].encode())
    again = with_file(PAPER, load, tmp_path)
    assert (again.gait.name, again.terrain_name) == ("wave", "stairs")


def test_a_file_that_cannot_be_used_is_refused_by_its_own_name(tmp_path):
    text = scenario_file(setting_of(Scenario(robot=load_robot("phantomx-paper"))))["text"]
    with pytest.raises(InvalidInput) as refusal:
        with_file(PAPER, Load(what="scenario", name="x.toml", content=text.encode()), tmp_path)
    assert refusal.value.what == (
        'robot is "phantomx-paper-of-walk.toml"; a scenario that is loaded in the page must have '
        "the robot of a preset."
    )
    assert (refusal.value.where, refusal.value.hint) == ("x.toml", "phasmid studio FILE")
    with pytest.raises(InvalidInput) as refusal:
        with_file(PAPER, Load(what="scenario", name="x.toml", content=b"\xff\xfe"), tmp_path)
    assert str(tmp_path) not in str(refusal.value)


HILLS = Load(what="terrain", name="hills.csv", content=b"0,0,0\n0,0.005,0\n0,0,0\n")


@pytest.mark.parametrize(
    ("what", "name", "content"),
    [
        ("terrain", "rocks.csv", b"0,x\n"),
        ("terrain", "hills.csv", b"0,0\n0,1000\n"),
        ("terrain", "rocks.png", b"\x89PNG"),
        ("scenario", "x.toml", b"gait = 3"),
        ("scenario", "hills.csv", b'gait = "tripode"'),
        ("scenario", "x.toml", bytes(2_000_000)),
    ],
)
def test_a_refused_file_is_removed_at_once_and_an_older_one_of_its_name_stays(
    what, name, content, tmp_path
):
    ground = with_file(PAPER, HILLS, tmp_path)
    with pytest.raises(InvalidInput):
        with_file(ground, Load(what=what, name=name, content=content), tmp_path)
    [kept] = tmp_path.iterdir()
    assert (kept.name, kept.read_bytes()) == ("hills.csv", HILLS.content)


def test_only_height_maps_in_use_stay_in_the_folder(tmp_path):
    ground = with_file(PAPER, HILLS, tmp_path)
    with_file(ground, Load(what="scenario", name="x.toml", content=b'gait = "wave"'), tmp_path)
    flat = Load(what="terrain", name="hills.csv", content=b"0,0\n0,0\n")
    with_file(ground, flat, tmp_path)
    [kept] = tmp_path.iterdir()
    assert kept.read_bytes() == flat.content


@pytest.mark.parametrize("content", [b"", b"\n \n", b"# nothing\n", b"[terrain]\n[gait]\n"])
def test_a_scenario_without_a_value_is_refused(content, tmp_path):
    # It would put the usual scenario in place of the present one.
    with pytest.raises(InvalidInput, match=r"no values|is empty|only comments") as refusal:
        with_file(PAPER, Load(what="scenario", name="x.toml", content=content), tmp_path)
    assert "x.toml" in str(refusal.value)


@pytest.mark.parametrize(
    ("walks", "line", "words"),
    [
        ("by itself", "[simulation]\ndt = 1e-6", "dt is 1e-06 s; in the studio it must be at lea"),
        ("the plan", "[stride]\nperiod = 2\nsamples = 100000", "the plan has 5e\\+05 samples"),
    ],
)
def test_a_scenario_that_would_freeze_the_page_is_refused_before_it_is_built(
    tmp_path, walks, line, words
):
    setting = replace(PAPER, walks=walks)
    with pytest.raises(InvalidInput, match=words):
        with_file(setting, Load(what="scenario", name="x.toml", content=line.encode()), tmp_path)
    if walks == "the plan":
        # Where no plan is made it costs nothing.
        with_file(PAPER, Load(what="scenario", name="x.toml", content=line.encode()), tmp_path)


@pytest.mark.parametrize(
    "line",
    [
        'robot = "{}/secret.toml"',
        'robot = "../secret.toml"',
        'robot = "secret.urdf"',
        'gait = "../secret.toml"',
        '[gait]\nname = "{}/secret.toml"',
        '[terrain]\nkind = "height-map"\nheight_map = "{}/secret.csv"',
        '[terrain]\nkind = "flat"\nheight_map = "../secret.csv"',
        'robot = "mine.urdf"',
        '[robot_import]\npackage = "x=.."',
    ],
)
def test_an_uploaded_scenario_reads_no_file_of_the_machine(tmp_path, line):
    for name in ("secret.toml", "secret.urdf", "secret.csv"):
        (tmp_path / name).write_text("0,0\n0,0\n")
    folder = tmp_path / "uploaded"
    folder.mkdir()
    save_robot(load_robot("quadruped"), folder / "mine.urdf")
    text = line.replace("{}", tmp_path.as_posix()).encode()
    words = (
        "must have the robot of a preset|must contain its gait|a file that was not loaded|"
        "must name none"
    )
    with pytest.raises(InvalidInput, match=words):
        with_file(PAPER, Load(what="scenario", name="x.toml", content=text), folder)


def test_every_text_of_a_scenario_that_can_name_a_file_is_checked_when_uploaded():
    # A new field of text must be added to the test above, or here where it names no file.
    harmless = {"name", "description", "robot_import.foot", "robot_import.servo_model"}
    checked = {"robot", "gait.name", "terrain.height_map"}
    checked |= {"robot_import.package"}
    texts = {
        ".".join(path)
        for path, field in leaves(Scenario)
        if field.annotation is str or str in get_args(field.annotation)
    }
    assert texts == harmless | checked


def test_fields_without_effect_are_not_shown():
    def names(setting):
        return {field["name"] for field in chain(*catalogue(setting).values())}

    driven, planned = names(PAPER), names(field_of("walks").changed(PAPER, "the plan"))
    assert planned - driven == {"step_length", "stance_law", "stance_timing"}
    assert driven - planned >= {"controller", "ground_sensing", "body_height", "roll"}
    learned = names(field_of("controller").changed(PAPER, "walk"))
    assert driven - learned >= {"gait", "period", "step_height", "roll"}
    assert "slope" not in driven
    assert "slope" in names(field_of("terrain").changed(PAPER, "slope"))
    # The simulator of this law follows plans only.
    assert "simscape" not in told(PAPER, "contact_law")["choices"]
