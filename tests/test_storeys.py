"""The storeys of the packages: imports go down only, without an exception."""

import tomllib
from pathlib import Path

CONTRACT = Path(__file__).parents[1] / "pyproject.toml"


def test_no_import_against_the_storeys_is_excused():
    """The linter checks the order; this is that it excuses nothing."""
    contracts = tomllib.loads(CONTRACT.read_text("utf-8"))["tool"]["importlinter"]["contracts"]
    assert [contract for contract in contracts if contract["id"] == "storeys"]
    assert not [contract for contract in contracts if "ignore_imports" in contract]
