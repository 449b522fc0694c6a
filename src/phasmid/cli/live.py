"""Options of the live view in Foxglove, and the server of a run."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from phasmid.cli.options import Number, declare, refuse_given
from phasmid.cli.output import say
from phasmid.errors import plain

if TYPE_CHECKING:
    from phasmid.hardware import Driver
    from phasmid.live import LiveServer
    from phasmid.simulation import Run

PORT = 8765
"""Port on which Foxglove looks for a server."""

_PORT = Number("", 0, 65535, is_whole=True, hint="8765")


def add_live_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of a live view."""
    group = parser.add_argument_group("live view in Foxglove (extra live)")
    group.add_argument(
        "--live",
        nargs="?",
        const=PORT,
        type=lambda text: _PORT.convert("--live", text),
        metavar="PORT",
        help=f"show the run in Foxglove while it goes on, in real time; default port: {PORT}",
    )
    declare(
        group,
        {
            "--live-host NAME": "where it listens; default: 127.0.0.1, which only this machine "
            "reaches",
            "--live-pace N": Number(
                "most simulated seconds per second; default: 1", 0.01, 1000, hint="0.25"
            ),
        },
    )


def check_live(options: argparse.Namespace) -> None:
    """Refuse a live view without its packages, before the run is prepared."""
    if options.live is None:
        refuse_given(options, ("live_host", "live_pace"), "needs --live")
    else:
        import phasmid.live  # noqa: F401


@contextmanager
def served(run: Run, options: argparse.Namespace) -> Iterator[None]:
    """Serve the run while the body makes it, if the options ask for it."""
    if options.live is None:
        yield
        return
    from phasmid.live import serve

    with serve(
        run, host=_host(options), port=options.live, pace=options.live_pace or 1.0
    ) as server:
        _announce(server, options)
        yield


@contextmanager
def served_driver(driver: Driver, options: argparse.Namespace) -> Iterator[None]:
    """Serve a robot on a bus while the body drives it, if the options ask for it."""
    if options.live is None:
        yield
        return
    from phasmid.hardware.live_view import serve_driver

    with serve_driver(driver, host=_host(options), port=options.live) as server:
        _announce(server, options)
        yield


def _announce(server: LiveServer, options: argparse.Namespace) -> None:
    """Print where the server listens."""
    if options.quiet:
        return
    say(
        f"phasmid: live at {plain(server.address)}; in Foxglove choose Open connection, Foxglove "
        "WebSocket.",
        file=sys.stderr,
    )
    if _host(options) not in ("127.0.0.1", "localhost", "::1"):
        note = "others on the network can watch the run and send velocity commands"
        say(f"phasmid: note: {note}.", file=sys.stderr)


def _host(options: argparse.Namespace) -> str:
    """Return where the server listens."""
    return options.live_host or "127.0.0.1"
