"""Tables for other programs hold every bit, name every unit, and run nothing in a spreadsheet."""

import csv
import re

import numpy as np
import pytest

from phasmid.errors import InvalidInput, OutputError
from phasmid.recording import new_recording, save_csv
from phasmid.recording.table import columns, text_cell

RNG = np.random.default_rng(7)
LEGS = ("right_front", "left_front")


@pytest.fixture(scope="module")
def recording():
    """A few samples of numbers of all sizes."""
    size = 10.0 ** RNG.integers(-300, 300, (5, 2, 3))
    return new_recording(
        np.arange(5) / 3,
        {
            "joint_torque": RNG.standard_normal((5, 2, 3)) * size,
            "foot_normal_force": np.array([[0.1, np.nan]] * 4 + [[np.inf, -0.0]]),
            "contact": RNG.random((5, 2)) > 0.5,
            "body_position": RNG.standard_normal((5, 3)),
            "servo_temperature": np.full((5, 2, 3), 25.0),
        },
        {"scenario": 'name = "=1+1"', "robot": "", "time_step": 0.001},
    )


def read(path, delimiter=","):
    with path.open(encoding="utf-8", newline="") as file:
        heading, *rows = csv.reader(file, delimiter=delimiter)
    return heading, rows


def test_a_csv_gives_every_bit_back(recording, tmp_path):
    save_csv(recording, tmp_path / "a.csv", leg_names=LEGS)
    heading, rows = read(tmp_path / "a.csv")
    numbers = np.array(rows, dtype=float).T
    expected = columns(recording, LEGS)
    assert heading == list(expected)
    for column, values in zip(numbers, expected.values(), strict=True):
        # Equal bits, of -0 and of what is no number too.
        assert column.tobytes() == values.astype(float).tobytes()
    torque = recording["joint_torque"].values
    at = heading.index("joint_torque.left_front.femur [N m]")
    np.testing.assert_array_equal(numbers[at], torque[:, 1, 1])


def test_columns_are_named_with_leg_joint_and_unit(recording, tmp_path):
    heading = list(columns(recording, LEGS))
    assert heading[:3] == [
        "time [s]",
        "joint_torque.right_front.coxa [N m]",
        "joint_torque.right_front.femur [N m]",
    ]
    assert "servo_temperature.left_front.tibia [degC]" in heading
    assert "foot_normal_force.left_front [N]" in heading
    assert "body_position.z [m]" in heading
    assert "contact.right_front [1]" in heading
    assert "joint_torque.leg2.coxa [N m]" in columns(recording)
    assert len(heading) == 1 + 6 + 2 + 2 + 3 + 6
    for name in heading:
        assert re.fullmatch(r"[ -~]+ \[[^\]]+\]", name)
    # Legs whose names print alike keep a column each.
    found = columns(recording, ["a\t", "a\n"])
    assert {"foot_normal_force.a #1 [N]", "foot_normal_force.a #2 [N]"} <= set(found)
    with pytest.raises(InvalidInput, match="leg_names has 1 names; one per leg, 2 in all"):
        columns(recording, ["a"])


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
@pytest.mark.parametrize(
    "name",
    [
        "=cmd|' /C calc'!A0",
        "+1",
        "-2+3",
        "@SUM(A1)",
        "\t=1+1",
        "\r\n=1+1",
        'a";=1+1;"',
        'a",=1+1,"',
        "a; =1+1",
        "a|=1+1",
        "＝1+1",
    ],
)
def test_no_name_becomes_a_formula_whatever_the_spreadsheet_takes_for_a_separator(
    recording, tmp_path, name, delimiter
):
    save_csv(recording, tmp_path / "a.csv", leg_names=[name, "other"])
    text = (tmp_path / "a.csv").read_text("utf-8")
    assert text.count("\n") == 6
    heading, _ = read(tmp_path / "a.csv", delimiter)
    for cell in heading:
        assert not cell.lstrip('" ').startswith(tuple("=+-@\t\r＝＋－＠")), cell
    # And cut at any separator, as if there were no quotes.
    for cell in re.split(r'[;,|\t"]', text.split("\n")[0]):
        assert not cell.strip().startswith(tuple("=+-@＝＋－＠")), cell
    assert not text_cell(name).lstrip().startswith(tuple("=+-@＝＋－＠"))


def test_ordinary_names_stay_as_they_are():
    for name in ("right_front", "leg-1", "a=b", "fore + aft", "歩く"):
        assert text_cell(name) == name
    assert text_cell("=1") == "'=1"


def test_what_cannot_be_written_leaves_nothing(recording, tmp_path):
    with pytest.raises(OutputError, match=r"cannot write .*no such file"):
        save_csv(recording, tmp_path / "absent" / "a.csv")
    assert list(tmp_path.iterdir()) == []
