"""Shapes and types are checked at run time in all tests; hypothesis draws the same each time."""

import os
import signal

import pytest
from hypothesis import settings
from jaxtyping import install_import_hook

install_import_hook("phasmid", "type_checker.check")

# Whoever starts the tests in the background lets them ignore Ctrl-C, which some of them are about.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Tests run on all cores as it is; a second process for each report would only slow them down.
os.environ["PHASMID_PROCESSES"] = "1"

settings.register_profile("phasmid", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("phasmid")


@pytest.fixture(scope="session")
def compiled_engine(tmp_path_factory):
    """The locomotion engine's loops are compiled, by one process for all."""
    from compiling import compile_once

    compile_once(tmp_path_factory.getbasetemp().parent)
