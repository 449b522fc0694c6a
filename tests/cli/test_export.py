"""``phasmid export``: each kind of file."""

import csv
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import phasmid
from phasmid.cli import main
from phasmid.robot.glb import read_glb


def test_a_table_lies_beside_the_folder_and_keeps_every_bit(runs, run, capsys):
    assert main(["export", "results/a"]) == 0
    assert capsys.readouterr().out == "Written to results/a.csv\n"
    with (runs / "results/a.csv").open(newline="") as file:
        heading, *rows = csv.reader(file)
    numbers = dict(zip(heading, np.array(rows, dtype=float).T, strict=True))
    np.testing.assert_array_equal(numbers["time [s]"], run["time"].values)
    for leg, name in ((0, "right_front"), (5, "left_front")):
        torque = run["joint_torque"].values[:, leg, 1]
        np.testing.assert_array_equal(numbers[f"joint_torque.{name}.femur [N m]"], torque)
    # The result folder holds nothing foreign, so that a walk of its name may still replace it.
    assert main(["export", "results/a/recording.nc", "--force", "--quiet"]) == 0
    assert not list((runs / "results/a").glob("*.csv"))


def test_netcdf_is_a_recording_of_the_chosen_channels(runs, run):
    command = ["export", "b.nc", "--out", "c.nc", "--channels", "foot_force,joint_torque"]
    assert main([*command, "--rate", "100"]) == 0
    found = phasmid.load_recording("c.nc")
    assert found.attrs == run.attrs
    assert found.equals(run[["joint_torque", "foot_force"]].isel(time=slice(None, None, 10)))


def test_mcap_names_the_legs(runs):
    from mcap.reader import make_reader

    assert main(["export", "b.nc", "--out", "b.mcap", "--rate", "50"]) == 0
    with (runs / "b.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    assert {"/joint_states", "/tf", "/feet/right_front/force"} <= topics
    assert set(summary.statistics.channel_message_counts.values()) == {21}


@pytest.mark.parametrize("suffix", [".urdf", ".xml", ".toml"])
def test_what_a_format_of_robots_loses_is_told(runs, capsys, suffix):
    assert main(["export", "--robot", "phantomx-mk4", "--out", f"mine{suffix}"]) == 0
    assert (" are lost." in capsys.readouterr().out) == (suffix != ".toml")
    assert main(["export", "--robot", f"mine{suffix}", "--out", "back.toml"]) == 0
    assert phasmid.load_robot("back.toml").leg_names == phasmid.load_robot("phantomx-mk4").leg_names


@pytest.mark.slow
def test_a_folder_gets_solids_and_meshes(runs, capsys):
    pytest.importorskip("build123d")
    assert main(["export", "--robot", "phantomx-paper", "--out", "cad"]) == 0
    files = {"phantomx-paper.step", "phantomx-paper.step.toml", "phantomx-paper.glb"}
    assert {path.name for path in (runs / "cad").iterdir()} == files
    printed = capsys.readouterr().out
    assert all(name in printed for name in files)
    assert set(read_glb(runs / "cad/phantomx-paper.glb")) == {"body", "coxa", "femur", "tibia"}
    # The STEP file with its sidecar is a robot.
    assert main(["check", "--robot", "cad/phantomx-paper.step"]) == 0
    assert "52 / 82 / 140 " in capsys.readouterr().out


def test_the_command_in_a_header_makes_it_again(runs, capsys):
    walk = ["paper", "--robot", "octopod", "--gait", "wave", "--samples", "17"]
    assert main(["export", *walk, "--out", "new/first.h"]) == 0
    written = "Written to new/first.h: octopod, 8 legs, 16 samples of a cycle\n"
    assert capsys.readouterr().out == written
    text = Path("new/first.h").read_text("utf-8")
    command = re.search(r"Made by  phasmid (.*)", text)[1]
    assert main([*shlex.split(command), "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert Path("first.h").read_text("utf-8") == text


def test_an_exported_walk_is_a_trajectory(runs):
    assert main(["walk", "--duration", "1", "--out", "a", "--no-figures", "--quiet"]) == 0
    assert main(["export", "a", "--out", "angles.csv", "--quiet"]) == 0
    walk = ["walk", "--duration", "1", "--no-figures", "--quiet", "--trajectory"]
    assert main([*walk, "angles.csv", "--out", "b"]) == 0
    first, again = (phasmid.load_recording(name).joint_position_target for name in "ab")
    # Splines go through the angles of each sample: bit by bit but for their own rounding.
    np.testing.assert_allclose(again, first, rtol=0, atol=1e-14)
