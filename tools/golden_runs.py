"""Run the golden cases, and compare them with stored figures or with another version.

    make golden                          compare with the stored figures
    make golden ARGS="--against COMMIT"  compare with another version, bit by bit
    make golden ARGS="--write NAME ..."  store figures anew, with tolerances from disturbed runs

The exit status is 1 where anything differs.
"""

from __future__ import annotations

import argparse
import filecmp
import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from golden.comparing import compare  # noqa: E402
from golden.figures import DISTURBANCES, differences, write  # noqa: E402
from golden.running import HERE, Answers, answer, case_names, is_smoke  # noqa: E402

SHOWN = 8
"""Lines of differences that are printed of a case."""


def against_stored(name: str) -> list[str]:
    """Run a case and compare it with its stored figures."""
    try:
        return differences(name, answer(name))
    except Exception as error:
        return [f"{type(error).__name__}: {error}"]


def store(name: str) -> list[str]:
    """Run a case undisturbed and disturbed, and store its figures."""
    disturbances = [0.0, *([] if is_smoke(name) else DISTURBANCES)]
    why = write(name, [answer(name, disturbance=each) for each in disturbances])
    return [why] if why else []


def source_of(commit: str) -> Path:
    """Return a folder with a version's files, below ``results``."""
    sha = _git("rev-parse", "--verify", f"{commit}^{{commit}}").decode().strip()
    folder = ROOT / "results" / "versions" / sha[:12]
    if not folder.is_dir():
        folder.mkdir(parents=True)
        files = _git("archive", sha)
        subprocess.run(["tar", "-x", "-C", str(folder)], input=files, check=True)
    return folder


def _git(*words: str) -> bytes:
    done = subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, check=False)
    if done.returncode:
        raise SystemExit(f"golden: {done.stderr.decode().strip()}")
    return done.stdout


def interpreter_of(folder: Path) -> str:
    """Return the Python of a version: this one where both lock the same packages."""
    names = ("requirements/run.txt", "requirements/dev.txt")
    if all(filecmp.cmp(ROOT / name, folder / name, shallow=False) for name in names):
        return sys.executable
    subprocess.run(["make", "-C", str(folder), ".venv/.develop"], check=True)
    return str(folder / ".venv" / "bin" / "python")


def answers_of(folder: Path, out: Path, names: list[str]) -> None:
    """Run cases with the version in a folder, by its own interpreter and in its own words."""
    renamed = folder / HERE.relative_to(ROOT) / "renamed.toml"
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    script = str(HERE / "running.py")
    words = [interpreter_of(folder), script, str(renamed), str(out), *names]
    subprocess.run(words, env=environment, check=False)


def against_version(commit: str, names: list[str]) -> dict[str, list[str]]:
    """Run cases with this version and with another, and compare them."""
    folders = {"here": ROOT, "there": source_of(commit)}
    found = {}
    with TemporaryDirectory() as scratch:
        for side, folder in folders.items():
            answers_of(folder, Path(scratch) / side, names)
        for name in names:
            places = {side: Path(scratch) / side / name for side in folders}
            failed = [side for side, place in places.items() if not place.is_dir()]
            found[name] = [f"the case failed {side}" for side in failed]
            if not failed:
                ours, theirs = map(Answers.load, places.values())
                found[name] = compare(ours, theirs, names_only=is_smoke(name))
    return found


def main() -> int:
    """Run what the options say."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="cases, by the beginning of their names")
    either = parser.add_mutually_exclusive_group()
    either.add_argument("--write", action="store_true", help="store figures anew")
    either.add_argument("--against", metavar="COMMIT", help="compare with another version")
    options = parser.parse_args()
    names = [name for name in case_names() if name.startswith(tuple(options.names) or "")]
    if not names:
        parser.error(f"no case begins with {' or '.join(options.names)}.")
    if options.against:
        results = against_version(options.against, names)
    else:
        # Each run has one core; threads of linear algebra would occupy the others.
        for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
            os.environ.setdefault(variable, "1")
        with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
            each = pool.map(store if options.write else against_stored, names)
            results = dict(zip(names, each, strict=True))
    good, bad = ("stored", "refused") if options.write else ("equal", "differs")
    for name, lines in results.items():
        print(f"{bad if lines else good:8} {name}")
        for line in lines[:SHOWN]:
            print(f"         {line}")
        if len(lines) > SHOWN:
            print(f"         and {len(lines) - SHOWN} more")
    failed = sum(map(bool, results.values()))
    what = "" if options.write else f" to {options.against or 'the stored figures'}"
    print(f"{len(names) - failed} of {len(names)} cases {good}{what}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
