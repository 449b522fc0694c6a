"""Reads damaged files: a reader must return or raise a PhasmidError, soon and with little memory.

A file that breaks a reader, or ends the process, is kept. In the folder ``tests``:
``python -m formats.fuzz.run --files 100``.
"""

from __future__ import annotations

import argparse
import resource
import signal
import sys
import time
import traceback
import warnings
from pathlib import Path

from formats.fuzz.damage import damaged
from formats.fuzz.targets import Target, targets
from phasmid.errors import PhasmidError

MOST_SECONDS = 2.0
"""Processor time of one file."""

MOST_BYTES = 500_000_000
"""Memory beyond what the program takes after it has read whole files."""


def fuzz(name: str, target: Target, files: int, seed: int, keep: Path) -> list[str]:
    """Damage files and read them; return what went wrong.

    Args:
        name: Of the reader.
        target: The reader.
        files: How many.
        seed: Of the first; the others count on from it.
        keep: Folder for the files; those that are read or refused well are deleted.
    """
    for file, content in target.beside.items():
        (keep / file).parent.mkdir(parents=True, exist_ok=True)
        (keep / file).write_bytes(content)
    for whole in target.whole:
        path = keep / f"{name}-whole{target.ending}"
        path.write_bytes(whole)
        # Whole files are read, and what is imported late is then in memory.
        target.load(path)
        path.unlink()
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + MOST_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))
    broken = []
    for number in range(seed, seed + files):
        path = keep / f"{name}-{number}{target.ending}"
        path.write_bytes(damaged(target.whole[number % len(target.whole)], number))
        # A reader that never ends is ended, and its file kept.
        signal.alarm(60)
        begin = time.process_time()
        why = _problem(target, path)
        seconds = time.process_time() - begin
        if seconds > MOST_SECONDS:
            why = why or f"took {seconds:.1f} s of processor time"
        if why:
            broken.append(f"{path}: {why}")
        else:
            path.unlink()
    signal.alarm(0)
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    return broken


def _problem(target: Target, path: Path) -> str:
    """Read one file; return what went wrong, or nothing."""
    try:
        # A warning would reach the user as well.
        warnings.simplefilter("error")
        target.load(path)
    except PhasmidError as error:
        text = str(error)
        sentence = error.what and len(text) < 2000 and text.replace("\n", "").isprintable()
        return "" if sentence else f"not a sentence: {text[:500]!r}"
    except Exception:
        return traceback.format_exc()[-1500:]
    return ""


def main() -> int:
    """Fuzz the named readers, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    known = targets()
    parser.add_argument("readers", nargs="*", metavar="READER", help=", ".join(known))
    parser.add_argument("--files", type=int, default=2000, help="damaged files per reader")
    parser.add_argument("--seed", type=int, default=1, help="of the first file")
    parser.add_argument("--keep", type=Path, default=Path("results/fuzz"))
    options = parser.parse_args()
    broken: list[str] = []
    for name in options.readers or known:
        found = fuzz(name, known[name], options.files, options.seed, options.keep)
        print(f"{name}: {options.files} files, {len(found)} broken", flush=True)
        broken += found
    print("\n\n".join(broken[:20]))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
