"""The page of misprints follows from the table."""

import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
sys.path.append(str(DOCS))
from errata_page import errata  # noqa: E402, needs the path above

PAGE = DOCS / "errata.md"


@pytest.fixture(scope="module")
def page() -> str:
    return errata()


def test_docs_errata_md_is_what_the_table_says(page: str) -> None:
    # Written anew by make errata; two digits do not depend on the machine.
    assert PAGE.read_text(encoding="utf-8") == page
