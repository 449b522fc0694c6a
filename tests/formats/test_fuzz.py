"""Whatever happens to a file, its reader soon ends with a robot or a sentence."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]

# Limits and forks as used here are Linux's own.
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs Linux")


def run(*words: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONWARNINGS": "ignore"}
    command = [sys.executable, *words]
    return subprocess.run(
        command, cwd=TESTS, env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("reader", ["urdf", "mjcf", "stl", "obj", "ply", "glb", "toml"])
def test_twenty_damaged_files_end_well(reader: str, tmp_path: Path) -> None:
    done = run("-m", "formats.fuzz.run", reader, "--files", "20", "--keep", str(tmp_path))
    assert done.returncode == 0, done.stdout + done.stderr
