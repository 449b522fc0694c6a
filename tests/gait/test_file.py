"""Gait files: offsets by order or name, and refusals."""

import os

import pytest

from phasmid.errors import InvalidGait, InvalidInput
from phasmid.gait import load_gait
from phasmid.motion import plan
from phasmid.robot import load_robot
from phasmid.scenario import load_scenario, scenario_to_toml

NAMES = [leg.name for leg in load_robot("phantomx-paper").legs]

WAVE = "duty_factor = 0.8\noffsets = [0, 0.8, 0.6, 0.2, 0.3, 0.5]\n"


def written(folder, text, name="mine.toml"):
    path = folder / name
    path.write_text(text)
    return path


def test_offsets_go_by_the_order_of_the_legs(tmp_path):
    gait = load_gait(written(tmp_path, WAVE + "sway = 0.1\n"))
    assert (gait.name, gait.duty_factor, gait.sway) == ("mine", 0.8, 0.1)
    assert gait.offsets == (0, 0.8, 0.6, 0.2, 0.3, 0.5)


def test_offsets_go_by_the_names_of_the_legs_in_any_order(tmp_path):
    by_name = {name: i / 8 for i, name in enumerate(reversed(NAMES))}
    text = "duty_factor = 0.75\n[offsets]\n" + "".join(f"{k} = {v}\n" for k, v in by_name.items())
    gait = load_gait(str(written(tmp_path, text)), leg_names=NAMES)
    assert gait.offsets == tuple(by_name[name] for name in NAMES)


def test_a_gait_that_is_copied_out_of_a_scenario_is_read(tmp_path):
    assert load_gait(written(tmp_path, f"[gait]\n{WAVE}")).duty_factor == 0.8


def test_a_scenario_takes_its_gait_from_a_file_beside_it(tmp_path):
    written(tmp_path, WAVE)
    scenario = load_scenario(written(tmp_path, 'gait = "mine.toml"\n', "trial.toml"))
    assert scenario.load_gait().offsets == (0, 0.8, 0.6, 0.2, 0.3, 0.5)
    written(tmp_path, '[gait]\nname = "mine.toml"\nsway = 0.05\n', "swaying.toml")
    assert load_scenario(tmp_path / "swaying.toml").load_gait().sway == 0.05


def test_a_scenario_repeats_without_the_file_of_its_gait(tmp_path):
    by_name = dict(zip(NAMES, (0, 0.8, 0.6, 0.2, 0.3, 0.5), strict=True))
    text = "duty_factor = 0.8\n[offsets]\n" + "".join(f"{k} = {v}\n" for k, v in by_name.items())
    path = written(tmp_path, text)
    scenario = load_scenario("paper").replace(gait=str(path), duration=2.0)
    walk = plan(scenario)
    path.unlink()
    again = load_scenario(written(tmp_path, scenario_to_toml(scenario, "phantomx-paper")))
    assert again.gait == scenario.gait
    assert plan(again).gait == walk.gait
    assert walk.gait.offsets == tuple(by_name.values())


def test_a_duty_factor_beside_a_file_replaces_its_own(tmp_path):
    scenario = load_scenario("paper").replace(gait=str(written(tmp_path, WAVE)), duty_factor=0.9)
    assert scenario.load_gait().duty_factor == 0.9


@pytest.mark.parametrize(
    ("text", "what", "where", "hint"),
    [
        pytest.param(
            "duty_factor = 1.4\noffsets = [0, 0.5, 0, 0.5, 0, 0.5]\n",
            "gait.duty_factor is 1.4; it must be greater than 0 and less than 1.",
            "mine.toml, line 1",
            "duty_factor = 0.5, the tripod gait of the paper",
            id="G1",
        ),
        pytest.param(
            "duty_factor = 0.3\noffsets = [0, 0.5, 0, 0.5, 0, 0.5]\n",
            'gait "mine" leaves 0 to 3 feet on the ground, 0 at phase 0.10; at least 3 are needed.',
            "mine.toml, line 2",
            "duty_factor = 0.5 or more",
            id="G2",
        ),
        pytest.param(
            "duty_factor = 0.5\noffsets = [0, 0.5, 1.7, 0.5, 0, 0.5]\n",
            "gait.offsets[2] is 1.7; offsets are phases in [0, 1).",
            "mine.toml, line 2",
            "",
            id="G4",
        ),
        pytest.param(
            "duty_factor = 0.8\noffsets = [0, 0.8, 0.6, 0.2, 0.3]\n",
            "gait.offsets has 5 values; one per leg, 6 in all.",
            "mine.toml",
            "",
            id="G3",
        ),
        pytest.param(
            "dutyfactor = 0.5\noffsets = [0, 0.5, 0, 0.5, 0, 0.5]\n",
            'unknown key "dutyfactor".',
            "mine.toml, line 1",
            '"duty_factor"',
            id="unknown-key",
        ),
        pytest.param(
            "offsets = [0, 0.5, 0, 0.5, 0, 0.5]\n",
            "gait.duty_factor is missing; a gait file has duty_factor and offsets.",
            "mine.toml",
            "duty_factor = 0.5 and offsets = [0, 0.5, 0, 0.5, 0, 0.5]",
            id="incomplete",
        ),
        pytest.param(
            'name = "empty"\n',
            "gait.offsets is missing; a gait file has duty_factor and offsets.",
            "mine.toml",
            "duty_factor = 0.5 and offsets = [0, 0.5, 0, 0.5, 0, 0.5]",
            id="no-offsets",
        ),
        pytest.param(
            "duty_factor = 0.5\noffsets = []\n",
            "gait.offsets is empty; it must have a value per leg.",
            "mine.toml",
            "",
            id="empty",
        ),
        pytest.param(
            "duty_factor = 0.5\noffsets = { right_front = 0, left_front = 0.5, x = 0, y = 0 }\n",
            'gait "mine" leaves 2 to 3 feet on the ground, 3 at phase 0.25; at least 3 are needed.',
            "mine.toml, line 2",
            "",
            id="G2-named",
        ),
    ],
)
def test_a_gait_file_that_cannot_be_says_why(tmp_path, request, text, what, where, hint):
    with pytest.raises(InvalidInput) as caught:
        load_gait(written(tmp_path, text), leg_names=NAMES)
    if request.node.callspec.id != "G2-named":
        assert (caught.value.what, caught.value.hint) == (what, hint)
    assert caught.value.where == where


def test_legs_of_other_names_are_told(tmp_path):
    by_name = dict.fromkeys(NAMES[:5], 0.5) | {"left_fornt": 0.0, NAMES[0]: 0.0, NAMES[2]: 0.0}
    text = "duty_factor = 0.8\n[offsets]\n" + "".join(
        f"{k} = {i / 6}\n" for i, k in enumerate(by_name)
    )
    with pytest.raises(InvalidGait) as caught:
        load_gait(written(tmp_path, text), leg_names=NAMES)
    assert caught.value.what == (
        'gait.offsets names a leg "left_fornt"; the robot has none of that name.'
    )
    assert caught.value.hint == '"left_front"'
    with pytest.raises(InvalidGait, match=r"gait\.offsets go by the names of legs"):
        load_gait(tmp_path / "mine.toml")


def test_a_gait_file_that_is_absent_too_large_or_no_toml_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="does not exist"):
        load_scenario("paper").replace(gait="nowhere.toml")
    with pytest.raises(InvalidInput, match="holds more than 1000000 bytes"):
        load_gait(written(tmp_path, "#" * 1_000_001))
    with pytest.raises(InvalidInput, match="line 1"):
        load_gait(written(tmp_path, "offsets = [\n"))
    many = f"duty_factor = 0.5\noffsets = {[0.0] * 101}\n"
    with pytest.raises(InvalidInput, match=r"offsets is .*; it must be"):
        load_gait(written(tmp_path, many))
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.toml")
        with pytest.raises(InvalidInput, match="is not a file"):
            load_gait(tmp_path / "pipe.toml")
