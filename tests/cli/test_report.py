"""``phasmid report``: result folders and figures."""

import shutil
import webbrowser
import xml.etree.ElementTree as ET

import pytest

from phasmid import load_scenario, plan, save_recording, simulate
from phasmid.cli import main, walk
from phasmid.reporting import CATALOGUE, report


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    scenario = load_scenario("paper").replace(duration=0.4)
    run = simulate(scenario, plan(scenario))
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


def words_of(path):
    return "".join(ET.parse(path).getroot().itertext())


def test_figures_are_written_as_asked(here, capsys):
    names = ("gait-diagram", "power")
    figures = ["--figures", ",".join(names), "--format", "svg,png,pdf", "--out", "figs"]
    assert main(["report", "results/a", *figures]) == 0
    files = [f"figs/{name}.{kind}" for name in names for kind in ("svg", "png", "pdf")]
    assert capsys.readouterr().out.split() == files
    assert "power" in words_of(here / "figs/power.svg").lower()
    assert (here / "figs/power.png").read_bytes().startswith(b"\x89PNG")
    assert (here / "figs/power.pdf").read_bytes().startswith(b"%PDF")


def test_several_runs_are_compared_in_one_figure(here):
    command = ["report", "results/a", "b.nc", "--figures", "normal-force", "--legs", "1", "--quiet"]
    assert main(command) == 0
    text = words_of(here / "plots/a_b/normal-force.svg")
    assert "Leg 1, right front" in text
    assert "Leg 2" not in text
    assert main([*command, "--labels", "before,after", "--force"]) == 0
    text = words_of(here / "plots/a_b/normal-force.svg")
    assert "before" in text
    assert "after" in text


def test_all_are_those_whose_channels_are_recorded(here, monkeypatch):
    monkeypatch.setattr("phasmid.reporting.drawing.DPI", 30)
    assert main(["report", "b.nc", "--figures", "all", "--quiet"]) == 0
    lacking = {"servo-duty", "servo-current", "servo-temperature", "sensors"}
    drawn = {path.stem for path in (here / "plots/b").iterdir()}
    assert set(CATALOGUE) - lacking <= drawn
    assert not drawn & lacking


def test_the_catalogue_is_listed(capsys):
    assert main(["report", "--list-figures"]) == 0
    assert set(CATALOGUE) <= set(capsys.readouterr().out.split())


def test_figures_are_replaced_only_with_force(here, capsys):
    (here / "figs").mkdir()
    (here / "figs/power.svg").write_text("mine")
    command = ["report", "b.nc", "--figures", "gait-diagram,power", "--out", "figs"]
    assert main(command) == 2
    hint = "--force, or another --out DIR"
    error = f"phasmid: figs/power.svg exists; nothing was written.\n  try  {hint}\n"
    assert capsys.readouterr().err == error
    assert [path.name for path in (here / "figs").iterdir()] == ["power.svg"]
    assert main([*command, "--force", "--quiet"]) == 0
    assert (here / "figs/power.svg").read_text() != "mine"


@pytest.mark.parametrize("display", [True, False])
def test_the_page_is_opened_where_a_browser_can(here, monkeypatch, capsys, display):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    monkeypatch.setattr(walk, "has_display", lambda: display)
    monkeypatch.setattr(walk, "write_report", lambda *_: None)
    monkeypatch.setattr(walk, "print_report", lambda *_: None)
    assert main(["walk", "--duration", "0.1", "--out", "x", "--open"]) == 0
    assert opened == [(here / "x/report.html").as_uri()] * display
    assert ("x/report.html" in capsys.readouterr().out) is not display
