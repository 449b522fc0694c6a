"""The pages name commands, options, packages, files and functions that exist."""

import re
import shlex
from functools import reduce
from importlib import import_module
from pathlib import Path

import pytest

from phasmid.cli.parser import build_parser

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
PAGES += sorted((ROOT / "docs/course").glob("*.md"))
ARCHITECTURE = (ROOT / "docs/architecture.md").read_text("utf-8")


def commands(page):
    """Arguments of each command of phasmid in the page's blocks."""
    fences = re.findall(r"^```(.*?)\n(.*?)^```$", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    for block in (block for language, block in fences if not language):
        for line in block.replace("\\\n", "").splitlines():
            line = line.removeprefix("$ ")
            if line.startswith("phasmid "):
                yield shlex.split(line, comments=True)[1:]


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_the_commands_of_a_page_are_accepted(page):
    for arguments in commands(page):
        if "--help" in arguments or "COMMAND" in arguments:
            continue
        assert build_parser(arguments[0]).parse_args(arguments).command == arguments[0]


def test_commands_are_found():
    assert sum(len(list(commands(page))) for page in PAGES) > 80
    assert ["walk", "--gait", "wave", "--step-length-mm", "60"] in commands(ROOT / "README.md")


def test_every_name_on_the_page_is_in_the_named_file():
    """Spans such as ``motion/walk.py: plan`` name a module and what it contains."""
    spans = re.findall(r"`([\w/]+)\.py: ([\w.]+)`", ARCHITECTURE)
    assert len(spans) > 15
    for file, name in spans:
        module = import_module("phasmid." + file.replace("/", "."))
        assert reduce(getattr, name.split("."), module) is not None


def test_the_table_lists_every_package_once():
    """A package is a folder with source files."""
    named = re.findall(r"^\|[^|]*\| `(\w+)` \|", ARCHITECTURE, re.MULTILINE)
    assert sorted(named) == sorted(
        path.parent.name for path in (ROOT / "src/phasmid").glob("*/__init__.py")
    )
