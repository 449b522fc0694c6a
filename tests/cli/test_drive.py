"""``phasmid drive`` drives and records as ``phasmid walk`` does."""

import json

import pytest

from phasmid.cli import main


def test_a_velocity_is_driven_and_its_commands_can_be_driven_again(tmp_path, capsys):
    out = tmp_path / "run"
    options = ["--duration", "1", "--period", "1", "--no-figures"]
    planned = ["--step-length-mm", "60"]
    assert main(["drive", "--velocity", "0.05,0,-0.1", *options, *planned, "--out", str(out)]) == 0
    told = capsys.readouterr()
    assert "Velocity command" in told.out
    assert told.err == "phasmid: note: step_length_mm has no effect on a driven robot.\n"
    told = json.loads((out / "summary.json").read_text("utf-8"))
    assert told["velocity"]["commanded"] == pytest.approx([0.05, 0.0, -0.1])
    again = ["drive", "--commands", str(out / "commands.toml"), *options]
    assert main([*again, "--quiet", "--out", str(tmp_path / "again")]) == 0
    other = json.loads((tmp_path / "again/summary.json").read_text("utf-8"))
    assert other["travel"] == told["travel"]
    assert main(["replay", str(out)]) == 0


def test_a_learned_policy_drives_its_own_robot(tmp_path, capsys):
    """At 80 mm/s for two seconds; the shipped policy passes its gates within 10 %, and sets off."""
    out = tmp_path / "run"
    options = ["--duration", "3", "--no-figures", "--out", str(out)]
    assert main(["drive", "--policy", "walk", "--velocity", "0.08,0,0", *options]) == 0
    assert capsys.readouterr().out.startswith("phantomx-ax")
    told = json.loads((out / "summary.json").read_text("utf-8"))
    assert 0.06 < told["velocity"]["actual"][0] < 0.1
    fast = ["drive", "--policy", "walk", "--velocity", "0.5,0,0", "--duration", "0.5"]
    assert main([*fast, "--no-figures", "--out", str(tmp_path / "fast")]) == 0
    assert "exceeds what the policy was trained for" in capsys.readouterr().out
    assert main(["drive", "--policy", "wlk", "--velocity", "0.08,0,0"]) == 2
    assert 'there is no policy "wlk"' in capsys.readouterr().err


def test_a_drive_that_misses_a_waypoint_is_incomplete(tmp_path, capsys):
    out = tmp_path / "run"
    places = ["drive", "--waypoints", "0.05,0;3,0", "--duration", "3", "--period", "1"]
    assert main([*places, "--no-figures", "--out", str(out)]) == 3
    told = capsys.readouterr()
    run = json.loads((out / "summary.json").read_text("utf-8"))["run"]
    assert run["ending"] == "INCOMPLETE"
    first, second = run["waypoints"]
    assert 0.5 < first["reached"] < 3.0
    assert "reached" not in second
    assert f"Waypoint 1       (0.05, 0) m reached at {first['reached']:.2f} s" in told.out
    assert "Waypoint 2       (3, 0) m not reached" in told.out
    # The follower's velocity is no command of anybody's.
    assert not [
        line for line in told.out.splitlines() if "Distance" in line and "commanded" in line
    ]
    missed = "The drive did not reach all waypoints by 3 s: 1 of 2 reached, waypoint 2 is 2."
    assert told.err.splitlines()[-1].startswith(f"phasmid: {missed}")


def test_a_drive_to_its_last_waypoint_is_completed(tmp_path, capsys):
    out = tmp_path / "run"
    places = ["drive", "--waypoints", "0.05,0", "--period", "1", "--no-figures"]
    assert main([*places, "--out", str(out)]) == 0
    assert "Waypoint 1       (0.05, 0) m reached at" in capsys.readouterr().out
    assert main(["replay", str(out)]) == 0


def test_a_first_drive_announces_the_compiler_once(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("phasmid.control.compilation.are_compiled", lambda: False)
    drive = ["drive", "--velocity", "0,0,0", "--duration", "0.1", "--no-figures"]
    assert main([*drive, "--out", str(tmp_path / "run")]) == 0
    notice = "compiling the controller, once for this machine: one to three minutes"
    assert capsys.readouterr().err == f"phasmid: {notice}\n"
    assert main([*drive, "--out", str(tmp_path / "quiet"), "--quiet"]) == 0
    assert capsys.readouterr().err == ""
