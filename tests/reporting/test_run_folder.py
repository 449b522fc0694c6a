"""A run's folder is whole or absent, and nothing of the user's is lost."""

import errno
import json
from pathlib import Path

import pytest

from phasmid.errors import InvalidInput, OutputError
from phasmid.recording import load_recording
from phasmid.reporting import check_folder, report, summarise
from phasmid.robot import load_robot
from phasmid.scenario import load_scenario


@pytest.fixture(scope="module")
def tiny(walk):
    return walk(duration=2.0, interval=0.02)


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_a_runs_folder_holds_all_that_was_learnt(tiny, tmp_path, monkeypatch):
    # A small picture is drawn as a large one is, but sooner.
    monkeypatch.setattr("phasmid.reporting.drawing.DPI", 60)
    folder = report(tiny, tmp_path / "results" / "walk")
    assert folder == tmp_path / "results" / "walk"
    assert names(folder) == {
        "scenario.toml",
        "robot.toml",
        "recording.nc",
        "summary.json",
        "figures",
        "report.html",
    }
    assert names(folder.parent) == {"walk"}
    assert load_recording(folder / "recording.nc").identical(tiny)
    assert json.loads((folder / "summary.json").read_text(encoding="utf-8")) == summarise(tiny)
    figures = {f"fig{n}{s}" for n in range(12, 17) for s in (".svg", ".png")} | {"walk.png"}
    assert names(folder / "figures") == figures
    # The folder can be run again: its scenario names the robot beside it.
    again = load_scenario(folder / "scenario.toml")
    assert again.robot == str(folder / "robot.toml")
    assert load_robot(folder / "robot.toml").mass == load_robot("phantomx-paper").mass


def test_an_existing_folder_is_left_alone(tiny, tmp_path):
    folder = tmp_path / "walk"
    folder.mkdir()
    for call in (lambda: report(tiny, folder, figures=False), lambda: check_folder(folder)):
        with pytest.raises(InvalidInput, match=r"walk exists; nothing was written\.") as caught:
            call()
        assert caught.value.hint == "force=True, or another name"
        assert caught.value.exit_status == 2
    assert names(tmp_path) == {"walk"}
    assert names(folder) == set()


def test_force_replaces_an_older_run_or_an_empty_folder(tiny, tmp_path):
    folder = tmp_path / "walk"
    folder.mkdir()
    report(tiny, folder, force=True, figures=False)
    (folder / "summary.json").write_text("{}", encoding="utf-8")
    (folder / "report.html").write_text("old", encoding="utf-8")
    report(tiny, folder, force=True, figures=False)
    assert json.loads((folder / "summary.json").read_text(encoding="utf-8")) != {}
    assert "report.html" not in names(folder)
    assert names(tmp_path) == {"walk"}


@pytest.mark.parametrize(
    ("files", "said"),
    [
        (["thesis.tex"], "holds"),
        (["thesis.tex", "summary.json"], "holds"),
        (["run", "figures/mine.svg"], "walk also holds .*, which is no part of a run"),
        (["run", "body.glb"], "walk also holds .*, which is no part of a run"),
        (["run", "figures/notes/a.txt"], "walk also holds .*, which is no part of a run"),
        ([], "is not a folder"),
    ],
)
def test_force_never_removes_what_is_not_a_runs(tiny, tmp_path, files, said):
    folder = tmp_path / "walk"
    if files[:1] == ["run"]:
        report(tiny, folder, figures=False)
    own = [folder / name for name in files if name != "run"] or [folder]
    for path in own:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("mine", encoding="utf-8")
    with pytest.raises(InvalidInput, match=said):
        report(tiny, folder, force=True, figures=False)
    assert {path.read_text(encoding="utf-8") for path in own} == {"mine"}
    assert names(tmp_path) == {"walk"}


def test_a_folder_that_cannot_be_made_is_found_before_the_run(tiny, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    for call in (check_folder, lambda folder: report(tiny, folder)):
        with pytest.raises(OutputError, match="cannot write") as caught:
            call(tmp_path / "file" / "walk")
        assert caught.value.exit_status == 1
    monkeypatch.setattr("os.access", lambda path, mode: False)
    with pytest.raises(OutputError, match=r"cannot write .*walk: .* is not writable"):
        check_folder(tmp_path / "walk")


def full_disk(*args, **kwargs):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_keeps_the_old_run_and_leaves_nothing_else(tiny, tmp_path, monkeypatch):
    folder = report(tiny, tmp_path / "walk", figures=False)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    monkeypatch.setattr("os.fsync", full_disk)
    with pytest.raises(OutputError, match=r"walk.*no space left on device") as caught:
        report(tiny, folder, force=True, figures=False)
    assert "partial" not in str(caught.value)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert names(tmp_path) == {"walk"}


def test_a_failing_rename_puts_the_old_run_back(tiny, tmp_path, monkeypatch):
    folder = report(tiny, tmp_path / "walk", figures=False)
    rename = Path.rename

    def refuse(self, target):
        if self.name.endswith(".partial"):
            full_disk()
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(OutputError, match="no space left"):
        report(tiny, folder, force=True, figures=False)
    monkeypatch.undo()
    assert names(tmp_path) == {"walk"}
    assert load_recording(folder / "recording.nc").identical(tiny)


@pytest.mark.parametrize("broken", ["one sample", "NaN at the end", "NaN at the start"])
def test_a_run_that_ended_at_once_is_reported_too(tiny, tmp_path, monkeypatch, broken):
    monkeypatch.setattr("phasmid.reporting.drawing.DPI", 60)
    recording = tiny.copy(deep=True)
    if broken == "one sample":
        recording = recording.isel(time=slice(0, 1))
    else:
        first = 1 if broken == "NaN at the end" else 0
        for name in recording.data_vars:
            if recording[name].dtype.kind == "f":
                recording[name].values[first:] = float("nan")
    folder = report(recording, tmp_path / "walk")
    shown = names(folder / "figures")
    assert ("walk.png" in shown) == (broken != "NaN at the start")
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["run"]["samples"] == recording.sizes["time"]


def test_a_link_to_a_run_is_replaced_where_it_points(tiny, tmp_path):
    real = report(tiny, tmp_path / "real", figures=False)
    link = tmp_path / "link"
    link.symlink_to(real)
    report(tiny, link, force=True, figures=False)
    assert link.is_symlink()
    assert "summary.json" in names(real)
