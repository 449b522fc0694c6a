"""The page on architecture names functions that exist."""

import re
from functools import reduce
from importlib import import_module
from pathlib import Path

PAGE = (Path(__file__).parents[2] / "docs/architecture.md").read_text("utf-8")


def test_every_function_on_the_way_to_a_joint_target_is_in_the_named_file():
    section = PAGE.split("## From an observation to a joint target")[1].split("\n## ")[0]
    module, count = None, 0
    for span in re.findall(r"`([^`]+)`", section):
        *file, names = re.split(r"\.py:\s", span)
        if file:
            module = import_module("phasmid." + file[0].replace("/", "."))
        for name in names.split(","):
            # AttributeError names what is missing.
            assert callable(reduce(getattr, name.strip().split("."), module))
            count += 1
    assert count > 50
