"""The command ``phasmid cad``: what it writes, and what it refuses."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from phasmid.cli import main
from phasmid.extras import install_hint
from phasmid.robot.glb import read_glb

FILES = {"phantomx-paper.step", "phantomx-paper.step.toml", "phantomx-paper.glb"}


def test_it_writes_solids_and_meshes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("build123d")
    out = tmp_path / "out"
    assert main(["cad", "phantomx-paper", "--out", str(out)]) == 0
    found = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert found == FILES
    printed = capsys.readouterr().out
    assert all(name in printed for name in FILES)
    assert set(read_glb(out / "phantomx-paper.glb")) == {"body", "coxa", "femur", "tibia"}
    before = (out / "phantomx-paper.step").read_bytes()
    assert main(["cad", "phantomx-paper", "--out", str(out)]) == 2
    assert "exists; nothing was written." in capsys.readouterr().err
    assert (out / "phantomx-paper.step").read_bytes() == before
    # The STEP file with its sidecar is a robot.
    assert main(["check", str(out / "phantomx-paper.step")]) == 0
    assert "52 / 82 / 140 " in capsys.readouterr().out


def test_without_the_extra_it_says_what_to_install(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from phasmid.formats.solids.assembly import build123d

    build123d.cache_clear()
    monkeypatch.setitem(sys.modules, "build123d", None)
    assert main(["cad", "phantomx-paper", "--out", str(tmp_path / "out")]) == 2
    build123d.cache_clear()
    assert capsys.readouterr().err.splitlines() == [
        "phasmid: solids and STEP files need build123d, which is not installed.",
        f"  try  {install_hint('cad')}",
    ]
    assert not (tmp_path / "out").exists()
