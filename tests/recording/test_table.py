"""Tables for other programs hold every bit, name every unit, and run nothing in a spreadsheet."""

import csv
import re

import numpy as np
import pytest

from phasmid.errors import InvalidInput
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
    with pytest.raises(InvalidInput, match="leg_names has 1 names; one per leg, 2 in all"):
        columns(recording, ["a"])


FORMULAS = [
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
]


def test_no_name_becomes_a_formula_whatever_the_separator(recording, tmp_path):
    for name in FORMULAS:
        save_csv(recording, tmp_path / "a.csv", leg_names=[name, "other"])
        text = (tmp_path / "a.csv").read_text("utf-8")
        assert text.count("\n") == 6
        cells = [cell for mark in ",;\t|" for cell in read(tmp_path / "a.csv", mark)[0]]
        # And cut at any separator, as if there were no quotes.
        cells += re.split(r'[;,|\t"]', text.split("\n")[0])
        for cell in (*cells, text_cell(name)):
            assert not cell.lstrip('" ').startswith(tuple("=+-@\t\r＝＋－＠")), cell
    for name in ("right_front", "leg-1", "a=b", "fore + aft", "歩く"):
        assert text_cell(name) == name
