"""``phasmid doctor``: what it finds, what it prints, and its exit status."""

from importlib import metadata

import mujoco
import pytest

from phasmid.cli import doctor, main
from phasmid.cli.doctor import Finding
from phasmid.extras import install_hint

FINDINGS = [
    Finding("engine", "ready", "MuJoCo 4.0.1", needed=True),
    Finding("video", "absent", "videos: av is not installed", 'pip install "phasmid[video]"'),
]
BROKEN = Finding("figures", "broken", "no \x1b[2J.", "pip install matplotlib", needed=True)
TABLE = """\
engine      ready   MuJoCo 4.0.1
video       absent  videos: av is not installed
                    try  pip install "phasmid[video]"
"""


def answered(monkeypatch, capsys, findings):
    monkeypatch.setattr(doctor, "examine", lambda: findings)
    status = main(["doctor"])
    told = capsys.readouterr()
    return status, told.out, told.err


def test_what_is_needed_and_broken_fails_in_a_sentence(monkeypatch, capsys):
    status, out, err = answered(monkeypatch, capsys, [*FINDINGS, BROKEN])
    assert status == 1
    assert out.startswith(TABLE)
    assert "\x1b" not in out + err
    said = "phasmid: nothing can walk here: figures: no \N{REPLACEMENT CHARACTER}[2J.\n"
    assert err == f"{said}  try  pip install matplotlib\n"
    # What is absent but not needed does not fail.
    out = f"{TABLE}robots can walk here.\n"
    assert answered(monkeypatch, capsys, FINDINGS) == (0, out, "")


def test_this_machine_is_examined_and_can_walk(capsys):
    # The tests run on it, so that all that is needed is there.
    assert main(["doctor"]) == 0
    out = capsys.readouterr().out
    assert out.endswith("robots can walk here.\n")
    assert f"engine      ready   MuJoCo {mujoco.__version__}" in out


def test_packages_that_are_absent_or_old_are_named(monkeypatch):
    required = ["numpy>=2.0", "scipy>=1.15", 'build123d>=0.13; extra == "cad"']
    installed = {"numpy": "1.26.4", "build123d": "0.14"}

    def version(name):
        if name not in installed:
            raise metadata.PackageNotFoundError(name)
        return installed[name]

    monkeypatch.setattr(metadata, "requires", lambda _: required)
    monkeypatch.setattr(metadata, "version", version)
    monkeypatch.setattr(doctor, "_opengl", lambda: FINDINGS[1])
    found = {one.topic: one for one in doctor.examine()}
    assert found["packages"].state == "absent"
    assert found["packages"].needed
    assert found["packages"].what.endswith(
        "numpy 1.26.4 is installed; it must be >=2.0; scipy is not installed"
    )
    assert found["cad"].what == "solids and STEP files: build123d 0.14"
    del installed["build123d"]
    found = {one.topic: one for one in doctor.examine()}
    assert found["cad"].remedy == install_hint("cad")
    assert not found["cad"].needed


def test_an_engine_that_does_not_start_stops_all_walks(monkeypatch):
    def broken(_model, _data):
        raise OSError("libmujoco.so: cannot open\nmore")

    monkeypatch.setattr(mujoco, "mj_step", broken)
    monkeypatch.setattr(doctor, "_opengl", lambda: FINDINGS[1])
    (found,) = (one for one in doctor.examine() if one.topic == "engine")
    assert (found.state, found.needed) == ("broken", True)
    assert found.what == "the simulation does not start: libmujoco.so: cannot open"


@pytest.mark.parametrize(
    ("program", "state", "what"),
    [
        ("print('egl\\n\\n')", "ready", "drawn by EGL"),
        ("print('egl\\nPyOpenGL\\npip')", "absent", "they need PyOpenGL"),
        ("import os; os.abort()", "broken", "the driver crashes or hangs"),
        ("import time; time.sleep(60)", "broken", "the driver crashes or hangs"),
    ],
)
def test_a_driver_that_crashes_or_hangs_is_found(program, state, what, monkeypatch):
    monkeypatch.setattr(doctor, "RENDERER", program)
    monkeypatch.setattr(doctor, "TIMEOUT", 1.0 if "sleep" in program else 30.0)
    found = doctor.examine()[-1]
    assert (found.state, found.needed) == (state, False)
    assert found.what == f"pictures of the robot and videos: {what}"
