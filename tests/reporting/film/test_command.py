"""``--video``: what is refused before a run starts, and advice where a machine has no OpenGL."""

import json
import sys

import pytest

import phasmid.reporting
from phasmid.cli import main
from phasmid.errors import InvalidInput
from phasmid.extras import install_hint
from phasmid.reporting import renderer, save_video
from phasmid.reporting.renderer import opengl_lack

SHORT = ["--duration", "0.06", "--quiet"]
FILES = {"recording.nc", "summary.json", "scenario.toml", "robot.toml"}


def files_of(folder):
    return {path.name for path in folder.iterdir()}


@pytest.fixture
def lacking(monkeypatch):
    """A machine without OpenGL."""
    monkeypatch.setenv("MUJOCO_GL", "off")
    opengl_lack.cache_clear()
    yield
    opengl_lack.cache_clear()


@pytest.mark.parametrize("command", ["walk", "report"])
def test_without_opengl_the_run_is_whole(command, lacking, tmp_path, capsys):
    """Advice on the standard error, status 0, the recording complete, and its page instead."""
    folder, video = tmp_path / "run", tmp_path / "walk.gif"
    wanted = ["--out", str(folder), "--video", str(video)]
    if command == "report":
        assert main(["walk", *SHORT, "--no-figures", "--out", str(folder)]) == 0
        assert main(["report", str(folder), "--quiet", "--force", "--no-figures", *wanted]) == 0
    else:
        assert main(["walk", *SHORT, *wanted]) == 0
    replay = " report.html has a 3-D replay instead." if command == "walk" else ""
    assert capsys.readouterr().err == (
        "phasmid: video needs OpenGL, which MUJOCO_GL=off forbids; the recording is complete."
        f"{replay}\n  try  unset MUJOCO_GL\n"
    )
    assert files_of(folder) == FILES | ({"figures", "report.html"} if replay else set())
    assert not video.exists()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("walk.avi", '"{path}" does not end in .mp4 or .gif; a video must.\n  try  "{mp4}"'),
        (
            "there.mp4",
            "{path} exists; nothing was written.\n  try  --force, or another --video FILE",
        ),
        ("folder.mp4", "{path} is a folder; nothing was written.\n  try  a file's name"),
    ],
)
def test_what_cannot_be_written_is_refused_before_the_run(name, said, tmp_path, capsys):
    (tmp_path / "there.mp4").write_bytes(b"mine")
    (tmp_path / "folder.mp4").mkdir()
    path = tmp_path / name
    wanted = said.format(path=path, mp4=path.with_suffix(".mp4"))
    assert main(["walk", *SHORT, "--out", str(tmp_path / "run"), "--video", str(path)]) == 2
    assert capsys.readouterr().err == f"phasmid: {wanted}\n"
    assert files_of(tmp_path) == {"there.mp4", "folder.mp4"}
    assert (tmp_path / "there.mp4").read_bytes() == b"mine"


def test_an_mp4_without_its_encoder_is_refused_before_the_run(monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, "av", None)
    wanted = ["--out", str(tmp_path / "run"), "--video", str(tmp_path / "walk.mp4")]
    assert main(["walk", *SHORT, *wanted]) == 2
    assert capsys.readouterr().err == (
        "phasmid: a video as .mp4 needs PyAV, which was not found.\n"
        f"  try  {install_hint('video')}, or a .gif\n"
    )
    assert files_of(tmp_path) == set()


def test_a_video_may_go_into_the_folder_that_the_run_will_make(lacking, tmp_path):
    folder = tmp_path / "run"
    wanted = ["--out", str(folder), "--no-figures", "--video", str(folder / "video.gif")]
    assert main(["walk", *SHORT, *wanted]) == 0
    (folder / "video.gif").write_bytes(b"film")
    # A folder with a film of ours in it is still a run's, and may be replaced.
    assert main(["walk", *SHORT, *wanted, "--force"]) == 0
    assert files_of(folder) == FILES


def test_ctrl_c_while_it_is_filmed_leaves_the_run_whole(tmp_path, monkeypatch, capsys):
    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(renderer, "opengl_lack", lambda: None)
    monkeypatch.setattr(phasmid.reporting, "save_video", interrupted)
    folder = tmp_path / "run"
    wanted = ["--out", str(folder), "--no-figures", "--video", str(tmp_path / "a.gif")]
    assert main(["walk", *SHORT, *wanted]) == 130
    assert capsys.readouterr().err == "phasmid: stopped.\n"
    assert files_of(folder) == FILES
    assert json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert files_of(tmp_path) == {"run"}


@pytest.mark.parametrize(
    ("argument", "value", "said"),
    [
        ("size", (641, 360), "the video's width is 641; it must be an even number of pixels from"),
        ("size", (640, 9000), "the video's height is 9000; it must be an even number of pixels"),
        ("fps", 0, "fps is 0; it must be greater than 0 and 50 or less."),
        ("fps", 60.0, "fps is 60.0; it must be greater than 0 and 50 or less."),
        ("speed", float("nan"), "speed is nan; it must be greater than 0 and 1000 or less."),
    ],
)
def test_options_that_make_no_video_are_refused(recording, argument, value, said, tmp_path):
    with pytest.raises(InvalidInput) as caught:
        save_video(recording, tmp_path / "a.gif", **{argument: value})
    assert str(caught.value).startswith(said)
