"""``phasmid verify``: check the physics against closed forms and conservation laws."""

from __future__ import annotations

import argparse
import errno
import itertools
import json
import os
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.options import whole_numbers
from phasmid.cli.output import say
from phasmid.cli.progress import progress_bar
from phasmid.errors import InvalidInput

if TYPE_CHECKING:
    from phasmid.verification import Row

WIDTH, INDENT = 80, 6 * " "
"""Columns of the table, and the margin of the derivations."""

CASE = 27
"""Columns of a case."""

OPTIONS = {
    "--rows 1,2,...": "checks to run; default: all",
    "--explain": "print the derivation of each tolerance",
    "--json FILE": "write the rows to a file, too",
    "--page FILE": "write them as a page in Markdown, too",
    "--force": "replace files of those names",
    "--quiet": "print only what fails",
}


def run(options: argparse.Namespace) -> int:
    """Verify, and return the exit status."""
    numbers = _numbers(options.rows)
    files = [Path(name) for name in (options.json, options.page) if name is not None]
    if len({path.resolve() for path in files}) < len(files):
        raise InvalidInput(f"--json and --page are both {files[0]}; they must be two files.")
    from phasmid.recording.file import cannot_write, check_new_file, write_whole

    for path in files:
        check_new_file(path, option="file", force=options.force)
        if not path.parent.is_dir():
            raise cannot_write(path, OSError(errno.ENOENT, os.strerror(errno.ENOENT)))
    from phasmid.verification import CHECKS, Verdict, verify
    from phasmid.verification.page import page

    count = itertools.count()
    total = len(CHECKS) if numbers is None else len(numbers)
    with progress_bar("verifying", total, quiet=options.quiet) as progress:
        rows = verify(numbers, progress=progress and (lambda _: progress(next(count))))
    failed = [row for row in rows if row.verdict is Verdict.FAILS]
    # Print the table first: the disk may be full.
    if failed or not options.quiet:
        _print_table(failed if options.quiet else rows, explain=options.explain)
    if not options.quiet:
        _print_tally(rows)
    if options.json is not None:
        found = {"passed": not failed, "rows": [row.as_dict() for row in rows]}
        text = json.dumps(found, indent=2, ensure_ascii=False, allow_nan=False)
        write_whole(Path(options.json), f"{text}\n".encode())
    if options.page is not None:
        write_whole(Path(options.page), page(rows).encode())
    return 1 if failed else 0


def _numbers(text: str | None) -> list[int] | None:
    if text is None:
        return None
    from phasmid.verification.table import check_numbers

    return check_numbers(whole_numbers("--rows", text, "row numbers", "1,5,25"))


def _print_table(rows: Sequence[Row], *, explain: bool) -> None:
    from phasmid.verification.page import words

    print(_columns("row", "", "expected", "got", "tolerance", "verdict"))
    for number, group in itertools.groupby(rows, key=lambda row: row.number):
        some = list(group)
        say(f"{number:>3} {some[0].title}   {some[0].equation}")
        for row in some:
            print(_columns("", row.case, *words(row), row.verdict.value))
            if explain:
                print(
                    textwrap.fill(row.why, WIDTH, initial_indent=INDENT, subsequent_indent=INDENT)
                )


def _columns(number: str, case: str, expected: str, got: str, tolerance: str, verdict: str) -> str:
    """Return a row of the table, at most `WIDTH` wide; a long case takes several lines."""
    first, *more = textwrap.wrap(case, CASE) or [""]
    line = f"{number:>3} {first:<{CASE}} {expected:<15} {got:<15} {tolerance:<9} {verdict}"
    return "\n".join([line, *(f"{'':>4}{part}" for part in more)])


def _print_tally(rows: Sequence[Row]) -> None:
    from phasmid.verification.page import tally

    spent = {row.number: row.seconds for row in rows}
    say(f"\n{tally(rows)} {sum(spent.values()):.0f} s.")
