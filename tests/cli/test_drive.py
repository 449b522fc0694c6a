"""``phasmid drive`` drives and records as ``phasmid walk`` does."""

import json

import pytest

from phasmid.cli import main


def driven(capsys, status, line):
    """What a drive without figures prints, which ends with a status."""
    assert main([*line.split(), "--no-figures"]) == status
    return capsys.readouterr()


def summary(folder):
    return json.loads((folder / "summary.json").read_text("utf-8"))


def test_a_velocity_is_driven_and_its_commands_can_be_driven_again(here, capsys):
    options = "--duration 1 --period 1"
    line = f"drive --velocity 0.05,0,-0.1 {options} --step-length-mm 60 --out run"
    told = driven(capsys, 0, line)
    assert "Velocity command" in told.out
    assert told.err == "phasmid: note: step_length_mm has no effect on a driven robot.\n"
    assert summary(here / "run")["velocity"]["commanded"] == pytest.approx([0.05, 0.0, -0.1])
    driven(capsys, 0, f"drive --commands run/commands.toml {options} --quiet --out again")
    assert summary(here / "again")["travel"] == summary(here / "run")["travel"]
    assert main(["replay", "run"]) == 0


def test_a_learned_policy_drives_its_own_robot(here, capsys):
    """At 80 mm/s for two seconds; the shipped policy passes its gates within 10 %, and sets off."""
    line = "drive --policy walk --velocity"
    assert driven(capsys, 0, f"{line} 0.08,0,0 --duration 3 --out run").out.startswith(
        "phantomx-ax"
    )
    assert 0.06 < summary(here / "run")["velocity"]["actual"][0] < 0.1
    told = driven(capsys, 0, f"{line} 0.5,0,0 --duration 0.5 --out fast")
    assert "exceeds what the policy was trained for" in told.out
    told = driven(capsys, 2, "drive --policy wlk --velocity 0.08,0,0")
    assert 'there is no policy "wlk"' in told.err


def test_a_drive_that_misses_a_waypoint_is_incomplete(here, capsys):
    line = "drive --waypoints 0.05,0;3,0 --duration 3 --period 1 --out run"
    told = driven(capsys, 3, line)
    run = summary(here / "run")["run"]
    assert run["ending"] == "INCOMPLETE"
    first, second = run["waypoints"]
    assert 0.5 < first["reached"] < 3.0
    assert "reached" not in second
    assert f"Waypoint 1       (0.05, 0) m reached at {first['reached']:.2f} s" in told.out
    assert "Waypoint 2       (3, 0) m not reached" in told.out
    # The follower's velocity is no command of anybody's.
    distance = [line for line in told.out.splitlines() if "Distance" in line]
    assert not any("commanded" in line for line in distance)
    missed = "The drive did not reach all waypoints by 3 s: 1 of 2 reached, waypoint 2 is 2."
    assert told.err.splitlines()[-1].startswith(f"phasmid: {missed}")


def test_a_drive_to_its_last_waypoint_is_completed(here, capsys):
    told = driven(capsys, 0, "drive --waypoints 0.05,0 --period 1 --out run")
    assert "Waypoint 1       (0.05, 0) m reached at" in told.out
    assert main(["replay", "run"]) == 0


def test_a_first_drive_announces_the_compiler_once(here, monkeypatch, capsys):
    monkeypatch.setattr("phasmid.control.compilation.are_compiled", lambda: False)
    line = "drive --velocity 0,0,0 --duration 0.1"
    notice = "compiling the controller, once for this machine: one to three minutes"
    assert driven(capsys, 0, f"{line} --out run").err == f"phasmid: {notice}\n"
    assert driven(capsys, 0, f"{line} --out quiet --quiet").err == ""
