"""Scenario files and fields: what is read, written, changed, refused."""

import pickle

import numpy as np
import pytest

from phasmid.errors import InvalidGait, InvalidInput
from phasmid.robot import load_robot
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
        {
            "step_length": 1 / 3e3,
            "gait": {"name": "mine", "duty_factor": 0.7, "offsets": [0.0] * 6},
        },
        {"force_model": "friction-cone", "torque_limits": "counted", "load_transfer": 0.15},
        {"description": 'quotes " and \\ and é', "stance_radius_mm": 140},
    ):
        try:
            scenario = load_scenario("paper").replace(**changes)
        except InvalidGait:
            raise
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


def test_a_robot_object_may_stand_in_a_scenario():
    robot = load_robot("phantomx-mk4")
    assert load_scenario("paper").replace(robot=robot).load_robot().name == "phantomx-mk4"


def test_a_robots_file_is_read_once_and_again_where_another_is_named(monkeypatch):
    read = []

    def load(source):
        read.append(source)
        return load_robot(source)

    monkeypatch.setattr("phasmid.scenario.scenario.load_robot", load)
    scenario = Scenario(robot="quadruped")
    robot = scenario.load_robot()
    changed = scenario.replace(duration=3.0)
    assert changed.base_robot() is scenario.base_robot()
    assert len(read) == 1
    assert scenario.replace(robot="octopod").load_robot().name == "octopod"
    assert scenario.model_copy(update={"robot": "octopod"}).load_robot().name == "octopod"
    assert len(read) == 3
    # It is no part of what the scenario says, nor goes with it to another process.
    assert scenario == Scenario(robot="quadruped")
    again = pickle.loads(pickle.dumps(scenario))
    assert again == scenario
    assert again.load_robot().mass == robot.mass
    assert len(read) == 4


def test_stance_radius_and_body_height_move_the_neutral_feet():
    robot = load_scenario("paper").replace(stance_radius_mm=140, body_height_mm=90).load_robot()
    assert robot.legs[3].neutral_foot == pytest.approx([0.14, 0, -0.09])


def test_every_field_has_one_key_of_its_own():
    keys = option_keys()
    assert len(set(keys.values())) == len(keys)
    assert {"gait", "step_length_mm", "period", "drive", "dt", "friction", "mounts"} <= set(keys)


@pytest.mark.parametrize(
    ("changes", "what", "hint"),
    [
        pytest.param(
            {"step_height_mm": -30},
            "stride.step_height is -30 mm; it must be 0 or more.",
            "",
            id="G6",
        ),
        pytest.param(
            {"period": 0}, "stride.period is 0 s; it must be greater than 0.", "", id="G7"
        ),
        pytest.param(
            {"samples": 3},
            "stride.samples is 3; it must be 9 or more and 100000 or less.",
            "41, as the paper; two phases need 9",
            id="G8",
        ),
        pytest.param(
            {"dt": float("nan")},
            "simulation.dt is nan; it must be a finite number greater than 0.",
            "",
            id="C2",
        ),
        pytest.param(
            {"duration": 1e9},
            "1e+09 s at 1 ms is 1e+12 steps, with 1 s to settle; the limit is 1e+08.",
            "--max-steps, or a shorter duration",
            id="C3",
        ),
        pytest.param(
            {"duration": 50_000, "period": 10.0},
            "50000 s recorded every 1 ms is 5e+07 samples, about 105 GB; the limit is 4e+06.",
            "a longer --record-interval, or a shorter duration",
            id="memory",
        ),
        pytest.param(
            {"record_interval": 0.0015},
            "record_interval is 0.0015 s; it must be a whole number of steps of 0.001 s.",
            "",
            id="record-interval",
        ),
        pytest.param(
            {"drive": "motor"},
            'simulation.drive is "motor"; '
            'it must be "prescribed", "ideal-servo", "servo" or "torque".',
            "",
            id="choice",
        ),
        pytest.param(
            {"torque_limit": 2},
            "servo.torque_limit is 2; it must be 1 or less.",
            "",
            id="torque-limit",
        ),
        pytest.param(
            {"compliance_margin": "wide"},
            'servo.compliance_margin is "wide"; it must be a list.',
            "a number of ticks, or two of them, such as [1, 2]",
            id="compliance-margin",
        ),
        pytest.param(
            {"step_length": "far"},
            'stride.step_length is "far"; it must be a number.',
            "",
            id="text",
        ),
        pytest.param({"stepp": 1}, 'a scenario has no field "stepp".', "", id="unknown"),
        pytest.param(
            {"friction": -1},
            "terrain.friction is -1; it must be 0 or more.",
            "",
            id="friction",
        ),
        pytest.param(
            {"force_model": "least-squares"},
            'model.force_model is "least-squares"; it must be "minimum-norm", '
            '"weighted-minimum-norm", "minimum-torque", "friction-cone" or '
            '"smallest-largest-load".',
            "",
            id="force-model",
        ),
        pytest.param(
            {"tangential_weight": 0},
            "model.tangential_weight is 0; it must be greater than 0 and 1e+06 or less.",
            "",
            id="weight",
        ),
        pytest.param(
            {"load_transfer": -0.1},
            "model.load_transfer is -0.1 s; it must be 0 or more.",
            "",
            id="transfer",
        ),
    ],
)
def test_a_field_that_cannot_be_is_told_why(changes, what, hint):
    with pytest.raises(InvalidInput) as caught:
        load_scenario("paper").replace(**changes)
    assert (caught.value.what, caught.value.hint) == (what, hint)


def test_a_gait_needs_one_offset_per_leg():  # G3
    scenario = Scenario().replace(gait={"name": "five", "duty_factor": 0.8, "offsets": [0.0] * 5})
    with pytest.raises(InvalidGait) as caught:
        scenario.load_gait(6)
    assert caught.value.what == "gait.offsets has 5 values; one per leg, 6 in all."


def test_a_wrong_value_in_a_file_is_told_with_its_line(tmp_path):
    path = tmp_path / "walk.toml"
    path.write_text('name = "w"\n\n[stride]\nperiod = 2\nstep_height_mm = -30\n', encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        load_scenario(path)
    assert str(caught.value) == (
        "stride.step_height is -30 mm; it must be 0 or more.\n  in   walk.toml, line 5"
    )


def test_an_unknown_key_in_a_file_is_answered_with_the_nearest(tmp_path):
    path = tmp_path / "walk.toml"
    path.write_text("[stride]\nstep_heigt_mm = 30\n", encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        load_scenario(path)
    assert caught.value.what == 'unknown key "step_heigt_mm" in stride.'
    assert caught.value.hint == '"step_height_mm"'
    assert caught.value.where == "walk.toml, line 2"


@pytest.mark.parametrize(
    ("line", "table"), [("friction = 0.5", "terrain"), ("step_length_mm = 40", "stride")]
)
def test_a_key_outside_its_table_is_told_where_it_belongs(tmp_path, line, table):
    path = tmp_path / "walk.toml"
    path.write_text(line + "\n", encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        load_scenario(path)
    assert caught.value.hint == f"put it into [{table}]"


def test_a_robot_file_is_looked_for_beside_its_scenario(tmp_path):
    from phasmid.robot import robot_to_toml

    (tmp_path / "mine.toml").write_text(robot_to_toml(load_robot("phantomx-ax")), encoding="utf-8")
    (tmp_path / "walk.toml").write_text('robot = "mine.toml"\n', encoding="utf-8")
    assert load_scenario(tmp_path / "walk.toml").load_robot().name == "phantomx-ax"


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(InvalidInput, match=r"nothing\.toml does not exist"):
        load_scenario(tmp_path / "nothing.toml")


@pytest.mark.parametrize(
    "changes", [{"step_length_mm": "40"}, {"period_ms": True}, {"step_turn_deg": "1"}]
)
def test_numbers_in_quotes_and_truths_are_no_numbers(changes):
    with pytest.raises(InvalidInput, match="it must be a number"):
        load_scenario("paper").replace(**changes)


@pytest.mark.parametrize(
    "changes",
    [{"step_length": 0.05, "step_length_mm": 60}, {"step_length_mm": 60, "step_length": 0.05}],
)
def test_one_field_in_two_units_is_refused_in_either_order(changes):
    with pytest.raises(InvalidInput, match="are one field; one must go"):
        load_scenario("paper").replace(**changes)


def test_a_misspelt_field_is_answered_with_its_unit():
    with pytest.raises(InvalidInput) as caught:
        load_scenario("paper").replace(step_lenght=60)
    assert caught.value.hint == '"step_length_mm"'


def test_a_gait_object_may_stand_in_a_scenario():
    from phasmid.gait import HEXAPOD_GAITS

    gait = load_scenario("paper").replace(gait=HEXAPOD_GAITS["wave"]).load_gait()
    assert gait.offsets == HEXAPOD_GAITS["wave"].offsets


@pytest.mark.parametrize(
    ("fields", "what"),
    [
        ({"duration": -1}, "duration is -1 s; it must be greater than 0."),
        ({"foo": 1}, 'unknown key "foo".'),
        ({"stride": 5}, "stride is 5; it must be a table."),
        ({"format": 2}, "format is 2; it must be 1 or more and 1 or less."),
        ({"format": True}, "format is true; it must be a whole number 1 or more and 1 or less."),
        ({"robot": 5}, None),
    ],
)
def test_a_scenario_made_by_hand_speaks_as_a_file_does(fields, what):
    with pytest.raises(InvalidInput) as caught:
        Scenario(**fields)
    assert what is None or caught.value.what == what


@pytest.mark.parametrize("changes", [{"dt": 1e-9, "duration": 1e-6}, {"dt": 1e-320}])
def test_settling_counts_among_the_steps(changes):
    with pytest.raises(InvalidInput, match="with 1 s to settle"):
        load_scenario("paper").replace(**changes)


def test_a_number_beyond_all_numbers_is_not_finite():
    with pytest.raises(InvalidInput, match="it must be a finite number"):
        load_scenario("paper").replace(step_length_mm=10**400)


def test_a_record_interval_below_a_step_is_refused():
    with pytest.raises(InvalidInput, match="record_interval is 1e-12 s; it must be a whole number"):
        Scenario(simulation={"record_interval": 1e-12})


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
