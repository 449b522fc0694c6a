"""Everything that can be checked about a place is checked before anything is computed."""

import errno
import shutil
import tempfile

import pytest

from phasmid.cli import main
from phasmid.paper.evidence import Evidence
from phasmid.simulation import Run
from phasmid.studies.executor import LocalExecutor
from phasmid.studio.live_simulation import LiveSimulation

STUDY = 'kind = "plan"\nmetrics = ["energy.work"]\nseeds = 1\n'

COMMANDS = {
    "walk": ["walk"],
    "drive": ["drive", "--velocity", "0.05,0,0"],
    "paper": ["paper"],
    "study": ["study", "study.toml"],
    "studio": ["studio", "--no-open", "--port", "0"],
}


def refuse(*_, **__):
    raise OSError(errno.EROFS, "Read-only file system")


PLACES = {
    "long name": ("x" * 240, "its name is too long; 237 bytes are possible"),
    "longer name": ("x" * 300, "name too long"),
    "many folders": ("a/" * 1500 + "b", "nested folders; at most 200 are possible"),
    "folder of a file": ("study.toml/out", "study.toml is not a folder"),
    "no access": ("out", "is not writable"),
    "read only": ("out", "read-only file system"),
    "full disk": ("out", "GB; 0 GB are free on its disk"),
}


WORK = (
    (Run, "__init__"),
    (Evidence, "trial"),
    (LocalExecutor, "__enter__"),
    (LiveSimulation, "start"),
)
CASES = [(command, place) for command in COMMANDS for place in PLACES]
# The files of paper and studio have names of their own in the folder.
CASES = [case for case in CASES if case not in (("paper", "long name"), ("studio", "long name"))]


@pytest.mark.parametrize(("command", "place"), CASES)
def test_a_place_is_refused_before_the_work(command, place, here, monkeypatch, capsys):
    (here / "study.toml").write_text(STUDY)
    for owner, name in WORK:
        monkeypatch.setattr(owner, name, lambda *_, **__: pytest.fail("the work began"))
    if place == "no access":
        monkeypatch.setattr("os.access", lambda *_: False)
    if place == "read only":
        monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    if place == "full disk":
        monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(1, 1, 0))
    out, reason = PLACES[place]
    # A path of too many folders is bad input, whatever the disk.
    assert main([*COMMANDS[command], "--out", out]) == (2 if place == "many folders" else 1)
    said = capsys.readouterr().err
    assert reason in said
    assert "Traceback" not in said
    assert [path.name for path in here.iterdir()] == ["study.toml"]


def test_a_walk_without_room_for_its_folder_is_refused(tmp_path, monkeypatch, capsys):
    # The log would fit, but not the folder beside it: 1 s of samples takes about 2 MB.
    free = 12_000_000
    monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(free, 0, free))
    monkeypatch.setattr(Run, "advance", lambda *_, **__: pytest.fail("the work began"))
    assert main(["walk", "--duration", "5", "--out", str(tmp_path / "out"), "--quiet"]) == 1
    assert "0.012 GB are free" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
