"""Nearly all tests of the room use the engine's loops."""

import pytest


@pytest.fixture(scope="session", autouse=True)
def _compiled(compiled_engine):
    pass
