"""Mistakes in a command line get one sentence and status 2, and change no file."""

import shlex
import shutil

import pytest

from phasmid.cli import main

FILES = ("a.svg", "old.toml", "there.h", "there.csv", "there.urdf")


@pytest.fixture(scope="module")
def folder(results, tmp_path_factory):
    """A folder with two runs, other files, and a folder ``d.csv``."""
    folder = shutil.copytree(results, tmp_path_factory.mktemp("folder"), dirs_exist_ok=True)
    (folder / "d.csv").mkdir()
    for name in FILES:
        (folder / name).write_text("mine")
    return folder


REFUSALS = {
    "bus scn x": '"scn" is no action',
    "bus scan": "needs a port",
    "bus emulate --ids 1-x": "it must be ids from 0 to 252",
    "bus emulate --fault '5 daed'": "is no fault of a bus",
    "bus emulate --fault '99 dead'": "there is no servo 99",
    "bus emulate --model AX-12": 'no control table of a servo called "AX-12"',
    "bus emulate --robot markwtech": "the servo MG996R of markwtech has no bus that phasmid knows",
    "bus emulate --calibration x.toml": "--calibration needs the robot",
    "bus emulate --calibration x.toml --robot octopod": "x.toml does not exist",
    "bus emulate --calibration x.toml --robot octopod --ids 1-24": "--ids and --model must go",
    "bus emulate --ids 1,2 --robot phantomx-ax": "has 18 servos; --ids names 2",
    "bus calibrate /dev/null": "phasmid bus calibrate needs a robot",
    "bus calibrate /dev/null --robot phantomx-ax --pose neutral1": "--pose neutral",
    "bus calibrate /dev/null --robot phantomx-ax --out robot.txt": "it must end in .toml",
    "bus calibrate /dev/null --robot phantomx-ax --ids 1-17": "has 18 servos; --ids names 17",
    "bus calibrate /dev/null --robot phantomx-ax --out old.toml": "old.toml exists; nothing was",
    "check --foot-at right_frnt 0,0,0": 'there is no leg "right_frnt"; legs are right_',
    "check --foot-at 9 0,0,0": "there is no leg 9; legs are 1 to 6.",
    "check --foot-at 1 0,nan,0": '--foot-at LEG is "0,nan,0"; it must be three numbers',
    "check --pose 0,1": '--pose is "0,1"; it must be three numbers with commas between.',
    "check --pose 0,0,0 --foot-at 1 0,0,0": "--foot-at and a posture are two questions;",
    "check --foot-at 1 0,0,0 --frame world": '--frame is "world"; it must be body or hip.',
    "check --foot-at 1 0,0,0 --out a.txt": '--out is "a.txt"; it must end in .svg, .png, .pdf.',
    "check --foot-at 1 0,0,0 --out a.svg": "a.svg exists; nothing was written.\n  try  --force",
    "check tripod": "tripod is a gait, no scenario.\n  try  --gait tripod",
    "check --robot phantomx-ax --total-mass-g 0": "--total-mass-g is 0 g; it must be",
    "check --robot phantomx-ax --mesh-unit inch": '--mesh-unit is "inch"; it must be',
    "check --robot phantomx-ax --package a": 'package is "a"; it must be a name and',
    "check --robot phantomx-ax --total-mass-g 5000": "options of reading are for URDF, MJCF and",
    "advise --total-mass-g 5000": "phantomx-paper describes its robot in full; options of reading",
    "walk --robot quadruped --masses geometry": "quadruped describes its robot in full; options of",
    "drive": "one of the arguments --velocity --commands --waypoints is required.",
    "drive --velocity 0,0,0 --waypoints 1,0": "argument --waypoints: not allowed with argument",
    "drive --velocity 0.1,0": '--velocity has "0.1,0"; it must be 3 numbers with commas',
    "drive --velocity 50,0,0": "--velocity: ahead is 50 m/s; it must be 10 or less.\n  try  --v",
    "drive --waypoints '1,0;a,b'": '--waypoints has "a,b"; it must be 2 or 3 numbers with comm',
    "drive --waypoints '1,0;0,nan'": "--waypoints 2: y is nan; it must be a finite number",
    "drive --waypoints ';'": "the script has no command and no waypoint",
    "drive --velocity 0,0,0 --rate x": '--rate is "x"; it must be a number from',
    "drive --velocity 0,0,0 --rate 300 --dt 0.001": "rate is 300 updates a second",
    "drive --velocity 0,0,0 --fault x": 'a fault is "x"; it must be what fails',
    "drive --commands absent.toml": "absent.toml does not exist.",
    "export": "no recording is named.",
    "export c.nc": "recording c.nc does not exist.",
    "export b.nc --out a.txt": '"a.txt" does not end in one of .csv, .nc, .mcap, .toml,',
    "export b.nc --channels joint_torqe": 'no channel "joint_torqe".',
    "export b.nc --channels servo_current": "the recording has no servo_current.",
    "export b.nc --rate -1": '--rate is "-1"; it must be a number from 0.001 to 1e+06.',
    "export b.nc --out b.nc --force": "b.nc is the recording itself;",
    "export b.nc --out d.csv --force": "d.csv is a folder; nothing was written.",
    "export --robot phantomx-ax --out a.urdf --period 2": "--period changes nothing of the file",
    "export --robot phantomx-ax --out a.urdf --rate 9": "--rate belongs to a recording.",
    "export --robot phantomx-ax --out a.urdf --servo AX-12": 'no servo called "AX-12".',
    "export --out there.h": "there.h exists; nothing was written.\n  try  --force, or another",
    "export b.nc --out there.csv": "there.csv exists; nothing was written.",
    "export --out there.urdf": "there.urdf exists; nothing was written.",
    "gaits --step-length-mm far": '--step-length-mm is "far"; it must be a number.\n',
    "gaits --lost 1,2 --gait wave": "without legs 1, 2 the others do not hold the robot: the ce",
    "gaits --gait tripode": 'no gait called "tripode".\n',
    "gaits --gait nowhere.toml": "nowhere.toml does not exist.\n",
    "report results/a --figures gait-digram": 'no figure "gait-digram".',
    "report results/b --figures power": "recording results/b does not exist.",
    "report results --figures power": "results is a folder without a recording.nc.",
    "report": "no recording is named.",
    "report b.nc results/a": "several recordings have no common result folder;",
    "report b.nc results/a --figures power --video a.gif": "a video shows one run;",
    "report b.nc --figures power --format pgn": 'no format "pgn".\n  try  "png"',
    "report b.nc --figures power --dpi nan": '--dpi is "nan"; it must be a number',
    "report b.nc --figures power --width-mm 8.5": '--width-mm is "8.5"; it must be',
    "report b.nc --figures power,joint-angle --legs 9": "there is no leg 9;",
    "report b.nc --figures power,servo-current": "the recording has no servo_current;",
    "report results/a b.nc --figures walk": "the figure walk shows one run;",
    "report b.nc --figures power --labels a,b": "2 labels were given for 1 runs;",
    "report b.nc --dpi 300": "--dpi belongs to --figures, which is missing.",
    "report b.nc --figures power --mcap": "--mcap belongs to a result folder.",
    "report b.nc --open --no-figures": "--open shows report.html, which --no-figures",
    "studio --no-open --port http": '--port is "http"; it must be a whole number from 0 to 65535.',
    "studio --no-open --host a..b": '--host is "a..b"; it must be a name or a number of this mac',
    # An address that is kept for examples, and no machine's.
    "studio --no-open --host 192.0.2.1 --port 0": "cannot listen at 192.0.2.1, port 0: ",
    "studio --no-open --gait tripode": 'no gait called "tripode".',
    "studio --no-open --prot 8033": 'no option "--prot".',
    "studio --no-open nowhere": 'no scenario called "nowhere".',
    "advise --robot nobody": 'no robot called "nobody".',
    "advise --servo AX-12": 'no servo called "AX-12".',
    "advise --servo mg996r": 'try  "MG996R"',
    "advise --gait gallop": 'no gait called "gallop".',
    "advise --payload-g much": '--payload-g is "much"',
    "advise --payload-g -5": "--payload-g is -5",
    "advise --speed-mm-s 0": '--speed-mm-s is "0"',
    "advise --robot phantomx-ax --step-length-mm 400": "step of 400 mm is too much for right_front",
    "advise --battery-mah nan": '--battery-mah is "nan"',
    "advise --battery-mah 0": '--battery-mah is "0"; it must be a number from 10 to 1e+06.',
    "advise --cells 0": '--cells is "0"; it must be a number from 1 to 14.',
    "advise --cells 2.5": "cells is 2.5; it must be a whole number.",
    "advise --wire-mm2 0": '--wire-mm2 is "0"; it must be a number from 0.03 to 100.',
    "advise --wire-length-mm -1": "it must be a number from 0 to 20000.",
    "advise --wire-mm2 0.03 --wire-length-mm 20000": "no servo works on the rest.",
    "advise --out advice.txt": '--out is "advice.txt"',
    "advise --robot phantomx-ax --step-length-mm 0 --speed-mm-s 20": "step_length is 0",
    "identify absent.csv": "--mass-g is missing",
    "identify absent.csv --mass-g x --length-mm 1": "must be a positive number",
    "identify absent.csv --mass-g 1,2 --length-mm 1": "2 numbers for 1 logs",
    "identify absent.csv --mass-g 1 --length-mm 1 --model m7": 'no model "m7"',
    "identify absent.csv --mass-g 1 --length-mm 1 --bam a.json": "BAM has no model",
    "identify absent.csv --mass-g 1 --length-mm 1": "does not exist",
    "identify absent.csv --robot phantomx-ax --mass-g 300": "is for a pendulum",
    "identify absent.csv --robot phantomx-ax --leg right_frnt": "right_front",
    "identify absent.csv --robot phantomx-ax": "does not exist",
}


@pytest.mark.parametrize("line", REFUSALS)
def test_a_mistake_gets_one_sentence_and_changes_nothing(line, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    assert main(shlex.split(line)) == 2
    printed = capsys.readouterr().err
    assert printed.startswith("phasmid: ")
    assert REFUSALS[line] in printed
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
