"""``phasmid demo``: the first command: the paper's walk, filmed, and its page in the browser."""

from __future__ import annotations

import argparse
import webbrowser
from pathlib import Path

from phasmid.cli.doctor import has_display
from phasmid.cli.output import say
from phasmid.errors import plain

OPTIONS = {
    "--out DIR": ("folder of the results; default: results/demo", "results/demo"),
    "--no-open": "open no browser, only print the files",
}


def run(options: argparse.Namespace) -> int:
    """Walk, film and open the page; return the exit status of the walk."""
    from phasmid.cli.parser import build_parser

    folder = Path(options.out)
    film = folder / "walk.gif"
    say("The paper's PhantomX walks two cycles of its tripod gait, in MuJoCo.\n")
    walk = build_parser("walk").parse_args(
        ["walk", "--duration", "4", "--out", str(folder), "--video", str(film), "--force"]
    )
    status: int = walk.run(walk)
    page = folder / "report.html"
    if status == 0:
        say(f"\nThe page is {plain(str(page))}; it works offline.")
        say("Next: phasmid walk --gait wave, or phasmid --help for all commands.")
        if not options.no_open and has_display():
            webbrowser.open(page.absolute().as_uri())
    return status
