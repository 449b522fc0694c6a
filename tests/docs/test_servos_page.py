"""The page on servos has the numbers of the catalogue."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_tables_of_the_page_are_those_of_the_catalogue():
    spec = importlib.util.spec_from_file_location("servo_table", ROOT / "tools/servo_table.py")
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    page = (ROOT / "docs/servos.md").read_text(encoding="utf-8")
    assert tool.numbers() in page
    assert tool.sources() in page
