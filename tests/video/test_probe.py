"""What a machine lacks for a video is found out without harm, and said with what to install."""

import os
import sys

import pytest

from phasmid.video import probe
from phasmid.video.probe import Lack, candidates, child_environment, h264_encoder, lack


@pytest.fixture
def fresh(monkeypatch):
    """A machine with the extra, of which nothing has been asked yet."""
    asked = probe.gl_backend
    asked.cache_clear()
    monkeypatch.setattr(probe, "find_spec", lambda name: name)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    yield monkeypatch
    asked.cache_clear()


@pytest.mark.parametrize(
    ("trial", "draws"),
    [
        ("print('drawn')", True),
        ("print('blank')", False),
        ("import os; os.abort()", False),
        ("raise RuntimeError", False),
        ("print('drawn', flush=True); import time; time.sleep(60)", False),
    ],
)
def test_a_way_to_draw_that_crashes_hangs_or_draws_nothing_is_none(fresh, trial, draws):
    fresh.setattr(probe, "TRIAL", trial)
    fresh.setattr(probe, "TIMEOUT", 5.0 if draws else 2.0)
    assert probe._draws("egl") is draws


def test_the_first_way_that_draws_is_taken_and_asked_for_once(fresh):
    asked = []
    fresh.setattr(probe, "candidates", lambda: ("egl", "osmesa", "glfw"))
    fresh.setattr(probe, "_draws", lambda name: asked.append(name) or name == "osmesa")
    assert probe.gl_backend() == "osmesa"
    assert probe.gl_backend() == "osmesa"
    assert asked == ["egl", "osmesa"]


def test_the_question_leaves_the_environment_as_it_was(fresh):
    fresh.setattr(probe, "TRIAL", "print('drawn')")
    before = dict(os.environ)
    assert probe.gl_backend() == candidates()[0]
    assert dict(os.environ) == before


def test_the_users_own_way_comes_first(fresh):
    fresh.setenv("MUJOCO_GL", " OSMesa ")
    assert candidates()[0] == "osmesa"
    assert candidates().count("osmesa") == 1


def test_a_wish_for_no_drawing_is_heard(fresh):
    fresh.setenv("MUJOCO_GL", "off")
    fresh.setattr(probe, "h264_encoder", lambda: "libx264")
    found = lack()
    assert found is not None
    assert found.sentence == "video needs OpenGL, which MUJOCO_GL=off forbids"
    assert found.advice == "unset MUJOCO_GL"


def test_missing_packages_are_named_with_the_extra_that_brings_them(fresh):
    fresh.setattr(probe, "find_spec", lambda name: None if name in ("av", "OpenGL") else name)
    both, one = lack(".mp4"), lack(".gif")
    assert both == Lack("PyOpenGL and PyAV", 'pip install "phasmid[video]"', "which were not found")
    assert one is not None
    assert one.sentence == "video needs PyOpenGL, which was not found"


def test_a_missing_encoder_is_named_for_mp4_alone(fresh):
    fresh.setattr(probe, "h264_encoder", lambda: None)
    fresh.setattr(probe, "gl_backend", lambda: "egl")
    found = lack(".mp4")
    assert found is not None
    assert found.what == "an H.264 encoder in PyAV"
    assert lack(".gif") is None


@pytest.mark.skipif(sys.platform != "linux", reason="the names of Debian's packages")
def test_without_opengl_debians_packages_are_named(fresh):
    fresh.setattr(probe, "gl_backend", lambda: None)
    found = lack(".gif")
    assert found is not None
    assert found.what == "OpenGL without a window (EGL or OSMesa)"
    assert found.advice == "apt install libegl1 libgl1-mesa-dri, or libosmesa6"


def test_a_broken_encoder_package_is_none(monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    h264_encoder.cache_clear()
    assert h264_encoder() is None
    h264_encoder.cache_clear()


def test_the_process_that_draws_gets_its_own_way_and_our_modules(monkeypatch):
    monkeypatch.setenv("PYOPENGL_PLATFORM", "glx")
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    environment = child_environment("egl")
    assert environment["MUJOCO_GL"] == "egl"
    assert "PYOPENGL_PLATFORM" not in environment
    assert os.environ["MUJOCO_GL"] == "glfw"
