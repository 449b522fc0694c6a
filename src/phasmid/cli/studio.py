"""``phasmid studio``: the live page, on which a robot walks and is driven."""

from __future__ import annotations

import argparse
import asyncio
import logging
import os
import signal
import sys
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from phasmid.cli.compiling import announce_compilation
from phasmid.cli.scenario_options import (
    add_field_options,
    add_scenario_option,
    number_or_text,
    scenario_of,
)
from phasmid.errors import InvalidInput, plain

if TYPE_CHECKING:
    from phasmid.studio.server import Server
    from phasmid.studio.stage import Stage

LONGEST_CLOSE = 3.0
"""Time that a robot may take to be put away [s]."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Give a parser the scenario, its fields and where the page is."""
    add_scenario_option(parser)
    parser.add_argument(
        "--out", metavar="DIR", default="results", help="where runs are kept; default: results"
    )
    parser.add_argument(
        "--port", metavar="N", help="of the page; default: 8033, or the next that is free"
    )
    parser.add_argument(
        "--host",
        metavar="NAME",
        default="127.0.0.1",
        help="where it listens; default: 127.0.0.1, which only this machine reaches",
    )
    parser.add_argument(
        "--no-open", action="store_true", help="open no browser, only print the address"
    )
    parser.add_argument("--debug", action="store_true", help="tell more of what goes wrong")
    parser.set_defaults(quiet=False)
    add_field_options(parser)


def run(options: argparse.Namespace) -> int:
    """Show the page until Ctrl-C; returns the exit status."""
    port = _port(options.port)
    scenario = scenario_of(options)
    from phasmid.studio.assets import assets
    from phasmid.studio.server import Server, is_loopback, listen
    from phasmid.studio.stage import Stage

    _tell_log(debug=options.debug)
    with listen(options.host, port) as listening:
        if not is_loopback(options.host):
            told = f"others on the network can reach {options.host}; the address lets them drive"
            print(f"phasmid: note: {plain(told)}.", file=sys.stderr)
        server = Server(listening, assets(), host=options.host)
        stage = Stage(scenario, out=Path(options.out), publish=server.publish)
        announce_compilation()
        with _ended_by_signals(server):
            stage.start()
            try:
                asyncio.run(server.serve(stage, lambda: _show(server.address, options)))
            finally:
                _put_away(stage)
    print("phasmid: the studio is closed.")
    return 0


def _show(address: str, options: argparse.Namespace) -> None:
    """Tell the address, and open it."""
    print(f"The robot is at {plain(address)}\nCtrl-C ends it.", flush=True)
    if not options.no_open and has_display():
        # Some browsers are waited for until they have started.
        Thread(target=webbrowser.open, args=(address,), daemon=True).start()


def has_display() -> bool:
    """Whether a browser can open a window; one that opens in the terminal cannot show the page."""
    if sys.platform in ("darwin", "win32"):
        return True
    return any(os.environ.get(key) for key in ("DISPLAY", "WAYLAND_DISPLAY"))


def _put_away(stage: Stage) -> None:
    """Close the stage; one that compiles hears of it only when it is done, and is not waited for.

    Raises:
        KeyboardInterrupt: The command is to end as one that was interrupted.
    """
    closing = Thread(target=stage.close, daemon=True)
    closing.start()
    closing.join(LONGEST_CLOSE)
    if closing.is_alive():
        raise KeyboardInterrupt


def _port(text: str | None) -> int | None:
    if text is None:
        return None
    value = number_or_text(text)
    if not isinstance(value, int) or not 0 <= value <= 65535:
        raise InvalidInput(
            f'--port is "{text}"; it must be a whole number 0 to 65535.', hint="--port 8033"
        )
    return value


def _tell_log(*, debug: bool) -> None:
    """Let the log go to the terminal, in the house's form."""
    log = logging.getLogger("phasmid.studio")
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("phasmid: %(message)s"))
    log.handlers = [handler]
    log.propagate = False
    log.setLevel(logging.DEBUG if debug else logging.WARNING)


@contextmanager
def _ended_by_signals(server: Server) -> Iterator[None]:
    """Let Ctrl-C, or whoever ends the process, close the page; a second Ctrl-C ends at once."""
    before: dict[signal.Signals, Any] = {}

    def close(*_: Any) -> None:
        signal.signal(signal.SIGINT, before[signal.SIGINT])
        server.stop()

    for one in (signal.SIGINT, signal.SIGTERM):
        before[one] = signal.signal(one, close)
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
