"""Generated pages of the documentation are those of the present source; every program loads."""

import runpy
from importlib import import_module
from pathlib import Path

import pytest

import pages.__main__
import pages.errata
import pages.holding
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


def test_the_loss_of_a_daisy_chain_by_hand():
    # 2 × 0.2 m of 0.5 mm²; the first cable carries the current of three servos, the last of one.
    each = 2 * 0.2 * 0.020e-6 / 0.5e-6
    found = pages.holding.chain_drop(3, 0.8, 0.5e-6, 0.2)
    assert found == pytest.approx(0.8 * each * (3 + 2 + 1), rel=1e-12)


def test_the_page_on_holding_has_the_present_verdicts():
    page = pages.holding.PAGE.read_text("utf-8")
    with pages.holding.in_folder_of_robot():
        printed = pages.holding.output("advise", "--robot", pages.holding.ROBOT)
        assert printed in page
        # The verdict and the servos that hold better fit on a screen of 24 lines.
        assert len(printed.split("\n\nCurrent of")[0].splitlines()[2:]) <= 24
        assert pages.holding.verdicts(pages.holding.cases()) in page
    assert pages.holding.chains() in page


@pytest.mark.slow
def test_the_page_on_holding_has_the_present_walks():
    """Simulated shares of the stall torque lie between the bounds of their verdicts."""
    page = pages.holding.PAGE.read_text("utf-8")
    with pages.holding.in_folder_of_robot():
        cases = pages.holding.cases()
        assert pages.holding.walks(cases) in page
    for case in cases:
        high, low = case.advice.verdict.peak_share
        assert low <= case.simulated.share <= high


@pytest.mark.parametrize("name", pages.__main__.pages())
def test_a_page_has_a_module_that_writes_it(name):
    assert callable(loaded(import_module, f"pages.{name}").main)


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_benchmarks_and_fuzzers_load(path, monkeypatch):
    # A program finds those beside it.
    monkeypatch.syspath_prepend(path.parent)
    loaded(runpy.run_path, str(path), None, "loaded")
