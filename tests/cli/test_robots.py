"""Robots at the command line: checked, walked and converted, in any format."""

import re
from pathlib import Path

import numpy as np
import pytest

import phasmid
from formats.urdf_hexapod import hexapod, saved
from phasmid.cli import main

DATA = Path(__file__).parents[3] / "shared" / "data"
MARK_4 = DATA / "interbotix_xshexapod_descriptions/urdf/pxmark4.urdf"
needs_data = pytest.mark.skipif(not DATA.exists(), reason="the descriptions are not there")


def answered(capsys, *arguments):
    """Exit status, output and error text of a call."""
    status = main([str(argument) for argument in arguments])
    return status, *capsys.readouterr()


@needs_data
def test_a_sound_urdf_is_possible_and_walks(here, capsys):
    status, out, err = answered(capsys, "check", "--robot", MARK_4)
    assert (status, err) == (0, "")
    assert "6 legs" in out
    assert "impossible" not in out
    arguments = ["walk", "--robot", MARK_4, "--duration", "2", "--out", "mk4", "--no-figures"]
    status, _, err = answered(capsys, *arguments)
    assert status == 0
    # Its meshes lie beside it, and go on with whoever walks it again.
    assert phasmid.load_robot("mk4/robot.toml").appearance.body
    run = phasmid.load_recording("mk4")
    # One stroke of 40 mm a second, after the first step from rest (scenario `paper`).
    travelled = float(run["body_position"][-1, 0] - run["body_position"][0, 0])
    assert travelled == pytest.approx(0.08, rel=0.02)
    again = ["walk", "mk4/scenario.toml", "--out", "again", "--no-figures", "--quiet"]
    assert answered(capsys, *again)[0] == 0
    assert run.equals(phasmid.load_recording("again"))


READERS = ["check", "walk", "drive --velocity 0,0,0", "gaits", "export --out out.toml"]
"""Commands that read a robot file."""


def refused(capsys, command, name):
    """Return the error of a command that reads a robot file, less its head."""
    status, out, err = answered(capsys, *command.split(), "--robot", name)
    assert (status, out) == (2, "")
    return err.removeprefix("phasmid: ")


@pytest.mark.parametrize("command", READERS)
def test_files_that_another_program_must_turn_into_a_robot_are_told(here, capsys, command):
    for name, hint in (
        ("mine.xacro", "xacro mine.xacro > mine.urdf"),
        ("mine.urdf.xacro", "xacro mine.urdf.xacro > mine.urdf"),
        ("mine.USDZ", "export the robot as URDF or MJCF"),
        ("mine.stl", "a URDF or MJCF file that names"),
        ("mine.f3d", "export it as STEP"),
        ("mine.yaml", "phasmid export --robot phantomx-ax --out robot.toml"),
        ("mine.zip", "unpack it"),
    ):
        # The ending is enough: most of these files are no text.
        Path(name).write_bytes(b"# \x00")
        err = refused(capsys, command, name)
        assert err.startswith(f"{name} ends in {Path(name).suffix.lower()}; robots are read from ")
        assert f"\n  try  {hint}" in err
    assert refused(capsys, command, "none.zip").startswith("none.zip does not exist.")


@pytest.mark.parametrize("command", READERS)
@pytest.mark.parametrize("name", ["mine.toml", "mine"])
def test_a_file_without_a_robot_is_none(here, capsys, command, name):
    """Whatever its name, an empty file would be a scenario of defaults alone."""
    for content, sentence in (
        ("", f"{name} is empty.\n"),
        (" \n\n", f"{name} is empty.\n"),
        ("#usda 1.0\n", f"{name} has only comments.\n"),
        ('{"legs": 6}', f"{name} is JSON, not TOML; reading stops in line 1: "),
        ("<sdf/>", f"{name} is XML, not TOML; reading stops in line 1: "),
        ("[robot]\nlegs = 6\n", 'unknown key "robot".'),
    ):
        Path(name).write_text(content, encoding="utf-8")
        assert refused(capsys, command, name).startswith(sentence)
    Path(name).unlink()
    Path(name).mkdir()
    assert refused(capsys, command, name).startswith(f"{name} is a folder.\n  try  a file in it")


def test_a_robot_file_is_no_scenario(here, capsys):
    for name in ("mine.urdf", "mine.XML", "mine.step"):
        Path(name).write_text("<robot/>", encoding="utf-8")
        error = f"phasmid: {name} is a robot file, no scenario.\n  try  --robot {name}\n"
        assert answered(capsys, "walk", name) == (2, "", error)
    Path("mine.usd").write_text("#usda 1.0", encoding="utf-8")
    assert answered(capsys, "walk", "mine.usd")[2].startswith("phasmid: mine.usd ends in .usd;")


def test_a_kits_lengths_and_masses_make_a_robot(here):
    """The robot file of docs/your-robot.md, with boxes in place of measured inertias."""
    page = (Path(__file__).parents[2] / "docs/your-robot.md").read_text(encoding="utf-8")
    text = page.partition("```toml\n")[2].partition("```")[0]
    Path("mine.toml").write_text(text, encoding="utf-8")
    robot = phasmid.load_robot("mine.toml")
    assert robot.mass == pytest.approx(0.9 + 6 * 0.27)
    femur = robot.legs[0].femur
    np.testing.assert_allclose(femur.com, [0.033, 0, 0])
    # m (b² + c²) / 12 about each axis of a box of 66 × 38 × 38 mm.
    across = 0.12 * (0.066**2 + 0.038**2) / 12
    np.testing.assert_allclose(np.diag(femur.inertia), [0.12 * 2 * 0.038**2 / 12, across, across])


@pytest.mark.parametrize("robot", ["markwtech", "sticks.urdf"])
def test_check_gaits_and_walk_tell_one_longest_stride(here, capsys, robot):
    """A hexapod of hobby servos, whose joints turn by ±90°, and a kit."""
    if robot.endswith(".urdf"):
        quarter = '<limit lower="-1.5708" upper="1.5708" effort="2.2" velocity="6"/>'
        saved(here, hexapod(quarter, (0.04, 0.1, 0.1)))
    _, out, _ = answered(capsys, "check", "--robot", robot)
    stride = int(re.search(r"longest step: (\d+) mm forward", out)[1])
    assert out.endswith("possible.\n")
    _, out, _ = answered(capsys, "gaits", "--gait", "tripod", "--robot", robot)
    assert int(re.search(r"^tripod .* (\d+) +\d+$", out, re.MULTILINE)[1]) == stride
    walk = ["walk", "--robot", robot, "--period", "9", "--duration", "1", "--no-figures"]
    # The table rounds to the nearest millimetre, the refusal down.
    assert answered(capsys, *walk, "--step-length-mm", stride - 1)[0] == 0
    status, _, err = answered(capsys, *walk, "--step-length-mm", stride + 1)
    assert status == 2
    told = int(re.search(r"try  --step-length-mm (\d+)\n", err)[1])
    assert told in (stride, stride - 1)
