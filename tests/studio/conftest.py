"""What tests of the live page share."""

import pytest

from support.staging import staged


@pytest.fixture(scope="session", autouse=True)
def _compiled(compiled_engine):
    pass


@pytest.fixture
def heard(tmp_path):
    """A stage on which a robot walks."""
    with staged(tmp_path) as found:
        yield found
