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
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from versions import ROOT, UserError, commit_of, run_of, worktree_of

sys.path.insert(0, str(ROOT / "tests"))

from golden.comparing import compare
from golden.figures import DISTURBANCES, differences, write
from golden.running import HERE, Answers, case_names, is_smoke

SHOWN = 8
"""Lines of differences from the stored figures that are printed of a case."""


def run_cases(
    names: Sequence[str],
    out: Path,
    tree: Path = ROOT,
    python: str = sys.executable,
    disturbance: float = 0.0,
) -> dict[str, Answers]:
    """Run cases with the phasmid of a folder, and return the answers of those that did not fail.

    Args:
        names: Names of the cases.
        out: Where the answers are written.
        tree: Folder of the version: its source, and its own words.
        python: Interpreter of the version.
        disturbance: As of `golden.running.Run` [m].
    """
    renamed = tree / HERE.relative_to(ROOT) / "renamed.toml"
    environment: Mapping[str, str] = os.environ | {"PYTHONPATH": str(tree / "src")}
    words = [python, str(HERE / "running.py"), str(renamed), str(out), str(disturbance), *names]
    subprocess.run(words, env=environment, check=False)
    done = [name for name in names if (out / name / "answers.json").is_file()]
    return {name: Answers.load(out / name) for name in done}


def against_stored(names: Sequence[str], out: Path) -> dict[str, list[str]]:
    """Run cases and compare them with their stored figures."""
    answers = run_cases(names, out)
    return {
        name: differences(name, answers[name])[:SHOWN] if name in answers else ["the case failed"]
        for name in names
    }


def store(names: Sequence[str], out: Path) -> dict[str, list[str]]:
    """Run cases undisturbed and disturbed, and store their figures; return why not."""
    runs = [run_cases(names, out / "0")]
    disturbed = [name for name in names if not is_smoke(name)]
    runs += [run_cases(disturbed, out / f"{d}", disturbance=d) for d in DISTURBANCES]
    why = {}
    for name in names:
        answers = [run[name] for run in (runs if name in disturbed else runs[:1]) if name in run]
        count = len(runs) if name in disturbed else 1
        why[name] = write(name, answers) if len(answers) == count else "the case failed"
    return {name: [reason] if reason else [] for name, reason in why.items()}


def against_version(names: Sequence[str], out: Path, commit: str) -> dict[str, list[str]]:
    """Run cases with this version and with another, and compare them.

    Raises:
        UserError: There is no such version, or it cannot be set up.
    """
    python, _ = run_of(commit_of(commit))
    ours = run_cases(names, out / "ours")
    theirs = run_cases(names, out / "theirs", worktree_of(commit_of(commit)), python)
    found = {}
    for name in names:
        sides = (("here", ours), ("there", theirs))
        found[name] = [f"the case failed {side}" for side, answers in sides if name not in answers]
        if not found[name]:
            found[name] = compare(ours[name], theirs[name], names_only=is_smoke(name))
    return found


def main() -> int:
    """Run what the options say."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="cases, by the beginning of their names")
    action = parser.add_mutually_exclusive_group()
    action.add_argument("--write", action="store_true", help="store figures anew")
    action.add_argument("--against", metavar="COMMIT", help="compare with another version")
    options = parser.parse_args()
    names = [name for name in case_names() if name.startswith(tuple(options.names) or "")]
    if not names:
        parser.error(f"no case begins with {' or '.join(options.names)}.")
    with TemporaryDirectory() as folder:
        try:
            if options.against:
                results = against_version(names, Path(folder), options.against)
            else:
                results = (store if options.write else against_stored)(names, Path(folder))
        except UserError as error:
            print(error, file=sys.stderr)
            return 2
    success, failure = ("stored", "refused") if options.write else ("equal", "differs")
    for name, lines in results.items():
        print(f"{failure if lines else success:8} {name}")
        for line in lines:
            print(f"         {line}")
    failed = sum(map(bool, results.values()))
    what = "" if options.write else f" to {options.against or 'the stored figures'}"
    print(f"{len(names) - failed} of {len(names)} cases {success}{what}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
