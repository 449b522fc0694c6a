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


READERS = """
import sys, time
from pathlib import Path
import numpy as np
from formats.fuzz.run import fuzz
from formats.fuzz.targets import Target

def hungry(path):
    if path.read_bytes() != b"whole":
        np.ones(600_000_000 // 8)

def slow(path):
    end = time.process_time() + 2.1
    while path.read_bytes() != b"whole" and time.process_time() < end:
        pass

def odd(path):
    if path.read_bytes() != b"whole":
        raise KeyError("x")

def deadly(path):
    if path.read_bytes() != b"whole":
        import os
        os.abort()

target = Target(".x", globals()[sys.argv[1]], (b"whole",))
print(fuzz(sys.argv[1], target, 1, 1, Path(sys.argv[2])).broken)
"""


@pytest.mark.parametrize(
    ("reader", "why"),
    [
        ("hungry", "asked for more than 500 MB"),
        ("slow", "s of processor time"),
        ("odd", "KeyError"),
        ("deadly", "ended by SIGABRT"),
    ],
)
def test_a_reader_that_fails_is_found_out(reader: str, why: str, tmp_path: Path) -> None:
    done = run("-c", READERS, reader, str(tmp_path))
    assert why in done.stdout, done.stdout + done.stderr
    assert len(list(tmp_path.iterdir())) == 1
