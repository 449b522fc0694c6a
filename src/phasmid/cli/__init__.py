"""The command ``phasmid``: arguments in, the same verbs out, exit statuses.

Statuses: 0 done; 1 a check failed, or output impossible; 2 bad input or usage; 3 the run ended
early (fell, diverged); 70 our own mistake; 130 interrupted.
"""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from phasmid.cli.parser import COMMANDS, build_parser, flags, join_negative_numbers
from phasmid.errors import InvalidInput, PhasmidError, nearest


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: Arguments; those of the process where None.

    Returns:
        The exit status.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            # An old terminal's encoding shall not turn a degree sign into a crash.
            stream.reconfigure(errors="replace")
    interrupted: list[int] = []
    try:
        with _noticed_interrupts(interrupted):
            return _run(arguments)
    except PhasmidError as error:
        print(f"phasmid: {error}", file=sys.stderr)
        return error.exit_status
    except KeyboardInterrupt:
        print("phasmid: stopped.", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # Whoever read our output has gone; the interpreter must not flush into the pipe again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception:
        if interrupted:
            print("phasmid: stopped.", file=sys.stderr)
            return 130
        traceback.print_exc()
        print(
            "phasmid: this is a mistake of phasmid, not yours; please report it.", file=sys.stderr
        )
        return 70


@contextmanager
def _noticed_interrupts(noticed: list[int]) -> Iterator[None]:
    """Note each Ctrl-C before it raises: an interrupted import may end as an ImportError."""

    def handle(number: int, frame: Any) -> None:
        noticed.append(number)
        signal.default_int_handler(number, frame)

    try:
        before = signal.signal(signal.SIGINT, handle)
    except ValueError:
        # Only the main thread may do so; elsewhere no Ctrl-C arrives.
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _run(arguments: list[str]) -> int:
    command = next((a for a in arguments if not a.startswith("-")), None)
    if command is not None and arguments[0] == command and command not in COMMANDS:
        guess = nearest(command, COMMANDS)
        hint = f"phasmid {guess}" if guess else f"phasmid {' or phasmid '.join(COMMANDS)}"
        raise InvalidInput(f'no command "{command}".', hint=hint)
    parser = build_parser(command)
    options, unknown = parser.parse_known_args(join_negative_numbers(arguments))
    if unknown:
        known = [flag for flag in flags(parser) if flag.startswith("--")]
        guess = nearest(unknown[0].split("=")[0], known)
        kind = "option" if unknown[0].startswith("-") else "argument"
        raise InvalidInput(
            f'no {kind} "{unknown[0]}".',
            hint=guess if guess and guess != unknown[0] else f"phasmid {command or ''} --help",
        )
    if options.command is None:
        parser.print_help()
        return 0
    return int(options.run(options))
