"""``phasmid doctor``: list what this machine supports, and how to install the rest."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from phasmid.errors import OutputError, plain

if TYPE_CHECKING:
    from phasmid.doctor import Finding

COLOURS = {"ready": "green", "absent": "yellow", "broken": "bold red"}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")


def run(options: argparse.Namespace) -> int:
    """Examine the machine, and return the exit status: 1 where no robot can walk."""
    from phasmid.doctor import State, examine

    findings = examine()
    faults = [one for one in findings if one.needed and one.state is not State.READY]
    if options.json:
        found = {"walks": not faults, "findings": [one.as_dict() for one in findings]}
        print(json.dumps(found, indent=2))
    else:
        _print_table(findings)
    if faults:
        first = faults[0]
        sentence = f"nothing can walk here: {first.topic}: {first.what.rstrip('.')}."
        print(f"phasmid: {OutputError(sentence, hint=first.remedy)}", file=sys.stderr)
        return OutputError.exit_status
    if not options.json:
        print("robots can walk here.")
    return 0


def _print_table(findings: Sequence[Finding]) -> None:
    """Print a line for each finding, and one for its remedy."""
    try:
        from rich.console import Console
        from rich.text import Text
    except ImportError:
        # Without rich: the installation may be what is broken.
        for one in findings:
            print(f"{one.topic:<11} {one.state.value:<7} {plain(one.what)}")
            if one.remedy:
                print(f"{'':<19} try  {plain(one.remedy)}")
        return
    console = Console(highlight=False, markup=False)
    for one in findings:
        line = Text(f"{one.topic:<11} ")
        line.append(f"{one.state.value:<7} ", style=COLOURS[one.state.value])
        console.print(line.append(plain(one.what)), soft_wrap=True)
        if one.remedy:
            console.print(Text(f"{'':<19} try  {plain(one.remedy)}", style="cyan"), soft_wrap=True)
