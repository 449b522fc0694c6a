"""The page on architecture names packages, files and functions that exist."""

import re
from functools import reduce
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src/phasmid"
PAGE = (ROOT / "docs/architecture.md").read_text("utf-8")


def test_every_name_on_the_page_is_in_the_named_file():
    """Spans such as ``motion/walk.py: plan`` name a module and what it contains."""
    spans = re.findall(r"`([\w/]+)\.py: ([\w.]+)`", PAGE)
    assert len(spans) > 15
    for file, name in spans:
        module = import_module("phasmid." + file.replace("/", "."))
        assert reduce(getattr, name.split("."), module) is not None


def test_the_table_lists_every_package_once():
    """A package is a folder with source files."""
    named = re.findall(r"^\|[^|]*\| `(\w+)` \|", PAGE, re.MULTILINE)
    assert sorted(named) == sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))
