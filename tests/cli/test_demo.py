"""``phasmid demo`` walks, films and opens the page."""

import webbrowser

import pytest

from phasmid.cli import demo, main, walk


@pytest.fixture
def opened(monkeypatch):
    """Addresses that a browser was given; the machine has a display."""
    addresses = []
    monkeypatch.setattr(webbrowser, "open", addresses.append)
    monkeypatch.setattr(demo, "has_display", lambda: True)
    return addresses


@pytest.fixture
def walks(monkeypatch):
    """Options of the walks that were made, which take no time here."""
    given = []
    monkeypatch.setattr(walk, "run", lambda options: given.append(options) or 0)
    return given


def test_the_page_of_the_filmed_walk_is_opened(opened, walks, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["demo"]) == 0
    assert walks[0].video.endswith("walk.gif")
    assert opened == [(tmp_path / "results/demo/report.html").as_uri()]
    assert "report.html" in capsys.readouterr().out


def test_no_browser_is_opened_if_that_is_not_wanted(opened, walks):
    assert main(["demo", "--no-open"]) == 0
    assert opened == []


def test_a_failed_walk_opens_nothing_and_gives_its_status(opened, monkeypatch):
    monkeypatch.setattr(walk, "run", lambda options: 3)
    assert main(["demo"]) == 3
    assert opened == []


@pytest.mark.slow
def test_the_demo_makes_a_page_and_a_film(tmp_path):
    assert main(["demo", "--no-open", "--out", str(tmp_path / "demo")]) == 0
    assert (tmp_path / "demo/report.html").stat().st_size > 1e6
    assert (tmp_path / "demo/walk.gif").read_bytes().startswith(b"GIF89a")
