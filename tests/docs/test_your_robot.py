"""The tables and commands of docs/your-robot.md, as a builder copies them."""

import re
from pathlib import Path

import pytest

from phasmid.cli import main

PAGE = (Path(__file__).parents[2] / "docs/your-robot.md").read_text("utf-8")
ROBOT, SERVO = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)[:2]
OFFSETS = (Path(__file__).parents[2] / "examples/offset-legs.toml").read_text("utf-8")


@pytest.mark.parametrize("servo", ["by name", "by its own table"])
def test_the_robot_of_the_page_walks_on_either_servo(here, capsys, servo):
    text = ROBOT
    if servo == "by its own table":
        # Tables of TOML come after the keys that stand alone.
        text = re.sub(r'^servo = "AX-12A".*$', "", ROBOT, flags=re.MULTILINE) + SERVO
    (here / "mine.toml").write_text(text, encoding="utf-8")
    commands = re.search(r"Then\n\n```\n(.*?)```", PAGE, re.DOTALL)[1].splitlines()
    assert [command.split()[:2] for command in commands] == [
        ["phasmid", "check"],
        ["phasmid", "walk"],
    ]
    for command in commands:
        short = ["--duration", "0.5", "--no-figures"] if " walk " in command else []
        assert main([*command.split()[1:], *short]) == 0, capsys.readouterr().err
        told = " ".join(capsys.readouterr().out.split())
        assert "HOLDS: " in told
    if servo == "by its own table":
        assert "HV-20 at 6 V: stall 1.1 N·m" in told


def test_the_robot_with_lateral_offsets_walks(here, capsys):
    (here / "offset-legs.toml").write_text(OFFSETS, encoding="utf-8")
    assert main(["check", "--robot", "offset-legs.toml"]) == 0
    # The column of lateral offsets: to the left of two legs, to the right of the others.
    offsets = re.findall(r"^\d \w+ +(-?\d+)  ", capsys.readouterr().out, re.MULTILINE)
    assert offsets == ["40", "40", "-40", "-40"]
    command = re.search(r"`phasmid (walk --robot offset-legs.toml .*?)`", PAGE)[1].split()
    assert main([*command, "--duration", "0.5", "--no-figures"]) == 0, capsys.readouterr().err
