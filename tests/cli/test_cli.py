"""The command: what it writes, what it prints, what it answers to mistakes."""

import errno
import io
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from mcap.writer import Writer

from phasmid.cli import main
from phasmid.motion import plan
from phasmid.recording import DamagedRecording, RecordingLog, load_recording, save_recording
from phasmid.robot import load_robot, robot_to_toml
from phasmid.scenario import load_scenario
from phasmid.servo import load_servo
from phasmid.simulation import new_run
from support.hostile import UNSEEN, hostile_files


def answered(capsys, *arguments):
    """Exit status and error text of a call."""
    status = main(arguments)
    return status, capsys.readouterr().err


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_servo_of_an_option_is_a_field_of_the_scenario_that_is_written(here):
    assert main(["walk", "--duration", "0.2", "--servo", "MX-28", "--no-figures"]) == 0
    folder = here / "results/paper_duration-0.2_servo-MX-28"
    scenario = load_scenario(folder / "scenario.toml")
    assert scenario.servo.servo == "MX-28"
    assert scenario.load_robot().servo == load_servo("MX-28")
    assert load_recording(folder / "recording.nc").attrs["servo"] == "MX-28"
    (here / "s.toml").write_text('servo = "MX-28"\nduration = 0.2\n', encoding="utf-8")
    assert main(["walk", "s.toml", "--servo", "AX-18A", "--no-figures", "--out", "other"]) == 0
    assert load_recording(here / "other/recording.nc").attrs["servo"] == "AX-18A"


def test_walk_writes_its_folder_whole(here, capsys):
    assert main(["walk", "--duration", "2", "--out", "results/short"]) == 0
    folder = here / "results/short"
    assert {p.name for p in folder.iterdir()} == {
        "scenario.toml",
        "robot.toml",
        "recording.nc",
        "summary.json",
        "figures",
        "report.html",
    }
    figures = {p.name for p in (folder / "figures").iterdir()}
    for number in range(12, 17):
        assert {f"fig{number}.svg", f"fig{number}.png"} <= figures
    recording = load_recording(folder / "recording.nc")
    assert recording.sizes["time"] == 2001
    assert json.loads((folder / "summary.json").read_text())
    printed = capsys.readouterr().out
    assert "AX-12A" in printed
    assert "minimum-norm" in printed
    assert [p.name for p in (here / "results").iterdir()] == ["short"]


def test_the_folder_of_a_walk_walks_again_to_the_same_bits(here):
    first = ["walk", "--duration", "1", "--gait", "ripple", "--mass-model", "mid-length"]
    assert main([*first, "--out", "a", "--no-figures", "--quiet"]) == 0
    assert main(["walk", "a/scenario.toml", "--out", "b", "--no-figures", "--quiet"]) == 0
    a, b = (load_recording(here / name / "recording.nc") for name in "ab")
    assert a.equals(b)


MISTAKES = {
    "wlak": 'no command "wlak".\n  try  phasmid walk',
    "plot a": 'no command "plot".\n  try  phasmid report --figures',
    "demo": 'no command "demo".\n  try  phasmid walk --open',
    "report a --list": 'no option "--list".\n  try  --list-figures',
    "walk --step-lenght-mm 40": 'no option "--step-lenght-mm".\n  try  --step-length-mm',
    "walk --dt nan": "--dt is nan; it must be a finite number.",
    "walk --dt 0": "--dt is 0 s; it must be greater than 0.",
    "walk --dt 0.5": "a time step of 0.5 s cannot resolve this contact; it needs 0.00231 s or less."
    "\n  try  --dt 0.001",
    "walk --duration 1e9": "1e+09 s at 1 ms is 1e+12 steps, with 1 s to settle; the limit is 1e+08."
    "\n  try  --duration 4000",
    "walk --legs 1,9": "there is no leg 9; legs are 1 to 6.",
    "walk --sensor-seed abc": '--sensor-seed is "abc"; it must be a whole number 0 or more and '
    "9.22337e+18 or less.",
    "walk --step-height-mm -30": "--step-height-mm is -30 mm; it must be 0 or more.",
    "walk --gait tripode": 'no gait called "tripode".\n  try  "tripod" (known: tripod, wave, '
    "ripple, amble, tetrapod, metachronal, firmware-ripple, firmware-tripod, firmware-wave)",
    "walk --drive sevro": '--drive is "sevro"; it must be "prescribed", "ideal-servo", "servo" or '
    '"torque".\n  try  "servo"',
    "walk --edge-x-mm 300 400": '--edge-x-mm takes one list; "400" stands apart.\n'
    "  try  --edge-x-mm 300,400",
    "walk papper": 'no scenario called "papper".\n  try  "paper"',
    "walk --name ../x": '--name is "../x"; it must be a plain name.\n'
    "  try  --name walk, of letters, digits, and . _ - between them, 64 at most",
}


@pytest.mark.parametrize(("line", "error"), MISTAKES.items())
def test_a_mistake_gets_a_sentence_and_status_2(here, capsys, line, error):
    status, text = answered(capsys, *line.split())
    assert text == f"phasmid: {error}\n"
    assert status == 2
    assert list(here.iterdir()) == []


def test_an_existing_folder_is_not_touched_without_force(here, capsys):  # C5
    folder = here / "out"
    assert main(["walk", "--duration", "1", "--out", "out", "--no-figures", "--quiet"]) == 0
    before = {p: p.stat().st_mtime_ns for p in folder.iterdir()}
    status, text = answered(capsys, "walk", "--out", "out")
    assert status == 2
    assert text.startswith("phasmid: out exists; nothing was written.\n  try  --force")
    assert {p: p.stat().st_mtime_ns for p in folder.iterdir()} == before
    assert main(["walk", "--duration", "1", "--out", "out", "--no-figures", "--force"]) == 0


def test_a_fallen_robot_is_status_3_and_its_record_is_kept(here, capsys):
    robot = load_robot("phantomx-paper")
    weak = replace(robot, servo=replace(robot.servo, rated_stall_torque=0.2))
    (here / "weak.toml").write_text(robot_to_toml(weak), encoding="utf-8")
    arguments = ["walk", "--robot", "weak.toml", "--drive", "ideal-servo", "--no-figures"]
    status, text = answered(capsys, *arguments, "--out", "fell")
    assert status == 3
    assert text.startswith("phasmid: The robot fell at ")
    assert load_recording(here / "fell/recording.nc").attrs["ending"] == "FELL"


def interrupting(monkeypatch, *, at):
    """Ctrl-C arrives in the run after a time [s]."""
    whole = RecordingLog.append

    def append(log, time, channels):
        whole(log, time, channels)
        if time[-1] > at:
            monkeypatch.setattr(RecordingLog, "append", whole)
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(RecordingLog, "append", append)


def test_an_interrupted_walk_is_status_130_and_its_record_is_kept(here, capsys, monkeypatch):
    interrupting(monkeypatch, at=1.0)
    status, text = answered(capsys, "walk", "--out", "stopped", "--quiet")
    assert status == 130
    assert text.startswith("phasmid: The run was stopped by the user at 1.")
    assert text.endswith("  try  phasmid report stopped.mcap, which makes the folder of it\n")
    assert [p.name for p in here.iterdir()] == ["stopped.mcap"]
    recording = load_recording(here / "stopped.mcap")
    assert recording.attrs["ending"] == "STOPPED"
    assert recording.sizes["time"] > 1000
    # The next walk of that name does not lose it.
    before = (here / "stopped.mcap").read_bytes()
    status, text = answered(capsys, "walk", "--out", "stopped")  # C5
    assert status == 2
    assert text == (
        "phasmid: stopped.mcap exists; nothing was written.\n"
        "  try  phasmid report stopped.mcap, which makes a folder of it, or --force\n"
    )
    assert main(["report", "stopped.mcap", "--no-figures"]) == 0
    assert load_recording(here / "stopped/recording.nc").equals(recording)
    assert (here / "stopped.mcap").read_bytes() == before
    status, text = answered(capsys, "report", "stopped.mcap")
    assert (status, text.splitlines()[0]) == (2, "phasmid: stopped exists; nothing was written.")
    again = ["walk", "--duration", "1", "--out", "stopped", "--force", "--no-figures", "--quiet"]
    assert main(again) == 0
    assert [p.name for p in here.iterdir()] == ["stopped"]


def test_an_interrupt_after_the_run_keeps_its_log(here, capsys, monkeypatch):
    from phasmid.reporting import run_folder

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(run_folder, "summarise", interrupted)
    status, text = answered(capsys, "walk", "--duration", "1", "--out", "a", "--quiet")
    assert status == 130
    assert text.startswith("phasmid: stopped.\n  try  phasmid report a.mcap")
    assert [p.name for p in here.iterdir()] == ["a.mcap"]
    assert load_recording(here / "a.mcap").attrs["ending"] == "COMPLETED"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_after_the_folder_is_complete_leaves_no_log(here, capsys, monkeypatch, number):
    from phasmid.cli import walk

    def interrupted(*arguments):
        write_report(*arguments)
        signal.raise_signal(number)

    write_report = walk.write_report
    monkeypatch.setattr(walk, "write_report", interrupted)
    arguments = ["--duration", "1", "--out", "a", "--no-figures", "--quiet"]
    assert answered(capsys, "walk", *arguments) == (130, "phasmid: stopped.\n")
    assert [p.name for p in here.iterdir()] == ["a"]
    assert load_recording(here / "a").attrs["ending"] == "COMPLETED"


@pytest.mark.parametrize("text", ['gait = "{}"', '"{}" = 1'])
def test_a_message_is_short_however_long_what_it_repeats(here, capsys, text):
    (here / "s.toml").write_text(text.format("x" * 900_000), encoding="utf-8")
    for command in ("walk", "check"):
        status, said = answered(capsys, command, "s.toml")
        assert status == 2
        assert said.startswith("phasmid: ")
        assert len(said) < 4000


def test_a_report_of_a_damaged_log_says_what_was_lost(here, capsys):
    assert main(["walk", "--duration", "2", "--out", "a", "--no-figures", "--quiet"]) == 0
    scenario = load_scenario("paper").replace(duration=2)
    new_run(scenario, plan(scenario)).record(here / "b.mcap")
    whole = (here / "b.mcap").read_bytes()
    cut = whole[: len(whole) // 2]
    (here / "cut.mcap").write_bytes(cut)
    status, text = answered(capsys, "report", "cut.mcap", "--no-figures", "--quiet")  # J6
    assert status == 0
    recording = load_recording(here / "cut/recording.nc")
    count = recording.sizes["time"]
    assert 900 < count < 1100
    said = f"cut.mcap is cut off: {count} of 2001 samples were read; the original is untouched."
    assert text == f"phasmid: {said}\n"
    assert (here / "cut.mcap").read_bytes() == cut
    assert answered(capsys, "replay", "cut.mcap") == (0, f"phasmid: {said}\n")
    assert recording.attrs["ending_reason"] == f"The run was cut off: {said}"
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 1
    (here / "flipped.mcap").write_bytes(flipped)
    status, text = answered(capsys, "report", "flipped.mcap", "--no-figures", "--quiet")  # J7
    assert status == 2
    assert text == f"phasmid: {said}\n".replace("cut.mcap is cut off", "flipped.mcap is damaged")
    assert (here / "flipped/summary.json").exists()


def test_a_full_disk_is_status_1_and_says_what_was_saved(here, capsys, monkeypatch):  # C6
    whole = Writer.add_message

    def full(writer, channel, time, data, published, number):
        if number >= 1024:
            raise OSError(errno.ENOSPC, "No space left on device")
        whole(writer, channel, time, data, published, number)

    monkeypatch.setattr(Writer, "add_message", full)
    status, text = answered(capsys, "walk", "--duration", "4", "--out", "a")
    assert status == 1
    assert text == (
        "phasmid: cannot write a.mcap: no space left on device; "
        "1.02 s of 4 s were saved and can be read.\n"
    )
    with pytest.warns(DamagedRecording, match="is cut off: 1024 of 4001 samples"):
        assert load_recording(here / "a.mcap").sizes["time"] == 1024


def test_a_replay_says_whether_the_bits_are_the_same(here, capsys):
    assert main(["walk", "--duration", "1", "--out", "a", "--no-figures", "--quiet"]) == 0
    capsys.readouterr()
    assert main(["replay", "a/recording.nc"]) == 0
    assert capsys.readouterr().out.startswith("equal: 1001 samples of ")
    assert main(["replay", "a"]) == 0
    assert capsys.readouterr().out.startswith("equal: 1001 samples of ")
    other = load_recording(here / "a")
    other.joint_torque.values[300] += 1.0
    save_recording(other, here / "b.nc")
    assert main(["replay", "b.nc"]) == 1
    assert capsys.readouterr().out.startswith("different: joint_torque at sample 300 (0.3 s) is ")
    assert main(["report", "a", "--out", "again", "--no-figures", "--quiet"]) == 0
    assert (here / "again/summary.json").read_text() == (here / "a/summary.json").read_text()
    status, text = answered(capsys, "report", ".")
    assert status == 2
    assert text.startswith("phasmid: . is a folder without a recording.nc.")


def started(here, *arguments):
    command = [sys.executable, "-m", "phasmid", "walk", "--out", "a", "--quiet", *arguments]
    process = subprocess.Popen(
        command, cwd=here, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
    )
    log = here / "a.mcap"
    while process.poll() is None and not (log.exists() and log.stat().st_size > 100_000):
        time.sleep(0.005)
    return process


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
def test_a_killed_walk_loses_nothing_that_was_there(here):
    process = started(here, "--duration", "60")
    before = (here / "a.mcap").read_bytes()
    process.kill()
    process.communicate()
    after = (here / "a.mcap").read_bytes()
    assert after.startswith(before)
    (here / "before.mcap").write_bytes(before)
    with pytest.warns(DamagedRecording):
        there, found = load_recording(here / "before.mcap"), load_recording(here / "a.mcap")
    assert found.attrs["ending"] == "CUT"
    assert found.sizes["time"] >= there.sizes["time"] > 0
    assert found.isel(time=slice(0, there.sizes["time"])).equals(there)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
def test_an_interrupted_process_ends_in_order(here):
    process = started(here, "--duration", "60")
    process.send_signal(signal.SIGINT)
    _, text = process.communicate()
    assert process.returncode == 130
    assert text.startswith("phasmid: The run was stopped by the user at ")
    assert [p.name for p in here.iterdir()] == ["a.mcap"]
    assert load_recording(here / "a.mcap").attrs["ending"] == "STOPPED"


def test_an_interrupt_that_a_library_turns_into_another_error_is_still_one(monkeypatch, capsys):
    # A compiled module whose import is interrupted says ImportError.
    import signal

    def import_interrupted(arguments):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise ImportError("initialization failed") from None

    monkeypatch.setattr("phasmid.cli._run", import_interrupted)
    before = signal.getsignal(signal.SIGINT)
    assert answered(capsys, "walk") == (130, "phasmid: stopped.\n")
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize(
    "arguments",
    [["-c", "import phasmid"], ["-m", "phasmid", "--help"], ["-m", "phasmid", "doctor", "--help"]],
)
def test_importing_and_asking_for_help_load_no_engine(arguments):
    # What makes them quick, and can be checked without a clock.
    code = subprocess.run(
        [sys.executable, "-X", "importtime", *arguments], capture_output=True, text=True, check=True
    )
    for heavy in ("mujoco", "matplotlib", "xarray", "numpy", "pydantic", "rich"):
        assert f" {heavy}\n" not in code.stderr


def test_fields_that_do_nothing_are_noted(here, capsys):
    arguments = ["walk", "--punch", "9", "--duration", "0.1", "--no-figures"]
    note = 'punch has no effect with drive "prescribed".'
    status, text = answered(capsys, *arguments, "--out", "a")
    assert (status, text) == (0, f"phasmid: note: {note}\n")
    assert note in json.loads((here / "a/summary.json").read_text())["warnings"]
    assert answered(capsys, *arguments, "--out", "b", "--quiet") == (0, "")
    assert answered(capsys, "check", "a/scenario.toml") == (0, f"phasmid: note: {note}\n")


def test_lists_of_the_terrain_are_written_with_commas(here):
    arguments = ["walk", "--terrain", "steps", "--edge-x-mm", "400,500", "--edge-z-mm=-10,0"]
    arguments += ["--patches", "0,1,-1,1,0.5;0.5,1,-1,1,0.2", "--duration", "0.1"]
    assert main([*arguments, "--planned-on", "level", "--no-figures", "--quiet"]) == 0
    (folder,) = (here / "results").iterdir()
    table = load_scenario(folder / "scenario.toml").terrain
    assert (table.edge_x, table.edge_z) == ((0.4, 0.5), (-0.01, 0.0))
    assert table.patches == ((0.0, 1.0, -1.0, 1.0, 0.5), (0.5, 1.0, -1.0, 1.0, 0.2))


@pytest.mark.parametrize("place", [".", "..", "/", "a/.."])
def test_a_place_that_is_no_new_folder_is_refused(here, capsys, place):
    for options in (["walk", "--duration", "0.1"], ["walk", "--duration", "0.1", "--force"]):
        status, error = answered(capsys, *options, "--out", place)
        assert status == 2
        assert "is no name for a run's folder" in error
    assert list(here.iterdir()) == []


@pytest.mark.parametrize(
    ("command", "said", "unbuffered"),
    [
        ("check paper > /dev/full", "no space left on device", ""),
        ("--help > /dev/full", "no space left on device", ""),
        ("--help > /dev/full", "no space left on device", "1"),
        ("check paper | true", "broken pipe", "1"),
    ],
)
def test_output_that_nobody_takes_is_told_in_one_sentence(here, command, said, unbuffered):
    if not Path("/dev/full").exists():
        pytest.skip("this system has no full device")
    # A named pipe whose reader has gone before the command writes: a shell's "| true", for sure.
    run, _, place = command.partition(" > " if ">" in command else " | ")
    if place == "true":
        read, write = os.pipe()
        os.close(read)
    else:
        write = os.open(place, os.O_WRONLY)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "phasmid", *run.split()],
            check=False,
            stdout=write,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
        )
    finally:
        os.close(write)
    assert done.stderr == f"phasmid: cannot write the output: {said}.\n"
    assert done.returncode == 1


def test_a_command_needs_neither_of_its_streams(here, monkeypatch):
    monkeypatch.setattr(sys, "stdout", None)
    monkeypatch.setattr(sys, "stderr", None)
    assert main(["walk", "--duration", "0.1", "--no-figures"]) == 0
    assert main(["nothing"]) == 2
    sys.stdout.close()
    sys.stderr.close()


def test_a_walk_whose_summary_cannot_be_printed_leaves_its_folder_and_no_log(here, monkeypatch):
    class Full(io.StringIO):
        def write(self, text):
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(sys, "stdout", Full())
    assert main(["walk", "--duration", "0.1", "--no-figures", "--out", "a"]) == 1
    assert [path.name for path in here.iterdir()] == ["a"]


def test_hostile_names_drive_no_terminal_W11(here, capsys):
    # A gait may be called anything; whatever is printed of it is text on one line.
    for name, text in hostile_files(0.1).items():
        Path(f"{name}.toml").write_text(text, encoding="utf-8")
    for arguments in (
        ["check", "--robot", "robot.toml"],
        ["check", "scenario.toml"],
        ["check", "scenario.toml", "--voltage", "9"],
        ["walk", "scenario.toml", "--voltage", "9", "--out", "a", "--no-figures"],
        ["report", "a", "--out", "b"],
        ["replay", "a"],
        ["report", "a", "--figures", "gait-diagram"],
        ["export", "a"],
        ["export", "--robot", "robot.toml", "--out", "again.toml"],
        ["walk", "scenario.toml", "--step-length-mm", "400"],
    ):
        main(arguments)
        told = capsys.readouterr()
        assert told.out + told.err
        assert not set(UNSEEN) & set(told.out + told.err), arguments
