"""A short simulated walk, and what tests that draw need."""

import pytest

from phasmid.motion import plan
from phasmid.reporting.film.film import frames_of
from phasmid.reporting.renderer import opengl_lack
from phasmid.reporting.run import read_run
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate


@pytest.fixture(scope="session")
def recording():
    scenario = load_scenario("paper").replace(duration=0.4)
    return simulate(scenario, plan(scenario))


@pytest.fixture(scope="session")
def run(recording):
    return read_run(recording)


@pytest.fixture(scope="session")
def frames(run):
    return frames_of(run, fps=10.0, speed=1.0)


@pytest.fixture(scope="session")
def opengl():
    """Skips a test where the engine cannot draw."""
    missing = opengl_lack()
    if missing is not None:
        pytest.skip(missing.sentence)
