"""``phasmid gaits``: what it prints."""

import re
from pathlib import Path

from phasmid.cli import main
from phasmid.gait import gaits_of

DOCS = Path(__file__).parents[2] / "docs"

WAVE = """\
wave: one cycle, █ on the ground, · in the air
  1 right front   ········████████████████████████████████████████
  2 right middle  ████████████████████████████████████████········
  3 right rear    ████████████████████████████████········████████
  4 left rear     ████████········████████████████████████████████
  5 left middle   ████████████████········████████████████████████
  6 left front    ████████████████████████········████████████████
"""


def told(capsys, line=""):
    assert main(["gaits", *line.split()]) == 0
    return capsys.readouterr().out


def test_the_table_has_every_gait_of_the_robot(capsys):
    out = told(capsys, "--robot octopod")
    assert [line.split()[0] for line in out.splitlines()[4:]] == list(gaits_of(8))
    assert re.search(r"^wave +7/8 +0 7/8 .* - +7 +142\.7 +\d+ +\d+$", out, re.MULTILINE)


def test_a_gait_that_is_named_is_drawn(capsys):
    assert told(capsys, "--gait wave").endswith(f"\n\n{WAVE}")


def test_a_gait_file_is_told_as_well(capsys, here):
    (here / "mine.toml").write_text("duty_factor = 0.8\noffsets = [0, 0.8, 0.6, 0.2, 0.31, 0.5]\n")
    row = "mine  4/5   0 4/5 3/5 1/5 0.310 1/2  -     4 to 5"
    assert row in told(capsys, "--gait mine.toml")


def test_lost_legs_are_walked_without(capsys):
    out = told(capsys, "--gait tripod --lost 2")
    assert "tripod without 2" in out
    assert "2 right middle" not in out
    assert "shift ahead, left" in out


def test_the_page_of_gaits_tells_what_the_command_tells(capsys):
    page = (DOCS / "gaits.md").read_text("utf-8")
    for line in told(capsys).splitlines():
        assert line in page
