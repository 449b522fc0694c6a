"""A short walk, for the commands that read what was recorded."""

import shutil

import pytest

from phasmid import load_scenario, plan, save_recording, simulate
from phasmid.reporting import report


@pytest.fixture(scope="session", autouse=True)
def _compiled(compiled_engine):
    pass


@pytest.fixture(scope="session")
def run():
    scenario = load_scenario("paper").replace(duration=0.4)
    return simulate(scenario, plan(scenario))


@pytest.fixture(scope="session")
def results(run, tmp_path_factory):
    """A folder with two runs: ``results/a`` and ``b.nc``."""
    folder = tmp_path_factory.mktemp("results")
    report(run, folder / "results/a", figures=False)
    save_recording(run, folder / "b.nc")
    return folder


@pytest.fixture
def runs(results, here):
    """A copy of the folder with two runs, in which the test runs."""
    shutil.copytree(results, here, dirs_exist_ok=True)
    return here
