"""Scenario files and fields: what is read, written, changed, refused."""

import pickle

import numpy as np
import pytest

from phasmid.errors import InvalidGait, InvalidInput
from phasmid.gait import HEXAPOD_GAITS
from phasmid.robot import load_robot, robot_to_toml
from phasmid.scenario import Scenario, load_scenario, option_keys, scenario_to_toml


def test_the_papers_scenario_is_40_30_mm_2_s_41_samples_10_s():
    scenario = load_scenario("paper")
    stride = scenario.stride
    assert (stride.step_length, stride.step_height) == (0.040, 0.030)
    assert (stride.period, stride.samples, scenario.duration) == (2.0, 41, 10.0)
    assert scenario.load_gait().name == "tripod"
    assert scenario.load_robot().name == "phantomx-paper"


def test_a_scenario_written_and_read_again_is_the_same(tmp_path):
    for changes in (
        {},
        {"step_length_mm": 37.3, "step_turn_deg": 5, "robot": "phantomx-ax"},
        {"step_length": 1 / 3e3, "gait": {"duty_factor": 0.7, "offsets": [0.0] * 6}},
        {"force_model": "friction-cone", "torque_limits": "counted", "load_transfer": 0.15},
        {"terrain": "stepping-stones", "stone_distance_mm": 160, "terrain_seed": 7},
        {"terrain": "beams", "beam_width_mm": 30, "beam_height_mm": 45, "beam_distance_mm": 190},
        {"terrain": "course", "course_level": 0.75},
        {"description": 'quotes " and \\ and é', "stance_radius_mm": 140},
    ):
        scenario = load_scenario("paper").replace(**changes)
        path = tmp_path / "s.toml"
        path.write_text(scenario_to_toml(scenario, str(scenario.robot)), encoding="utf-8")
        assert load_scenario(path) == scenario


def test_fields_are_replaced_by_name_with_or_without_a_unit():
    scenario = load_scenario("paper")
    assert scenario.replace(step_length_mm=60) == scenario.replace(step_length=0.06)
    assert scenario.replace(step_turn_deg=180).stride.step_turn == pytest.approx(np.pi)
    faster = scenario.replace(gait="wave", duty_factor=0.9)
    assert faster.load_gait().duty_factor == 0.9
    assert scenario.stride.step_length == 0.04
    assert scenario.replace(gait=HEXAPOD_GAITS["wave"]).load_gait() == HEXAPOD_GAITS["wave"]
    robot = load_robot("phantomx-mk4")
    assert scenario.replace(robot=robot).load_robot().name == "phantomx-mk4"


def test_every_field_has_one_key_of_its_own():
    keys = option_keys()
    assert len(set(keys.values())) == len(keys)
    assert {"gait", "step_length_mm", "period", "drive", "dt", "friction", "mounts"} <= set(keys)


def test_a_robots_file_is_read_once_and_again_after_each_change(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(robot_to_toml(load_robot("quadruped")), encoding="utf-8")
    scenario = Scenario(robot=str(path))
    first = scenario.base_robot()
    assert scenario.replace(duration=3.0).base_robot() is first
    again = pickle.loads(pickle.dumps(scenario))
    assert again == scenario
    path.write_text(robot_to_toml(load_robot("octopod")), encoding="utf-8")
    assert again.load_robot().name == scenario.base_robot().name == "octopod"
    assert scenario.replace(robot="phantomx-ax").load_robot().name == "phantomx-ax"


def told(error):
    return f"{error.what} {error.hint}".strip()


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"step_height_mm": -30}, "stride.step_height is -30 mm; it must be 0 or more."),
        ({"step_turn_deg": 400}, "stride.step_turn is 400 deg; it must be -180 or more and 180 or"),
        ({"period": 0}, "stride.period is 0 s; it must be greater than 0."),
        ({"samples": 3}, "stride.samples is 3; it must be 9 or more and 100000 or less. samples"),
        ({"dt": float("nan")}, "simulation.dt is nan; it must be a finite number."),
        ({"duration": 1e9}, "1e+09 s at 1 ms is 1e+12 steps, with 1 s to settle; the limit is"),
        ({"duration": 50_000, "period": 10.0}, "50000 s recorded every 1 ms is 5e+07 samples, ab"),
        ({"record_interval": 0.0015, "dt": 0.001}, "record_interval is 0.0015 s; it must be a w"),
        ({"drive": "motor"}, 'simulation.drive is "motor"; it must be "prescribed", "ideal-servo"'),
        ({"compliance_margin": "wide"}, 'servo.compliance_margin is "wide"; it must be a list.'),
        ({"step_length": "far"}, 'stride.step_length is "far"; it must be a number.'),
        ({"step_length_mm": 10**400}, "stride.step_length is more than 1e308 mm; it must be a fi"),
        ({"stepp": 1}, 'a scenario has no field "stepp".'),
        ({"step_lenght": 60}, 'a scenario has no field "step_lenght". "step_length_mm"'),
        ({"step_length": 0.05, "step_length_mm": 60}, '"step_length" and "step_length_mm" are on'),
    ],
)
def test_a_field_that_cannot_be_is_told_why(changes, sentence):
    with pytest.raises(InvalidInput) as caught:
        load_scenario("paper").replace(**changes)
    assert told(caught.value).startswith(sentence)


@pytest.mark.parametrize(
    ("fields", "what"),
    [
        ({"duration": -1}, "duration is -1 s; it must be greater than 0."),
        ({"foo": 1}, 'unknown key "foo".'),
        ({"stride": 5}, "stride is 5; it must be a table."),
        ({"format": 2}, "format is 2; it must be 1 or more and 1 or less."),
    ],
)
def test_a_scenario_made_by_hand_speaks_as_a_file_does(fields, what):
    with pytest.raises(InvalidInput) as caught:
        Scenario(**fields)
    assert caught.value.what.startswith(what)


@pytest.mark.parametrize(
    ("text", "what", "line", "hint"),
    [
        ('name = "w"\n\n[stride]\nstep_height_mm = -30\n', "stride.step_height is -30 mm;", 4, ""),
        ("[stride]\nstep_heigt_mm = 3\n", 'unknown key "step_heigt_mm"', 2, '"step_height_mm"'),
        ("friction = 1\n", 'unknown key "friction".', 1, "put it into [terrain]"),
        ("gait = { duty_factor = 0.8, offsets = [0, 0, 0] }", "gait.offsets has 3 values;", 0, ""),
    ],
)
def test_a_wrong_file_is_told_with_its_line(tmp_path, text, what, line, hint):
    path = tmp_path / "walk.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        load_scenario(path).load_gait(6)
    assert caught.value.what.startswith(what)
    assert caught.value.where == (f"walk.toml, line {line}" if line else "")
    assert caught.value.hint == hint


def test_a_robot_file_is_looked_for_beside_its_scenario(tmp_path):
    (tmp_path / "mine.toml").write_text(robot_to_toml(load_robot("phantomx-ax")), encoding="utf-8")
    (tmp_path / "walk.toml").write_text('robot = "mine.toml"\n', encoding="utf-8")
    assert load_scenario(tmp_path / "walk.toml").load_robot().name == "phantomx-ax"


@pytest.mark.parametrize(
    "fields",
    [
        {"description": "a\udc80"},
        {"robot": "a\ud800.toml"},
        {"gait": {"name": "\udfff"}},
        {"terrain": {"height_map": "\udc80.npy"}},
    ],
)
def test_text_that_no_file_can_hold_is_refused(fields):
    with pytest.raises(InvalidInput, match="text that a file can hold"):
        Scenario(**fields)


@pytest.mark.parametrize(
    ("legs", "changes", "name"),
    [
        (6, {"offsets": [0, 0.5, 0.05, 0.55, 0.1, 0.6]}, "custom (β = 0.6)"),
        (6, {"offsets": [0, 0.5] * 3}, "custom (β = 0.6)"),
        (8, {"offsets": [0, 0.5] * 4}, "custom (β = 0.6)"),
        (6, {"gait": "tripod"}, "tripod (β = 0.6)"),
        (6, {"offsets": [0, 0.5] * 3, "duty_factor": 0.5}, "tripod"),
        (6, {"gait": {"name": "mine", "offsets": [0, 0.5] * 3}}, "mine"),
        (6, {"gait": "wave", "duty_factor": None}, "wave"),
    ],
)
def test_a_gait_has_the_name_of_the_library_only_with_its_numbers(legs, changes, name):
    """Offsets of one's own under the default name, or a name of the library, are a custom gait."""
    gait = load_scenario("paper").replace(**{"duty_factor": 0.6, **changes}).load_gait(legs)
    assert gait.name == name
    assert Scenario(gait=gait).load_gait(legs) == gait


def test_replace_takes_values_of_the_robots_file():
    """The keys are those of a study's axes: `*` stands for all legs, units end a key."""
    scenario = load_scenario("paper")
    changed = scenario.replace(
        **{"robot.legs.*.tibia_mm": 60, "robot.body.mass_g": 900, "robot.servo": "MG996R"},
        robot="phantomx-ax",
        gait="wave",
    )
    robot = changed.load_robot()
    assert {leg.tibia.length for leg in robot.legs} == {0.06}
    assert (robot.body.mass, robot.servo.name, robot.name) == (0.9, "MG996R", "phantomx-ax")
    assert changed.gait.name == "wave"
    assert load_robot("phantomx-ax").legs[0].tibia.length == 0.133
    for key, sentence in (
        ("robot.legs.*.tibja_mm", "unknown key"),
        ("robot.legz.*.tibia_mm", 'the robot has no table "legz"'),
        ("robot.body.mass_g", "mass is"),
    ):
        with pytest.raises(InvalidInput, match=sentence):
            scenario.replace(**{key: -1})


def test_an_unknown_gait_is_refused_also_where_the_robot_is_not_read(tmp_path, monkeypatch):
    """The robot is looked for beside the scenario, and a known gait needs none."""
    file = tmp_path / "s.toml"
    file.write_text('robot = "absent.toml"\ngait = "tripodd"\n')
    with pytest.raises(InvalidGait, match="tripodd") as caught:
        load_scenario(file)
    assert caught.value.hint.startswith('"tripod"')
    monkeypatch.setattr("phasmid.scenario.scenario.load_robot", lambda _: pytest.fail("it is read"))
    file.write_text('robot = "phantomx-ax"\ngait = "tripod"\n')
    assert load_scenario(file).gait.name == "tripod"
