"""Run the golden cases, and compare them with stored figures or with another version.

    make golden                          compare with the stored figures
    make golden ARGS="--against COMMIT"  compare with another version, bit by bit
    make golden ARGS="--write NAME ..."  store figures anew, with tolerances from disturbed runs

The exit status is 1 where anything differs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

from versions import ROOT, UserError, commit_of, run_of, worktree_of

sys.path.insert(0, str(ROOT / "tests"))

from golden.comparing import compare
from golden.figures import DISTURBANCES, differences, write
from golden.running import HERE, Answers, answer, case_names, is_smoke

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


def against_version(commit: str, names: list[str]) -> dict[str, list[str]]:
    """Run cases with this version and with another, and compare them."""
    commit = commit_of(commit)
    sides = {
        "here": (ROOT, sys.executable, os.environ | {"PYTHONPATH": str(ROOT / "src")}),
        "there": (worktree_of(commit), *run_of(commit)),
    }
    found = {}
    with TemporaryDirectory() as scratch:
        for side, (tree, python, environment) in sides.items():
            print(f"{side}: {len(names)} cases", file=sys.stderr, flush=True)
            renamed = tree / HERE.relative_to(ROOT) / "renamed.toml"
            # Each version is run and read in its own words, by the same file.
            words = [python, str(HERE / "running.py"), str(renamed), str(Path(scratch) / side)]
            subprocess.run([*words, *names], env=environment, check=False)
        for name in names:
            places = {side: Path(scratch) / side / name for side in sides}
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
        try:
            results = against_version(options.against, names)
        except UserError as error:
            print(error, file=sys.stderr)
            return 2
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
