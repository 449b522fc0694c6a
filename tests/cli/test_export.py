"""``phasmid export``: each kind of file, and its refusals."""

import csv
import re
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest

import phasmid
from phasmid.cli import main
from phasmid.extras import install_hint
from phasmid.formats.solids.assembly import build123d
from phasmid.robot.glb import read_glb


@pytest.fixture(scope="module")
def run():
    scenario = phasmid.load_scenario("paper").replace(duration=0.4)
    return phasmid.simulate(scenario, phasmid.plan(scenario))


@pytest.fixture
def here(run, tmp_path, monkeypatch):
    """A folder with two recordings: ``results/a`` and ``b.nc``."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results/a").mkdir(parents=True)
    phasmid.save_recording(run, tmp_path / "results/a/recording.nc")
    phasmid.save_recording(run, tmp_path / "b.nc")
    return tmp_path


def test_a_table_lies_beside_the_folder_and_keeps_every_bit(here, run, capsys):
    assert main(["export", "results/a"]) == 0
    assert capsys.readouterr().out == "Written to results/a.csv\n"
    with (here / "results/a.csv").open(newline="") as file:
        heading, *rows = csv.reader(file)
    numbers = dict(zip(heading, np.array(rows, dtype=float).T, strict=True))
    np.testing.assert_array_equal(numbers["time [s]"], run["time"].values)
    for leg, name in ((0, "right_front"), (5, "left_front")):
        torque = run["joint_torque"].values[:, leg, 1]
        np.testing.assert_array_equal(numbers[f"joint_torque.{name}.femur [N m]"], torque)
    # The result folder holds nothing foreign, so that a walk of its name may still replace it.
    assert main(["export", "results/a/recording.nc", "--force", "--quiet"]) == 0
    assert not list((here / "results/a").glob("*.csv"))


def test_netcdf_is_a_recording_of_the_chosen_channels(here, run):
    command = ["export", "b.nc", "--out", "c.nc", "--channels", "foot_force,joint_torque"]
    assert main([*command, "--rate", "100"]) == 0
    found = phasmid.load_recording("c.nc")
    assert found.attrs == run.attrs
    assert found.equals(run[["joint_torque", "foot_force"]].isel(time=slice(None, None, 10)))


def test_mcap_names_the_legs(here):
    from mcap.reader import make_reader

    assert main(["export", "b.nc", "--out", "b.mcap", "--rate", "50"]) == 0
    with (here / "b.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    assert {"/joint_states", "/tf", "/feet/right_front/force"} <= topics
    assert set(summary.statistics.channel_message_counts.values()) == {21}


@pytest.mark.parametrize("suffix", [".urdf", ".xml", ".toml"])
def test_what_a_format_of_robots_loses_is_told(here, capsys, suffix):
    assert main(["export", "--robot", "phantomx-mk4", "--out", f"mine{suffix}"]) == 0
    assert (" are lost." in capsys.readouterr().out) == (suffix != ".toml")
    assert main(["export", "--robot", f"mine{suffix}", "--out", "back.toml"]) == 0
    assert phasmid.load_robot("back.toml").leg_names == phasmid.load_robot("phantomx-mk4").leg_names


def test_a_folder_gets_solids_and_meshes(here, capsys):
    pytest.importorskip("build123d")
    assert main(["export", "--robot", "phantomx-paper", "--out", "cad"]) == 0
    files = {"phantomx-paper.step", "phantomx-paper.step.toml", "phantomx-paper.glb"}
    assert {path.name for path in (here / "cad").iterdir()} == files
    printed = capsys.readouterr().out
    assert all(name in printed for name in files)
    assert set(read_glb(here / "cad/phantomx-paper.glb")) == {"body", "coxa", "femur", "tibia"}
    # The STEP file with its sidecar is a robot.
    assert main(["check", "--robot", "cad/phantomx-paper.step"]) == 0
    assert "52 / 82 / 140 " in capsys.readouterr().out


def test_solids_without_the_extra_name_what_to_install(here, capsys, monkeypatch):
    build123d.cache_clear()
    monkeypatch.setitem(sys.modules, "build123d", None)
    assert main(["export", "--out", "cad"]) == 2
    build123d.cache_clear()
    assert f"try  {install_hint('cad')}" in capsys.readouterr().err
    assert not (here / "cad").exists()


def test_the_command_in_a_header_makes_it_again(here, capsys):
    walk = ["paper", "--robot", "octopod", "--gait", "wave", "--samples", "17"]
    assert main(["export", *walk, "--out", "new/first.h"]) == 0
    written = "Written to new/first.h: octopod, 8 legs, 16 samples of a cycle\n"
    assert capsys.readouterr().out == written
    text = Path("new/first.h").read_text("utf-8")
    command = re.search(r"Made by  phasmid (.*)", text)[1]
    assert main([*shlex.split(command), "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert Path("first.h").read_text("utf-8") == text


ROBOT = ["--robot", "phantomx-ax", "--out", "a.urdf"]


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ([], "no recording is named."),
        (["c.nc"], "recording c.nc does not exist."),
        (["b.nc", "--out", "a.txt"], '"a.txt" does not end in one of .csv, .nc, .mcap, .toml,'),
        (["b.nc", "--channels", "joint_torqe"], 'no channel "joint_torqe".'),
        (["b.nc", "--channels", "servo_current"], "the recording has no servo_current."),
        (["b.nc", "--rate", "-1"], '--rate is "-1"; it must be a number from 0.001 to 1e+06.'),
        (["b.nc", "--out", "b.nc", "--force"], "b.nc is the recording itself;"),
        (["b.nc", "--out", "d.csv", "--force"], "d.csv is a folder; nothing was written."),
        (["b.nc", "--gait", "wave"], "--gait changes nothing of the file of a recording."),
        (["b.nc", "--servo", "AX-12A"], "--servo changes nothing of the file of a recording."),
        (["phantomx-ax", "--out", "a.urdf"], "phantomx-ax is a robot, no scenario."),
        ([*ROBOT, "--period", "2"], "--period changes nothing of the file of a robot."),
        ([*ROBOT, "--rate", "9"], "--rate belongs to a recording."),
        ([*ROBOT, "--servo", "AX-12"], 'no servo called "AX-12".'),
        (["--out", "there.h"], "there.h exists; nothing was written.\n  try  --force, or another"),
        (["b.nc", "--out", "there.csv"], "there.csv exists; nothing was written."),
        (["--out", "there.urdf"], "there.urdf exists; nothing was written."),
    ],
)
def test_an_export_is_refused_in_one_sentence(here, capsys, arguments, error):
    (here / "d.csv").mkdir()
    for name in ("there.h", "there.csv", "there.urdf"):
        (here / name).write_text("mine")
    before = {path: path.stat().st_mtime_ns for path in here.rglob("*")}
    assert main(["export", *arguments]) == 2
    assert capsys.readouterr().err.startswith(f"phasmid: {error}")
    assert {path: path.stat().st_mtime_ns for path in here.rglob("*")} == before


def test_an_exported_walk_is_a_trajectory(here):
    assert main(["walk", "--duration", "1", "--out", "a", "--no-figures", "--quiet"]) == 0
    assert main(["export", "a", "--out", "angles.csv", "--quiet"]) == 0
    walk = ["walk", "--duration", "1", "--no-figures", "--quiet", "--trajectory"]
    assert main([*walk, "angles.csv", "--out", "b"]) == 0
    first, again = (phasmid.load_recording(name).joint_position_target for name in "ab")
    # Splines go through the angles of each sample: bit by bit but for their own rounding.
    np.testing.assert_allclose(again, first, rtol=0, atol=1e-14)
