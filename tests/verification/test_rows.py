"""Every row passes, and none is weaker than the charter of physics tests."""

import math
from dataclasses import replace

import pytest

from phasmid.errors import InvalidInput
from phasmid.verification import CHECKS, Row, Verdict, verify


@pytest.mark.parametrize("number", CHECKS)
def test_each_check_passes(number, measured):
    for row in measured(number):
        assert row.verdict is not Verdict.FAILS, row
        assert row.why.endswith(".")
        assert row.number == number


ROW = Row(case="c", expected=1.0, got=1.1, tolerance=0.2, unit="m", why="d.")


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


def test_no_row_at_all_is_refused():
    with pytest.raises(InvalidInput, match="no row is named"):
        verify([])
