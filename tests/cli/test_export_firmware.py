"""``phasmid export-firmware``: the file that it writes, and what it refuses."""

import re
import shlex
from pathlib import Path

import pytest

from phasmid.cli import main

NAMED = ("export-firmware", "paper", "--robot", "octopod", "--gait", "wave", "--samples", "17")


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_the_command_in_the_header_makes_it_again(capsys):
    assert main([*NAMED, "--out", "new/first.h"]) == 0
    first = Path("new/first.h")
    written = f"Written to {first}: octopod, 8 legs, 16 samples of a cycle\n"
    assert capsys.readouterr().out == written
    text = first.read_text("utf-8")
    command = re.search(r"Made by  phasmid (.*)", text)[1]
    assert main([*shlex.split(command), "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert Path("walk.h").read_text("utf-8") == text


def test_an_older_file_is_replaced_on_request_only(capsys):
    Path("walk.h").write_text("mine", encoding="utf-8")
    assert main(["export-firmware"]) == 2
    assert capsys.readouterr().err == (
        "phasmid: walk.h exists; nothing was written.\n  try  --force, or another --out\n"
    )
    assert Path("walk.h").read_text("utf-8") == "mine"
    assert main(["export-firmware", "--force"]) == 0
    assert "phantomx-paper" in Path("walk.h").read_text("utf-8")
