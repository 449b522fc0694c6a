"""The sketch of docs/firmware.md compiles with the header of its command."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from phasmid.cli import main

PAGE = (Path(__file__).parents[2] / "docs/firmware.md").read_text("utf-8")

BOARD = """\
unsigned long millis(void);
void delay(unsigned long);
void write_servo(int, float);
"""


def test_the_sketch_of_the_page_compiles(here, capsys):
    compiler = next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)
    if compiler is None:
        pytest.skip("needs a C++ compiler")
    assert main(re.search("```\nphasmid (.*)\n```", PAGE)[1].split()) == 0, capsys.readouterr().err
    sketch = re.search("```cpp\n(.*?)```", PAGE, re.DOTALL)[1]
    Path("sketch.cpp").write_text(BOARD + sketch, encoding="utf-8")
    command = [compiler, "-std=c++11", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only"]
    done = subprocess.run([*command, "sketch.cpp"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
