"""Prove that the golden cases catch faults: mutate the source, and run the cases.

    make mutations                 all mutations of tests/golden/mutations.toml
    make mutations ARGS="sign"     those whose names begin so

Each mutation is made in a copy of the source. It is caught where a case differs from its stored
figures. The exit status is 1 where one is not caught, or can no longer be made.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from versions import ROOT

sys.path.insert(0, str(ROOT / "tests"))

from golden.figures import differences
from golden.running import HERE, Answers, case_names, is_smoke


def caught_by(mutation: dict[str, Any], scratch: Path) -> str:
    """Return the first difference that a mutation makes; an empty text where there is none."""
    # A copy keeps the times of its files, and so the compiled code of what is not mutated.
    source = shutil.copytree(ROOT / "src", scratch / "src")
    file = source / "phasmid" / mutation["file"]
    text = file.read_text("utf-8")
    if text.count(mutation["old"]) != 1:
        raise SystemExit(f"{mutation['name']}: its line is no longer once in {mutation['file']}.")
    file.write_text(text.replace(mutation["old"], mutation["new"]), "utf-8")
    first = mutation["cases"]
    others = [name for name in case_names() if name not in first and not is_smoke(name)]
    for names in (first, others):
        for name, line in changed(names, source, scratch / "answers"):
            return f"{name}: {line}"
    return ""


def changed(names: list[str], source: Path, out: Path) -> list[tuple[str, str]]:
    """Return the cases that differ from their stored figures, with the largest difference."""
    words = [sys.executable, str(HERE / "running.py"), str(HERE / "renamed.toml"), str(out)]
    environment = os.environ | {"PYTHONPATH": str(source)}
    done = subprocess.run(
        [*words, *names], env=environment, capture_output=True, text=True, check=False
    )
    found = []
    for name in names:
        if not (out / name).is_dir():
            found.append((name, f"the case fails: {done.stderr.strip()[-200:]}"))
        elif lines := differences(name, Answers.load(out / name)):
            found.append((name, lines[0]))
    return found


def main() -> int:
    """Make all mutations, or those whose names begin with an argument."""
    mutations = tomllib.loads((HERE / "mutations.toml").read_text("utf-8"))["mutation"]
    chosen = [m for m in mutations if m["name"].startswith(tuple(sys.argv[1:]) or "")]
    caught = 0
    for mutation in chosen:
        with TemporaryDirectory() as scratch:
            line = caught_by(mutation, Path(scratch))
        caught += bool(line)
        print(f"{'caught    ' if line else 'NOT CAUGHT'}  {mutation['name']}", flush=True)
        print(f"            {line or 'all cases answer as stored'}", flush=True)
    print(f"{caught} of {len(chosen)} mutations are caught")
    return 0 if chosen and caught == len(chosen) else 1


if __name__ == "__main__":
    sys.exit(main())
