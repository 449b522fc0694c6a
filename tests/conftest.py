"""Settings of all tests: hypothesis draws the same each time; shapes are checked on request."""

import signal

import pytest
from hypothesis import settings
from jaxtyping import install_import_hook

# Whoever starts the tests in the background, or by nohup, lets them ignore the signals that some of
# them are about.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

settings.register_profile("phasmid", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("phasmid")


def pytest_addoption(parser):
    """Add the option of `make slow SUITE=shapes`."""
    parser.addoption(
        "--shapes",
        action="store_true",
        help="check array shapes and argument types at run time, which takes longer",
    )


def pytest_configure(config):
    """Install the checks before the first test module imports phasmid."""
    if config.getoption("--shapes"):
        install_import_hook("phasmid", "support.type_checker.check")


@pytest.fixture(scope="session")
def compiled_engine(tmp_path_factory):
    """The locomotion engine's loops are compiled, by one process for all."""
    from support.compiling import compile_once

    compile_once(tmp_path_factory.getbasetemp().parent)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder, in which the test runs."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
