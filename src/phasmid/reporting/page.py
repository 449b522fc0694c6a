"""Command line of the scripts that write a page of the documentation."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from phasmid.errors import OutputError, PhasmidError


def write_page(
    write: Callable[[Path], object],
    *,
    module: str,
    description: str,
    default: str,
    arguments: Sequence[str] | None = None,
) -> int:
    """Write a page, and return the exit status: 1 where it cannot be written.

    Args:
        write: Function that writes the page to a path.
        module: Module of the script.
        description: Its help text.
        default: Default path of the page.
        arguments: Arguments of the command line; by default those of the process.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {module}", description=description)
    parser.add_argument("path", nargs="?", default=default, help="default: %(default)s")
    path = Path(parser.parse_args(arguments).path)
    try:
        try:
            write(path)
        except OSError as error:
            raise OutputError(
                f"{path} cannot be written: {error.strerror or error}.",
                hint="run it in the folder that holds docs",
            ) from None
    except PhasmidError as error:
        sys.stderr.write(f"phasmid: {error}\n")
        return error.exit_status
    return 0
