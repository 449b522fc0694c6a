"""Generated pages of the documentation are those of the present source."""

from pathlib import Path

import pages.errata
import pages.servos

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_of_misprints_shows_the_table():
    # Two digits do not depend on the machine.
    assert pages.errata.PAGE.read_text("utf-8") == pages.errata.errata()


def test_the_page_on_servos_has_the_numbers_of_the_catalogue():
    page = (DOCS / "servos.md").read_text("utf-8")
    assert pages.servos.numbers() in page
    assert pages.servos.sources() in page
