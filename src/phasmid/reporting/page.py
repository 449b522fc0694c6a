"""Scripts that write a page of the documentation."""

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
    """Run such a script; the exit status is 1 where the page cannot be written.

    Args:
        write: Writes the page to a path.
        module: As which the script is run.
        description: What it does.
        default: Path of the page.
        arguments: Of the command line; those of the process where None.
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
