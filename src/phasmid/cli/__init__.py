"""The command ``phasmid``, its messages and exit statuses.

Statuses: 0 done; 1 a check failed, or output impossible; 2 bad input or usage; 3 the run ended
early (fell, diverged) or missed a waypoint; 70 internal error; 130 stopped by a signal: Ctrl-C,
SIGTERM or a closed terminal. A signal that arrived gives 130 also where a library swallowed its
exception, whatever was completed; `UNTIL_STOPPED` names the exceptions.
"""

from __future__ import annotations

import errno
import os
import re
import sys
import threading
import traceback
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from pathlib import Path

from phasmid.cli import scenario_options
from phasmid.cli.output import say
from phasmid.cli.parser import COMMANDS, REMOVED, build_parser, flags
from phasmid.cli.remedies import typed
from phasmid.errors import AlreadyExists, InvalidInput, PhasmidError, nearest
from phasmid.interrupts import StopSignals

UNTIL_STOPPED = "bus", "studio"
"""Commands that go on until a signal ends them, with a status of their own."""

UNHEARD = {errno.EPIPE, errno.ENOSPC, errno.EIO, errno.EBADF, errno.EFBIG}
"""Errors of a stream that cannot be written; errors of files have a file name."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: Arguments; those of the process where None.

    Returns:
        The exit status.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    signals = StopSignals()
    # Only the main thread can handle signals, and only it receives them.
    is_main = threading.current_thread() is threading.main_thread()
    with signals if is_main else nullcontext():
        status = None
        try:
            status = _status(arguments, signals)
            signals.held = 1
        except KeyboardInterrupt:
            # It arrived outside of the handlers of the command.
            signals.held = 1
        goes_on = arguments[:1] in ([command] for command in UNTIL_STOPPED)
        if status is None or (signals.noticed and status != 130 and not goes_on):
            status = _stopped()
    if argv is None and (status == 130 or arguments[:1] == ["studio"]):
        # An interrupted command ends at once, without the interpreter's cleanup.
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)
    return status


def _stopped(text: str = "") -> int:
    """Report that a signal ended the command, with what is kept, and return its status."""
    with suppress(OSError, ValueError):
        # The terminal may be closed.
        say(f"phasmid: {text or 'stopped.'}", file=sys.stderr)
    return 130


def _status(arguments: list[str], signals: StopSignals) -> int:
    """Run the command, print errors in one sentence, and return the exit status."""
    _prepare_streams()
    try:
        try:
            return _run(arguments)
        except SystemExit as stopped:
            # Rich exits with 1 where the reader of a pipe has gone.
            if stopped.code == 1:
                raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE)) from None
            raise
        except (Exception, KeyboardInterrupt) as error:
            return _report(error, arguments, signals)
        finally:
            # Report a failing stream now, and not at the interpreter's exit.
            sys.stdout.flush()
    except OSError as error:
        # The status of a signal is set by the caller.
        return 1 if signals.noticed else _unheard(error)


def _prepare_streams() -> None:
    """Replace closed streams, and let a terminal without Unicode or of no width not fail."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115
        stream = getattr(sys, name)
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    if not re.fullmatch("[1-9][0-9]{0,5}", os.environ.get("COLUMNS", "80")):
        # Rich fails on a width of 0 and on digits that int() does not read.
        del os.environ["COLUMNS"]


def _report(error: BaseException, arguments: list[str], signals: StopSignals) -> int:
    """Print an error of a command, and return its status; errors of streams are raised."""
    is_interrupt = isinstance(error, KeyboardInterrupt)
    if signals.noticed or is_interrupt:
        # An interrupted import may end as an ImportError.
        signals.error = error
        return _stopped(str(error) if is_interrupt else "")
    if isinstance(error, PhasmidError):
        if isinstance(error, AlreadyExists):
            error.hint = f"--force, or another {error.option}"
        else:
            error.hint = typed(error.hint, arguments, error.where)
        say(f"phasmid: {error}", file=sys.stderr)
        return error.exit_status
    if isinstance(error, OSError) and error.errno in UNHEARD and error.filename is None:
        raise error
    traceback.print_exception(error)
    say("phasmid: internal error; please report it.", file=sys.stderr)
    return 70


def _unheard(error: OSError) -> int:
    """Report that the output cannot be written, discard the rest, and return the status."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    with suppress(OSError):
        reason = (error.strerror or str(error)).lower()
        say(f"phasmid: cannot write the output: {reason}.", file=sys.stderr)
        return 1
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())
    return 1


REMOVED_OPTIONS = {"report --list": "--list-figures", "advise --figure": "--out"}
"""Options of earlier versions, and those in their place."""


def _run(arguments: list[str]) -> int:
    command = next((a for a in arguments if not a.startswith("-")), None)
    if command is not None and arguments[0] == command and command not in COMMANDS:
        guess = REMOVED.get(command) or nearest(command, COMMANDS)
        raise InvalidInput(f'no command "{command}".', hint=f"phasmid {guess or '--help'}")
    parser = build_parser(command)
    if command in scenario_options.COMMANDS:
        scenario_options.check_lists(arguments)
    options, unknown = parser.parse_known_args(arguments)
    if unknown:
        name = unknown[0].split("=")[0]
        known = [flag for flag in flags(parser) if flag.startswith("--")]
        guess = REMOVED_OPTIONS.get(f"{command} {name}") or nearest(name, known)
        kind = "option" if name.startswith("-") else "argument"
        raise InvalidInput(
            f'no {kind} "{unknown[0]}".',
            hint=guess if guess and guess != unknown[0] else f"phasmid {command or ''} --help",
        )
    if options.command is None:
        parser.print_help()
        return 0
    return int(options.run(options))
