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


def by_name(offsets):
    """Return the text of a gait file with offsets by the names of legs."""
    return "duty_factor = 0.8\n[offsets]\n" + "".join(f"{k} = {v}\n" for k, v in offsets.items())


def test_offsets_go_by_the_order_of_the_legs_or_by_their_names_in_any_order(tmp_path):
    gait = load_gait(written(tmp_path, WAVE + "sway = 0.1\n"))
    assert (gait.name, gait.duty_factor, gait.sway) == ("mine", 0.8, 0.1)
    assert gait.offsets == (0, 0.8, 0.6, 0.2, 0.3, 0.5)
    offsets = {name: i / 8 for i, name in enumerate(reversed(NAMES))}
    gait = load_gait(str(written(tmp_path, by_name(offsets))), leg_names=NAMES)
    assert gait.offsets == tuple(offsets[name] for name in NAMES)


def test_a_scenario_takes_its_gait_from_a_file_beside_it(tmp_path):
    written(tmp_path, WAVE)
    scenario = load_scenario(written(tmp_path, 'gait = "mine.toml"\n', "trial.toml"))
    assert scenario.load_gait().offsets == (0, 0.8, 0.6, 0.2, 0.3, 0.5)
    written(tmp_path, '[gait]\nname = "mine.toml"\nsway = 0.05\n', "swaying.toml")
    assert load_scenario(tmp_path / "swaying.toml").load_gait().sway == 0.05


def test_a_scenario_repeats_without_the_file_of_its_gait(tmp_path):
    offsets = dict(zip(NAMES, (0, 0.8, 0.6, 0.2, 0.3, 0.5), strict=True))
    path = written(tmp_path, by_name(offsets))
    scenario = load_scenario("paper").replace(gait=str(path), duration=2.0)
    assert scenario.replace(duty_factor=0.9).load_gait(6, NAMES).duty_factor == 0.9
    walk = plan(scenario)
    path.unlink()
    again = load_scenario(written(tmp_path, scenario_to_toml(scenario, "phantomx-paper")))
    assert again.gait == scenario.gait
    assert plan(again).gait == walk.gait
    assert walk.gait.offsets == tuple(offsets.values())


DUTY, TRIPOD = "duty_factor", "offsets = [0, 0.5, 0, 0.5, 0, 0.5]\n"
FALLS = 'gait "mine" leaves {} feet on the ground, {} at phase {:.2f}; at least 3 are needed.'


@pytest.mark.parametrize(
    ("text", "what", "line", "hint"),
    [
        (f"{DUTY} = 1.4\n{TRIPOD}", "gait.duty_factor is 1.4; it must be", 1, f"{DUTY} = 0.5, as "),
        (f"{DUTY} = 0.3\n{TRIPOD}", FALLS.format("0 to 3", 0, 0.1), 2, f"{DUTY} = 0.5 or more"),
        (f"{DUTY} = 0.5\noffsets = [0, 0.5, 1.7, 0.5, 0, 0.5]\n", "gait.offsets[2] is 1.7;", 2, ""),
        (f"{DUTY} = 0.8\noffsets = [0, 0.8, 0.6, 0.2, 0.3]\n", "gait.offsets has 5 values;", 0, ""),
        (f"dutyfactor = 0.5\n{TRIPOD}", 'unknown key "dutyfactor".', 1, '"duty_factor"'),
        (TRIPOD, "duty_factor is missing.", 0, "duty_factor = ..."),
        (
            f"{DUTY} = 0.5\noffsets = {{ right_front = 0, left_front = 0.5, x = 0, y = 0 }}\n",
            FALLS.format("1 to 3", 1, 0.25),
            2,
            "offsets = [0.0, 0.25, 0.5, 0.75]",
        ),
    ],
)
def test_a_gait_file_that_cannot_be_says_why(tmp_path, text, what, line, hint):
    with pytest.raises(InvalidInput) as caught:
        load_gait(written(tmp_path, text), leg_names=NAMES)
    assert caught.value.what.startswith(what)
    assert caught.value.hint.startswith(hint)
    assert caught.value.where == (f"mine.toml, line {line}" if line else "mine.toml")


def test_offsets_of_legs_that_the_robot_lacks_are_refused(tmp_path):
    legs = (*NAMES[:5], "left_fornt")
    path = written(tmp_path, by_name({name: i / 6 for i, name in enumerate(legs)}))
    with pytest.raises(InvalidGait, match=r'names a leg "left_fornt"; (.|\n)*try  "left_front"'):
        load_gait(path, leg_names=NAMES)
    with pytest.raises(InvalidGait, match=r"gait\.offsets go by the names of legs"):
        load_gait(path)


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
