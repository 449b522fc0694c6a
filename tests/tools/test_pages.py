"""Generated pages of the documentation are those of the present source; every program loads."""

import runpy
from importlib import import_module
from pathlib import Path

import pytest

import pages.__main__
import pages.errata
import pages.servos
from phasmid.errors import InvalidInput

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PROGRAMS = sorted([*ROOT.glob("benchmarks/*.py"), *ROOT.glob("tools/fuzz/*.py")])
OWN = {
    path.stem for name in ("src", "tests", "tools", "benchmarks") for path in ROOT.glob(f"{name}/*")
}


def loaded(load, *arguments):
    """What a function loads; the test is skipped where a package of others is absent."""
    try:
        return load(*arguments)
    except (ModuleNotFoundError, InvalidInput) as error:
        if str(getattr(error, "name", "")).partition(".")[0] in OWN:
            raise
        pytest.skip(str(error))


def test_the_page_of_misprints_shows_the_table():
    # Two digits do not depend on the machine.
    assert pages.errata.PAGE.read_text("utf-8") == pages.errata.errata()


def test_the_page_on_servos_has_the_numbers_of_the_catalogue():
    page = (DOCS / "servos.md").read_text("utf-8")
    assert pages.servos.numbers() in page
    assert pages.servos.sources() in page


@pytest.mark.parametrize("name", pages.__main__.pages())
def test_a_page_has_a_module_that_writes_it(name):
    assert callable(loaded(import_module, f"pages.{name}").main)


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_benchmarks_and_fuzzers_load(path, monkeypatch):
    # A program finds those beside it.
    monkeypatch.syspath_prepend(path.parent)
    loaded(runpy.run_path, str(path), None, "loaded")
