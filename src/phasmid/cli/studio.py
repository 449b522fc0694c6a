"""``phasmid studio``: the live page, on which a robot walks and is driven."""

from __future__ import annotations

import argparse
import logging
import sys
import webbrowser
from pathlib import Path
from threading import Thread

from phasmid.cli.options import Number
from phasmid.cli.output import has_display, say
from phasmid.cli.progress import announce_compilation
from phasmid.cli.scenario_options import scenario_of, scenario_options
from phasmid.errors import InvalidInput, plain
from phasmid.extras import install_hint
from phasmid.interrupts import handled_signals
from phasmid.recording.file import check_place

LONGEST_CLOSE = 3.0
"""Longest time in which the robot closes, unless it compiles [s]."""

LEAST_ROOM = 120e6
"""Least room on the disk of recordings: one of a minute, 2 kB a millisecond [bytes]."""

FIRST_RUN = "run-000"
"""Name as long as those of recordings."""

OPTIONS = {
    "--out DIR": ("where runs are kept; default: results", "results"),
    "--port N": Number(
        "of the page; default: 8033, or the next that is free", 0, 65535, is_whole=True, hint="8033"
    ),
    "--host NAME": (
        "where it listens; default: 127.0.0.1, which only this machine reaches",
        "127.0.0.1",
    ),
    "--no-open": "open no browser, only print the address",
    "--debug": "log errors with their tracebacks",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.set_defaults(quiet=False)
    scenario_options(parser)


def run(options: argparse.Namespace) -> int:
    """Show the page until Ctrl-C; return the exit status."""
    scenario = scenario_of(options)
    check_place(Path(options.out) / FIRST_RUN, room=LEAST_ROOM)
    try:
        from phasmid.studio.guard import is_loopback
        from phasmid.studio.server import Server, listen
    except ModuleNotFoundError:
        raise InvalidInput(
            "the live page needs the extra studio, which is not installed.",
            hint=install_hint("studio"),
        ) from None
    from phasmid.studio.live_simulation import LiveSimulation

    log = logging.getLogger("phasmid.studio")
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("phasmid: %(message)s"))
    log.handlers, log.propagate = [handler], False
    log.setLevel(logging.DEBUG if options.debug else logging.WARNING)
    with listen(options.host, options.port) as listening:
        if not is_loopback(options.host):
            note = f"others on the network can reach {options.host}; the address lets them drive"
            say(f"phasmid: note: {plain(note)}.", file=sys.stderr)
        server = Server(listening, host=options.host)
        # From here to the end no signal raises: all that was begun is put away.
        with handled_signals(lambda *_: server.stop()):
            simulation = LiveSimulation(scenario, out=Path(options.out), publish=server.publish)
            try:
                announce_compilation()
                simulation.start()
                server.run(simulation, lambda: _show(server.address, options))
            finally:
                has_ended = simulation.close(LONGEST_CLOSE)
    if not has_ended:
        # It compiles.
        raise KeyboardInterrupt
    say("phasmid: the studio is closed.")
    return 0


def _show(address: str, options: argparse.Namespace) -> None:
    """Print the address and open it, where a browser can open a window."""
    say(f"The robot is at {plain(address)}\nCtrl-C ends it.")
    if not options.no_open and has_display():
        # Some browsers are waited for until they have started.
        Thread(target=webbrowser.open, args=(address,), daemon=True).start()
