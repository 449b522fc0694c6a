"""The command: what it writes, what it prints, what it answers to mistakes."""

import json
import subprocess
import sys

import pytest

from phasmid.cli import main
from phasmid.recording import load_recording
from phasmid.scenario import load_scenario, option_keys


def answered(capsys, *arguments):
    """Exit status and error text of a call."""
    status = main(arguments)
    return status, capsys.readouterr().err


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_walk_writes_its_folder_whole(here, capsys):
    assert main(["walk", "--duration", "2", "--out", "results/short"]) == 0
    folder = here / "results/short"
    assert {p.name for p in folder.iterdir()} == {
        "scenario.toml",
        "robot.toml",
        "recording.nc",
        "summary.json",
        "figures",
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


def test_every_field_of_a_scenario_is_an_option(here, capsys):
    with pytest.raises(SystemExit):
        main(["walk", "--help"])
    text = capsys.readouterr().out
    for key in option_keys():
        assert f"--{key.replace('_', '-')} " in text


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        pytest.param(["wlak"], 'no command "wlak".\n  try  phasmid walk', id="C1"),
        pytest.param(
            ["walk", "--dt", "nan"],
            "--dt is nan; it must be a finite number greater than 0.",
            id="C2-nan",
        ),
        pytest.param(
            ["walk", "--dt", "-1"], "--dt is -1 s; it must be greater than 0.", id="C2-negative"
        ),
        pytest.param(
            ["walk", "--dt", "-1e-3"], "--dt is -0.001 s; it must be greater than 0.", id="C2-tiny"
        ),
        pytest.param(
            ["walk", "--dt", "0"], "--dt is 0 s; it must be greater than 0.", id="C2-zero"
        ),
        pytest.param(
            ["walk", "--duration", "1e9"],
            "1e+09 s at 1 ms is 1e+12 steps, with 1 s to settle; the limit is 1e+08.\n"
            "  try  --max-steps, or a shorter duration",
            id="C3",
        ),
        pytest.param(
            ["walk", "--dt", "0.5"],
            "--dt 0.5 s cannot resolve this contact (needs <= 0.0034 s).\n  try  --dt 0.002",
            id="C4",
        ),
        pytest.param(["walk", "--legs", "1,9"], "there is no leg 9; legs are 1 to 6.", id="C8"),
        pytest.param(
            ["walk", "--legs", "one"],
            '--legs is "one"; it must be leg numbers with commas between.\n  try  --legs 1,2,3',
            id="legs-text",
        ),
        pytest.param(
            ["walk", "--step-lenght-mm", "40"],
            'no option "--step-lenght-mm".\n  try  --step-length-mm',
            id="option",
        ),
        pytest.param(
            ["walk", "--step-height-mm", "-30"],
            "--step-height-mm is -30 mm; it must be 0 or more.",
            id="G6",
        ),
        pytest.param(
            ["walk", "--gait", "tripode"],
            'no gait called "tripode".\n  try  "tripod" (known: tripod, wave, ripple, amble)',
            id="G10",
        ),
        pytest.param(
            ["walk", "--stance-law", "coxa"],
            '--stance-law is "coxa"; it must be "straight" or "coxa-only".',
            id="choice",
        ),
        pytest.param(
            ["walk", "papper"], 'no scenario called "papper".\n  try  "paper"', id="scenario"
        ),
        pytest.param(
            ["walk", "--name", "../x"],
            '--name is "../x"; it must be a plain name.\n'
            "  try  letters, digits, and . _ - between them, 64 at most",
            id="name",
        ),
    ],
)
def test_a_mistake_gets_a_sentence_and_status_2(here, capsys, arguments, error):
    status, text = answered(capsys, *arguments)
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
    from dataclasses import replace

    from phasmid.robot import load_robot, robot_to_toml

    robot = load_robot("phantomx-paper")
    weak = replace(robot, servo=replace(robot.servo, stall_torque=0.2))
    (here / "weak.toml").write_text(robot_to_toml(weak), encoding="utf-8")
    arguments = [
        "walk",
        "--robot",
        "weak.toml",
        "--drive",
        "ideal-servo",
        "--no-figures",
        "--out",
        "fell",
    ]
    status, text = answered(capsys, *arguments)
    assert status == 3
    assert text.startswith("phasmid: The robot fell at ")
    assert load_recording(here / "fell/recording.nc").attrs["ending"] == "FELL"


def test_an_interrupted_walk_is_status_130_and_its_record_is_kept(here, capsys, monkeypatch):
    from phasmid.simulation import Run

    whole = Run._keep

    def interrupt(run, *arguments):
        whole(run, *arguments)
        if run.done > 1000:
            monkeypatch.setattr(Run, "_keep", whole)
            raise KeyboardInterrupt

    monkeypatch.setattr(Run, "_keep", interrupt)
    status, text = answered(capsys, "walk", "--out", "stopped", "--quiet")
    assert status == 130
    assert text.startswith("phasmid: The run was stopped by the user at 1.")
    recording = load_recording(here / "stopped/recording.nc")
    assert recording.attrs["ending"] == "STOPPED"
    assert recording.sizes["time"] > 1000
    assert not (here / "stopped/figures").exists()


@pytest.mark.parametrize("name", ["phantomx-paper", "phantomx-ax", "phantomx-mk4", "paper"])
def test_check_says_that_the_presets_are_possible(here, capsys, name):
    assert main(["check", name]) == 0
    assert capsys.readouterr().out.endswith("possible.\n")


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


def test_check_says_why_a_file_is_not(here, capsys):
    (here / "s.toml").write_text("[stride]\nstep_length_mm = 400\n", encoding="utf-8")
    status, text = answered(capsys, "check", "s.toml")
    assert status == 2
    assert "Longest stride here: 230 mm." in text
    (here / "r.toml").write_text('name = "r"\n[legs]\n', encoding="utf-8")
    status, text = answered(capsys, "check", "r.toml")
    assert status == 2
    assert "in   r.toml" in text


@pytest.mark.parametrize("arguments", [["-c", "import phasmid"], ["-m", "phasmid", "--help"]])
def test_importing_and_asking_for_help_load_no_engine(arguments):
    # What makes them quick, and can be checked without a clock.
    code = subprocess.run(
        [sys.executable, "-X", "importtime", *arguments], capture_output=True, text=True, check=True
    )
    for heavy in ("mujoco", "matplotlib", "xarray", "numpy", "pydantic"):
        assert f" {heavy}\n" not in code.stderr


def test_every_public_name_can_be_imported():
    import phasmid

    assert len(phasmid.__all__) <= 40
    for name in phasmid.__all__:
        assert getattr(phasmid, name) is not None
    with pytest.raises(AttributeError):
        phasmid.nothing  # noqa: B018


def test_one_option_chooses_the_terrain(here):
    # --terrain names the kind; other options of the terrain go with it, and the folder keeps both.
    arguments = ["walk", "--terrain", "step", "--rise-mm", "25", "--duration", "0.1"]
    assert main([*arguments, "--planned-on", "level", "--no-figures", "--quiet"]) == 0
    (folder,) = (here / "results").iterdir()
    table = load_scenario(folder / "scenario.toml").terrain
    assert (table.kind, table.rise, table.friction) == ("step", 0.025, 0.7)


def test_lists_of_the_terrain_are_written_with_commas(here):
    arguments = ["walk", "--terrain", "steps", "--edge-x-mm", "400,500", "--edge-z-mm=-10,0"]
    arguments += ["--patches", "0,1,-1,1,0.5;0.5,1,-1,1,0.2", "--duration", "0.1"]
    assert main([*arguments, "--planned-on", "level", "--no-figures", "--quiet"]) == 0
    (folder,) = (here / "results").iterdir()
    table = load_scenario(folder / "scenario.toml").terrain
    assert (table.edge_x, table.edge_z) == ((0.4, 0.5), (-0.01, 0.0))
    assert table.patches == ((0.0, 1.0, -1.0, 1.0, 0.5), (0.5, 1.0, -1.0, 1.0, 0.2))
