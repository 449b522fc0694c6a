"""One laboratory for all tests that do not break it: its walks are made once."""

import pytest

from phasmid.verification import CHECKS
from phasmid.verification.laboratory import Laboratory


@pytest.fixture(scope="session")
def measured():
    """Rows of a check by its number, each check run once."""
    laboratory, found = Laboratory(), {}

    def rows(number):
        if number not in found:
            found[number] = CHECKS[number].rows(laboratory)
        return found[number]

    return rows
