"""The storeys of the packages: the import contract may permit less over time, never more."""

import tomllib
from pathlib import Path

CONTRACT = Path(__file__).parents[1] / "pyproject.toml"

MOST_EXCEPTIONS = 37
"""Imports against the order of the storeys. Lower this number with each that goes."""


def test_the_list_of_imports_against_the_storeys_only_shrinks():
    """All are imports of the scenario; the linter refuses an entry that no import needs."""
    contracts = tomllib.loads(CONTRACT.read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    (storeys,) = (contract for contract in contracts if contract["id"] == "storeys")
    exceptions = storeys["ignore_imports"]
    assert len(exceptions) == MOST_EXCEPTIONS
    assert all(" -> phasmid.scenario" in exception for exception in exceptions)
    assert not any("*" in exception for exception in exceptions)
