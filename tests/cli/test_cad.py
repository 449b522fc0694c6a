"""The command ``phasmid cad``: what it writes, and what it refuses."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import numpy as np
import pytest

from phasmid.cli import main
from phasmid.robot import load_robot
from phasmid.robot.glb import read_glb

FILES = {
    "phantomx-paper.step",
    "phantomx-paper.step.toml",
    "phantomx-paper.glb",
    "phantomx-paper-masses.md",
    "stl/body.stl",
    "stl/coxa.stl",
    "stl/femur.stl",
    "stl/tibia.stl",
}


def test_it_writes_solids_meshes_and_masses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("build123d")
    out = tmp_path / "out"
    assert main(["cad", "phantomx-paper", "--out", str(out)]) == 0
    found = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert found == FILES
    printed = capsys.readouterr().out
    assert all(name in printed for name in FILES)
    assert set(read_glb(out / "phantomx-paper.glb")) == {"body", "coxa", "femur", "tibia"}
    # Table 2's coxa stands beside that of the solids.
    table = (out / "phantomx-paper-masses.md").read_text(encoding="utf-8")
    assert "| coxa | file | 21.9 | 26.5, 0.0, 0.0 | 8634, 9496, 9496 | 0, 0, 0 |" in table
    # A binary STL: 80 bytes, the number of triangles, 50 bytes each; metres, from axis to foot.
    raw = (out / "stl" / "tibia.stl").read_bytes()
    (count,) = struct.unpack("<I", raw[80:84])
    assert len(raw) == 84 + 50 * count
    rows = np.frombuffer(raw[84:], dtype=np.dtype([("x", "<f4", 12), ("", "<u2")]))
    corners = rows["x"].reshape(count, 4, 3)[:, 1:]
    length = load_robot("phantomx-paper").legs[0].tibia.length
    assert corners[..., 0].max() == pytest.approx(length, abs=0.3e-3)
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
    from phasmid.cad.library import build123d

    build123d.cache_clear()
    monkeypatch.setitem(sys.modules, "build123d", None)
    assert main(["cad", "phantomx-paper", "--out", str(tmp_path / "out")]) == 2
    build123d.cache_clear()
    assert capsys.readouterr().err.splitlines() == [
        "phasmid: solids and STEP files need build123d, which is not installed.",
        '  try  pip install "phasmid[cad]"',
    ]
    assert not (tmp_path / "out").exists()
