"""A short simulated walk, and what tests that draw need."""

import pytest

from phasmid.motion import plan
from phasmid.reporting.source import finite_part, read_source
from phasmid.scenario import load_scenario
from phasmid.simulation import simulate
from phasmid.video import lack
from phasmid.video.film import film_of


@pytest.fixture(scope="session")
def recording():
    scenario = load_scenario("paper").replace(duration=0.4)
    return simulate(scenario, plan(scenario))


@pytest.fixture(scope="session")
def source(recording):
    return read_source(recording)


@pytest.fixture(scope="session")
def film(recording, source):
    return film_of(finite_part(recording), source, fps=10.0, speed=1.0)


@pytest.fixture(scope="session")
def opengl():
    """Skips a test where the engine cannot draw."""
    missing = lack(".gif")
    if missing is not None:
        pytest.skip(missing.sentence)
