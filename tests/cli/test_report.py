"""``phasmid report``: result folders and figures."""

import webbrowser
import xml.etree.ElementTree as ET

import pytest

from phasmid.cli import main, walk
from phasmid.reporting import CATALOGUE


def words_of(path):
    return "".join(ET.parse(path).getroot().itertext())


def test_figures_are_written_as_asked(runs, capsys):
    names = ("gait-diagram", "power")
    figures = ["--figures", ",".join(names), "--format", "svg,png,pdf", "--out", "figs"]
    assert main(["report", "results/a", *figures]) == 0
    files = [f"figs/{name}.{kind}" for name in names for kind in ("svg", "png", "pdf")]
    assert capsys.readouterr().out.split() == files
    assert "power" in words_of(runs / "figs/power.svg").lower()
    assert (runs / "figs/power.png").read_bytes().startswith(b"\x89PNG")
    assert (runs / "figs/power.pdf").read_bytes().startswith(b"%PDF")


def test_several_runs_are_compared_in_one_figure(runs):
    command = ["report", "results/a", "b.nc", "--figures", "normal-force", "--legs", "1", "--quiet"]
    assert main(command) == 0
    text = words_of(runs / "plots/a_b/normal-force.svg")
    assert "Leg 1, right front" in text
    assert "Leg 2" not in text
    assert main([*command, "--labels", "before,after", "--force"]) == 0
    text = words_of(runs / "plots/a_b/normal-force.svg")
    assert "before" in text
    assert "after" in text


def test_all_are_those_whose_channels_are_recorded(runs, monkeypatch):
    monkeypatch.setattr("phasmid.reporting.drawing.DPI", 30)
    assert main(["report", "b.nc", "--figures", "all", "--quiet"]) == 0
    lacking = {"servo-duty", "servo-current", "servo-temperature", "sensors"}
    drawn = {path.stem for path in (runs / "plots/b").iterdir()}
    assert set(CATALOGUE) - lacking <= drawn
    assert not drawn & lacking


def test_the_catalogue_is_listed(capsys):
    assert main(["report", "--list-figures"]) == 0
    assert set(CATALOGUE) <= set(capsys.readouterr().out.split())


def test_figures_are_replaced_only_with_force(runs, capsys):
    (runs / "figs").mkdir()
    (runs / "figs/power.svg").write_text("mine")
    command = ["report", "b.nc", "--figures", "gait-diagram,power", "--out", "figs"]
    assert main(command) == 2
    hint = "--force, or another --out DIR"
    error = f"phasmid: figs/power.svg exists; nothing was written.\n  try  {hint}\n"
    assert capsys.readouterr().err == error
    assert [path.name for path in (runs / "figs").iterdir()] == ["power.svg"]
    assert main([*command, "--force", "--quiet"]) == 0
    assert (runs / "figs/power.svg").read_text() != "mine"


@pytest.mark.parametrize("display", [True, False])
def test_the_page_is_opened_where_a_browser_can(runs, monkeypatch, capsys, display):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    monkeypatch.setattr(walk, "has_display", lambda: display)
    monkeypatch.setattr(walk, "write_report", lambda *_: None)
    monkeypatch.setattr(walk, "print_report", lambda *_: None)
    assert main(["walk", "--duration", "0.1", "--out", "x", "--open"]) == 0
    assert opened == [(runs / "x/report.html").as_uri()] * display
    assert ("x/report.html" in capsys.readouterr().out) is not display
