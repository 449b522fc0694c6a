"""Generated pages of the documentation are those of the present source."""

import pages.errata


def test_the_page_of_misprints_shows_the_table():
    # Two digits do not depend on the machine.
    assert pages.errata.PAGE.read_text("utf-8") == pages.errata.errata()
