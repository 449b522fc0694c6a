"""Every row passes, and none is weaker than the charter of physics tests."""

import math
from dataclasses import replace

import pytest

import phasmid
from phasmid.errors import InvalidInput
from phasmid.verification import CHECKS, Row, Verdict, verify

# Number, words of the case, and the widest tolerance that the charter allows it; for what is
# relative to an expected value, as a part of that. None: reported, with no claim.
CHARTER = [
    (1, "too low", "1 %"),
    (1, "RK4", 1e-12),
    (2, "semi-implicit", 1e-6),
    (2, "RK4", 1e-9),
    (3, "RK4", 1e-8),
    (3, "semi-implicit", 2e-3),
    (4, "order, semi-implicit", 0.1),
    (4, "order, RK4", 0.1),
    (5, "linear, RK4", 1e-9),
    (5, "angular, RK4", 1e-9),
    (5, "linear, implicit", 1e-2),
    (5, "angular, implicit", 1e-2),
    (6, "FK(IK(p))", 1e-12),
    (6, "IK(FK(q))", 1e-12),
    (6, "stretch", 1e-12),
    (7, "", 1e-14),
    (8, "", 1e-13),
    (9, "", 1e-9),
    (10, "closed form", 1e-10),
    (10, "engine", 1e-10),
    (11, "asymmetry", 1e-11),
    (11, "kinetic energy", 1e-11),
    (11, "skew", 1e-11),
    (12, "recursion", 1e-9),
    (12, "trunk", 1e-9),
    (12, "own inverse", 1e-9),
    (13, "", 1e-9),
    (14, "ΣF", 1e-6),
    (14, "ΣM", 1e-6),
    (15, "statics", 1e-9),
    (15, "leg 2", "2 %"),
    (15, "leg 5", "2 %"),
    (16, "0.3", 0.5),
    (16, "0.7", 0.5),
    (17, "bound", 1e-4),
    (18, "way, μ = 0.3", "0.5 %"),
    (18, "way, μ = 0.7", "0.5 %"),
    (19, "beyond", 1e-9),
    (19, "short of", 1e-9),
    (19, "along", 1e-9),
    (20, "", 1e-9),
    (21, "torque, ideal-servo", 1e-9),
    (21, "torque at speed, ideal-servo", 1e-9),
    (21, "speed, ideal-servo", 1e-9),
    (21, "range, ideal-servo", 1e-9),
    (21, "torque, torque", 1e-9),
    (21, "torque at speed, torque", 1e-9),
    (21, "speed, torque", 1e-9),
    (21, "torque, servo", 1e-9),
    (21, "supply, servo", 1e-9),
    (21, "current, off the motor's law, servo", 1e-9),
    (21, "friction explains, servo", 1e-9),
    (21, "range and a step of the sensor, servo", 1e-9),
    (22, "equilibrium", 1e-9),
    (22, "KKT", 1e-9),
    (22, "second", 1e-7),
    (23, "blend", 1e-12),
    (23, "lift", 1e-12),
    (23, "join", 1e-12),
    (23, "quotient", 1e-11),
    (24, "three feet", 0.0),
    (24, "no margin", 0.0),
    (24, "support function", 1e-12),
    (24, "duty", 1e-9),
    (25, "", 0.002),
    (26, "", 0.0),
    (27, "mirror", 1e-9),
    (27, "order", 1e-9),
    (27, "world", 1e-9),
    (28, "normal", 0.5),
    (28, "torques", 0.5),
    (29, "twice", 0.0),
    (29, "reloaded", 0.0),
    (29, "own words", 0.0),
    (29, "gone on", 0.0),
    (30, "coxa", None),
    (30, "femur", None),
    (30, "tibia", None),
]


@pytest.mark.parametrize("number", CHECKS)
def test_each_check_passes(number, measured):
    for row in measured(number):
        assert row.verdict is not Verdict.FAILS, row
        assert row.why.endswith(".")
        assert row.number == number


@pytest.mark.parametrize(("number", "words", "widest"), CHARTER)
def test_no_row_is_weaker_than_the_charter(number, words, widest, measured):
    rows = [row for row in measured(number) if words in row.case]
    assert rows
    for row in rows:
        if widest is None:
            assert row.tolerance is None
        elif isinstance(widest, str):
            assert row.tolerance <= float(widest[:-2]) / 100 * abs(row.expected) * (1 + 1e-12)
        elif row.tolerance is not None:
            assert row.tolerance <= widest


def test_all_rows_of_the_charter_are_there():
    assert list(CHECKS) == list(range(1, 31))
    assert {number for number, _, _ in CHARTER} == set(CHECKS)


ROW = Row(1, "a", "b", "c", expected=1.0, got=1.1, tolerance=0.2, unit="m", why="d.", seconds=0.0)


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, Verdict.PASSES),
        ({"got": 1.2, "tolerance": 0.25}, Verdict.PASSES),
        ({"got": 1.3}, Verdict.FAILS),
        ({"got": 0.7}, Verdict.FAILS),
        ({"got": 1.0, "tolerance": 0.0}, Verdict.PASSES),
        ({"got": 1.0 + 1e-15, "tolerance": 0.0}, Verdict.FAILS),
        ({"tolerance": None}, Verdict.REPORTED),
        # What could not be measured is no pass, even where nothing is claimed.
        ({"got": math.nan}, Verdict.FAILS),
        ({"got": math.inf, "tolerance": None}, Verdict.FAILS),
    ],
)
def test_a_row_passes_within_its_tolerance_and_never_without_a_number(changes, verdict):
    assert replace(ROW, **changes).verdict is verdict


def test_a_row_s_dictionary_is_fit_for_json():
    row = replace(ROW, got=math.nan).as_dict()
    assert row["got"] is None
    assert row["verdict"] == "FAILS"


def test_verify_runs_the_rows_that_are_named_in_order():
    told = []
    rows = phasmid.verify([8, 7, 8], progress=lambda check: told.append(check.number))
    assert [row.number for row in rows] == [7, 8]
    assert told == [7, 8]


@pytest.mark.parametrize(
    ("numbers", "what"),
    [
        ([31], "there is no row 31; rows are 1 to 30."),
        ([1, 0], "there is no row 0; rows are 1 to 30."),
        ([], "no row is named; there must be one at least."),
    ],
)
def test_a_row_that_is_not_there_is_refused(numbers, what):
    with pytest.raises(InvalidInput) as caught:
        verify(numbers)
    assert caught.value.what == what
