"""``phasmid plot`` and ``phasmid export``: what they write, and what they answer to mistakes."""

import csv
import shutil
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from phasmid import export, load_recording, load_scenario, plan, save_recording, simulate
from phasmid.cli import main
from phasmid.errors import InvalidInput
from phasmid.reporting import CATALOGUE, report


@pytest.fixture(scope="module")
def run():
    scenario = load_scenario("paper").replace(duration=0.4)
    return simulate(scenario, plan(scenario))


@pytest.fixture(scope="module")
def results(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    report(run, folder / "results/a", figures=False)
    save_recording(run, folder / "b.nc")
    return folder


@pytest.fixture
def here(results, tmp_path, monkeypatch):
    """A folder with two runs: ``results/a`` and ``b.nc``."""
    shutil.copytree(results, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def answered(capsys, *arguments):
    """Exit status and error text of a call."""
    status = main(arguments)
    return status, capsys.readouterr().err


def test_plot_writes_what_is_asked_where_it_is_asked(here, capsys):
    names = ("gait-diagram", "power")
    assert main(["plot", "results/a", *names, "--format", "svg,png,pdf", "--out", "figs"]) == 0
    files = {f"{name}.{kind}" for name in names for kind in ("svg", "png", "pdf")}
    assert {path.name for path in (here / "figs").iterdir()} == files
    assert capsys.readouterr().out.split() == [
        f"figs/{name}.{kind}" for name in names for kind in ("svg", "png", "pdf")
    ]
    assert ET.parse(here / "figs/power.svg").getroot().tag.endswith("svg")
    assert (here / "figs/power.png").read_bytes().startswith(b"\x89PNG")
    assert (here / "figs/power.pdf").read_bytes().startswith(b"%PDF")


def test_plot_of_several_runs_names_them_and_their_folder(here):
    command = ["plot", "results/a", "b.nc", "normal-force", "--legs", "1", "--quiet"]
    assert main(command) == 0
    text = "".join(ET.parse(here / "plots/a_b/normal-force.svg").getroot().itertext())
    assert "Leg 1, right front" in text
    assert "Leg 2" not in text
    assert main([*command, "--labels", "before,after", "--force"]) == 0
    text = "".join(ET.parse(here / "plots/a_b/normal-force.svg").getroot().itertext())
    assert "before" in text
    assert "after" in text


def test_the_same_run_gives_the_same_files(here):
    for folder in "xy":
        command = ["plot", "b.nc", "servo-envelope", "--format", "svg,pdf,png", "--quiet"]
        assert main([*command, "--out", folder]) == 0
    for kind in ("svg", "pdf", "png"):
        x, y = ((here / folder / f"servo-envelope.{kind}").read_bytes() for folder in "xy")
        assert x == y


def test_all_draws_what_the_recording_has_the_channels_for(here, run, monkeypatch):
    drawn = []
    monkeypatch.setattr(
        "phasmid.cli.plot.write_figure", lambda figure, files, dpi: drawn.append(files[0].stem)
    )
    monkeypatch.setattr("phasmid.reporting.drawing.DPI", 30)
    assert main(["plot", "b.nc", "all", "--quiet"]) == 0
    lacking = {"servo-duty", "servo-current", "servo-temperature", "sensors"}
    assert drawn == [name for name in CATALOGUE if name not in lacking]


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        pytest.param(
            ["results/a", "gait-digram"],
            'no figure "gait-digram".\n  try  "gait-diagram"',
            id="name",
        ),
        pytest.param(
            ["results/b", "power"],
            "recording results/b does not exist.\n  try  phasmid walk",
            id="recording",
        ),
        pytest.param(
            ["results", "power"], "results is a folder without a recording.nc.", id="folder"
        ),
        pytest.param(["b.nc"], "no figure is named.", id="no-figure"),
        pytest.param(["power"], "no recording is named.", id="no-recording"),
        pytest.param(
            ["b.nc", "power", "--format", "pgn"], 'no format "pgn".\n  try  "png"', id="format"
        ),
        pytest.param(
            ["b.nc", "power", "--dpi", "nan"],
            '--dpi is "nan"; it must be a number from 30 to 1200.\n  try  --dpi 300',
            id="dpi",
        ),
        pytest.param(
            ["b.nc", "power", "--width-mm", "8.5"],
            '--width-mm is "8.5"; it must be a number from 60 to 500.\n  try  --width-mm 85',
            id="width",
        ),
        pytest.param(
            ["b.nc", "power", "joint-angle", "--legs", "9"],
            "there is no leg 9; legs are 1 to 6.",
            id="leg",
        ),
        pytest.param(
            ["b.nc", "power", "servo-current"],
            "the recording has no servo_current; the figure servo-current needs it.\n"
            "  try  phasmid walk --drive servo records it",
            id="channel",
        ),
        pytest.param(
            ["results/a", "b.nc", "power", "walk"],
            "the figure walk shows one run; 2 were given.",
            id="several",
        ),
        pytest.param(
            ["b.nc", "power", "--labels", "a,b"],
            "2 labels were given for 1 runs; each needs one.",
            id="labels",
        ),
    ],
)
def test_plot_refuses_before_it_draws(here, capsys, arguments, error):
    status, said = answered(capsys, "plot", *arguments)
    assert status == 2
    assert said.startswith(f"phasmid: {error}")
    assert not (here / "plots").exists()


def test_plot_replaces_figures_only_with_force(here, capsys):
    (here / "figs").mkdir()
    (here / "figs/power.svg").write_text("mine")
    status, said = answered(capsys, "plot", "b.nc", "gait-diagram", "power", "--out", "figs")
    assert status == 2
    hint = "--force, or another --out DIR"
    assert said == f"phasmid: figs/power.svg exists; nothing was written.\n  try  {hint}\n"
    assert [path.name for path in (here / "figs").iterdir()] == ["power.svg"]
    assert main(["plot", "b.nc", "power", "--out", "figs", "--force", "--quiet"]) == 0
    assert (here / "figs/power.svg").read_text() != "mine"
    status, said = answered(capsys, "plot", "b.nc", "power", "--out", "b.nc/figs", "--quiet")
    assert status == 1
    assert said.startswith("phasmid: cannot write b.nc/figs/power.svg:")


def test_export_writes_beside_the_folder_and_keeps_every_bit(here, run, capsys):
    assert main(["export", "results/a"]) == 0
    assert capsys.readouterr().out == "results/a.csv\n"
    with (here / "results/a.csv").open(newline="") as file:
        heading, *rows = csv.reader(file)
    numbers = dict(zip(heading, np.array(rows, dtype=float).T, strict=True))
    np.testing.assert_array_equal(numbers["time [s]"], run["time"].values)
    for leg, name in ((0, "right_front"), (5, "left_front")):
        torque = run["joint_torque"].values[:, leg, 1]
        np.testing.assert_array_equal(numbers[f"joint_torque.{name}.femur [N m]"], torque)
        contact = run["contact"].values[:, leg]
        np.testing.assert_array_equal(numbers[f"contact.{name} [1]"], contact)
    # The result folder holds nothing foreign, so that a walk of its name may still replace it.
    assert main(["export", "results/a/recording.nc", "--force", "--quiet"]) == 0
    assert not list((here / "results/a").glob("*.csv"))


def test_export_to_netcdf_is_a_recording_of_the_chosen_channels(here, run):
    command = ["export", "b.nc", "--out", "c.nc", "--channels", "foot_force,joint_torque"]
    assert main([*command, "--rate", "100"]) == 0
    found = load_recording("c.nc")
    assert set(found.data_vars) == {"foot_force", "joint_torque"}
    assert found.attrs == run.attrs
    assert found.equals(run[["joint_torque", "foot_force"]].isel(time=slice(None, None, 10)))


def test_export_to_mcap_names_the_legs(here, run):
    from mcap.reader import make_reader

    assert main(["export", "b.nc", "--out", "b.mcap", "--rate", "50"]) == 0
    with (here / "b.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    assert {"/joint_states", "/tf", "/feet/right_front/force"} <= topics
    assert set(summary.statistics.channel_message_counts.values()) == {21}
    with pytest.raises(InvalidInput, match="none of these channels has a message"):
        export(run, "c.mcap", channels=["joint_torque"])


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        pytest.param(["c.nc"], "recording c.nc does not exist.", id="recording"),
        pytest.param(
            ["b.nc", "--out", "a.txt"],
            '"a.txt" does not end in .csv, .nc, .mcap; it must.\n  try  "a.csv"',
            id="ending",
        ),
        pytest.param(
            ["b.nc", "--channels", "joint_torqe"],
            'no channel "joint_torqe".\n  try  "joint_torque"',
            id="channel",
        ),
        pytest.param(
            ["b.nc", "--channels", "servo_current"],
            "the recording has no servo_current.",
            id="lacking",
        ),
        pytest.param(
            ["b.nc", "--rate", "-1"],
            '--rate is "-1"; it must be a number from 0.001 to 1e+06.',
            id="rate",
        ),
        pytest.param(
            ["b.nc", "--out", "b.nc", "--force"],
            "b.nc is the recording itself; nothing was written.",
            id="itself",
        ),
        pytest.param(
            ["b.nc", "--out", "d.csv", "--force"],
            "d.csv is a folder; nothing was written.",
            id="folder",
        ),
    ],
)
def test_export_refuses_in_one_sentence(here, capsys, arguments, error):
    (here / "d.csv").mkdir()
    before = {path: path.stat().st_mtime_ns for path in here.rglob("*")}
    status, said = answered(capsys, "export", *arguments)
    assert status == 2
    assert said.startswith(f"phasmid: {error}")
    assert {path: path.stat().st_mtime_ns for path in here.rglob("*")} == before


def test_export_replaces_a_file_only_with_force(here, capsys):
    (here / "b.csv").write_text("mine")
    status, said = answered(capsys, "export", "b.nc")
    assert status == 2
    assert said.startswith("phasmid: b.csv exists; nothing was written.\n  try  --force")
    assert (here / "b.csv").read_text() == "mine"
    assert main(["export", "b.nc", "--force", "--channels", "stance", "--quiet"]) == 0
    assert (here / "b.csv").read_text().startswith('"time [s]","stance.right_front [1]"')


def test_an_exported_walk_is_a_trajectory(here):
    assert main(["walk", "--duration", "1", "--out", "a", "--no-figures", "--quiet"]) == 0
    assert main(["export", "a", "--out", "angles.csv", "--quiet"]) == 0
    walk = ["walk", "--duration", "1", "--no-figures", "--quiet", "--trajectory"]
    assert main([*walk, "angles.csv", "--out", "b"]) == 0
    first, again = (load_recording(here / name).joint_position_target for name in "ab")
    # Splines go through the angles of each sample: bit by bit but for their own rounding.
    np.testing.assert_allclose(again, first, rtol=0, atol=1e-14)
