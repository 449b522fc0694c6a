"""``phasmid paper``: reproduce the paper and grade each of its statements."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.output import say
from phasmid.errors import plain

if TYPE_CHECKING:
    from phasmid.paper.document import Parts

OPTIONS = {
    "--out DIR": (
        "where paper.md and its figures go; default: results/paper-graded",
        "results/paper-graded",
    ),
    "--force": "replace an earlier page",
    "--quiet": "print only errors",
}


def run(options: argparse.Namespace) -> int:
    """Reproduce the paper, and return the exit status."""
    from phasmid.paper.reproduction import reproduce

    def announce(what: str) -> None:
        if not options.quiet:
            say(f"… {what}", file=sys.stderr)

    folder = Path(options.out)
    parts = reproduce(folder, force=options.force, announce=announce)
    if not options.quiet:
        _print_grades(parts)
        place = plain(str(folder))
        say(f"\nWritten to {place}: paper.md with notes and comparisons, paper/ with figures")
    return 0


def _print_grades(parts: Parts) -> None:
    """Print the statements with their grades, and the number of each grade."""
    from rich.console import Console
    from rich.table import Table

    from phasmid.paper.document import tally

    console = Console(highlight=False, markup=False)
    for name, lines in parts.items():
        table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="")
        table.add_column("where", width=13)
        table.add_column("the paper says", ratio=3)
        table.add_column("measured", ratio=4)
        table.add_column("grade", width=12)
        for statement, finding in lines:
            table.add_row(statement.where, statement.says, finding.number, finding.grade.value)
        console.print(f"\n{name}", table, sep="\n")
    console.print(f"\n{tally(parts)}")
