"""Experiments on physics against closed forms, conservation laws and independent calculations."""

import pytest

from pages.verification import PAGE, page
from physics.bench import Bench
from physics.checks import CHECKS


@pytest.fixture(scope="session")
def rows():
    """The rows of a check by its number, each measured once."""
    bench, measured = Bench(), {}

    def measure(number):
        if number not in measured:
            measured[number] = list(CHECKS[number][-1](bench))
        return measured[number]

    return measure


@pytest.mark.parametrize("number", CHECKS)
def test_the_law_holds_within_its_derived_tolerance(number, rows):
    assert [row for row in rows(number) if not row.holds] == []


@pytest.mark.slow
def test_the_page_shows_these_experiments(rows):
    # The last digits of what was measured differ from machine to machine.
    def fixed(text):
        table = [line.split(" | ") for line in text.splitlines() if line.startswith("| ")]
        return [line[:2] + line[4:] for line in table], text[text.index("## How each") :]

    assert fixed(page({number: rows(number) for number in CHECKS})) == fixed(
        PAGE.read_text("utf-8")
    )
