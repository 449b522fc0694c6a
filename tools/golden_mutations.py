"""Prove that the golden cases catch faults: mutate the source, and run the cases.

    make slow SUITE=mutations                 all mutations of tests/golden/mutations.toml
    make slow SUITE=mutations ARGS="sign"     those whose names begin so

Each mutation is made in a copy of the source. It is caught where a case runs and differs from its
stored figures. The exit status is 1 where one is not caught, and 2 where none can be judged.
"""

from __future__ import annotations

import shutil
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from golden_runs import HERE, ROOT, case_names, differences, is_smoke, run_cases
from versions import UserError

Mutation = dict[str, Any]


def first_difference(
    mutation: Mutation | None, first: Sequence[str], others: Sequence[str] = ()
) -> str:
    """Return the largest difference of the first case that a mutation changes, or nothing.

    Args:
        mutation: The mutation; None: the source as it is.
        first: Cases that run first.
        others: Cases that run where those are equal.

    Raises:
        UserError: The mutation can no longer be made.
    """
    with TemporaryDirectory() as folder:
        tree = Path(folder)
        # A copy keeps the times of its files, and so the compiled code of what is not mutated.
        shutil.copytree(ROOT / "src", tree / "src")
        shutil.copytree(HERE, tree / HERE.relative_to(ROOT))
        if mutation:
            mutate(tree / "src" / "phasmid" / mutation["file"], mutation)
        for names in (first, others):
            for name, answers in run_cases(names, tree / "answers", tree).items() if names else ():
                if lines := differences(name, answers):
                    return f"{name}: {lines[0]}"
    return ""


def mutate(file: Path, mutation: Mutation) -> None:
    """Make a mutation in a file.

    Raises:
        UserError: Its line is not there once.
    """
    text = file.read_text("utf-8")
    if text.count(mutation["old"]) != 1:
        raise UserError(f"{mutation['name']}: its line is not once in {mutation['file']}.")
    file.write_text(text.replace(mutation["old"], mutation["new"]), "utf-8")


def prove(mutations: Sequence[Mutation]) -> int:
    """Make mutations, print what catches them, and return the exit status."""
    first = sorted({name for mutation in mutations for name in mutation["cases"]})
    if line := first_difference(None, first):
        raise UserError(f"without a mutation {line}.")
    caught = 0
    for mutation in mutations:
        others = [
            name for name in case_names() if name not in mutation["cases"] and not is_smoke(name)
        ]
        line = first_difference(mutation, mutation["cases"], others)
        caught += bool(line)
        print(f"{'caught    ' if line else 'NOT CAUGHT'}  {mutation['name']}", flush=True)
        print(f"            {line or 'all cases that run answer as stored'}", flush=True)
    print(f"{caught} of {len(mutations)} mutations are caught")
    return 0 if caught == len(mutations) else 1


def main() -> int:
    """Prove all mutations, or those whose names begin with an argument."""
    mutations = tomllib.loads((HERE / "mutations.toml").read_text("utf-8"))["mutation"]
    chosen = [m for m in mutations if m["name"].startswith(tuple(sys.argv[1:]) or "")]
    try:
        if not chosen:
            raise UserError(f"no mutation begins with {' or '.join(sys.argv[1:])}.")
        return prove(chosen)
    except UserError as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
