"""Reads damaged files, each in a child process with limits, and counts how it ends.

A reader must return or raise a PhasmidError, within 2 s of processor time and 500 MB beyond what
the program itself takes. In the folder ``tests``: ``python -m formats.fuzz.run --files 100``.
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import sys
import tempfile
import traceback
import warnings
from dataclasses import dataclass, field
from pathlib import Path

from formats.fuzz.damage import damaged
from formats.fuzz.targets import Target, targets
from phasmid.errors import PhasmidError

MOST_SECONDS = 2.0
MOST_BYTES = 500_000_000

_READ, _REFUSED, _BROKEN, _MEMORY = 0, 3, 4, 5
_PATIENCE = 60
"""Wall-clock seconds after which a child is ended [s]."""


@dataclass
class Tally:
    """How the files of one reader ended.

    Attributes:
        read: Files that were read all the same.
        refused: Files that got a sentence.
        broken: What went wrong with the others.
        seconds: Longest processor time [s].
        bytes: Largest growth of resident memory [bytes].
    """

    read: int = 0
    refused: int = 0
    broken: list[str] = field(default_factory=list)
    seconds: float = 0.0
    bytes: int = 0


def fuzz(name: str, target: Target, files: int, seed: int, keep: Path) -> Tally:
    """Damage files and read them.

    Args:
        name: Of the reader.
        target: The reader.
        files: How many.
        seed: Of the first; the others count on from it.
        keep: Folder for files that break the reader.
    """
    tally = Tally()
    with tempfile.TemporaryDirectory() as folder:
        for file, content in target.beside.items():
            (Path(folder) / file).parent.mkdir(exist_ok=True)
            (Path(folder) / file).write_bytes(content)
        path = Path(folder) / f"robot{target.ending}"
        for whole in target.whole:
            path.write_bytes(whole)
            # Whole files are read, and what is imported late is then in memory before the forks.
            target.load(path)
        for number in range(seed, seed + files):
            content = damaged(target.whole[number % len(target.whole)], number)
            path.write_bytes(content)
            why = _one(target, path, tally)
            if why:
                keep.mkdir(parents=True, exist_ok=True)
                kept = keep / f"{name}-{number}{target.ending}"
                kept.write_bytes(content)
                tally.broken.append(f"{kept}: {why}")
    return tally


def _one(target: Target, path: Path, tally: Tally) -> str:
    """Read one file in a child; why that went wrong, or nothing."""
    told, tell = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(told)
        os._exit(_child(target, path, tell))
    os.close(tell)
    with os.fdopen(told, "rb") as pipe:
        before = int.from_bytes(pipe.read(8), "little")
        words = pipe.read().decode("utf-8", "replace")
    _, status, usage = os.wait4(child, 0)
    seconds = usage.ru_utime + usage.ru_stime
    # Linux counts in units of 1024 bytes.
    grown = max(0, 1024 * usage.ru_maxrss - before)
    tally.seconds, tally.bytes = max(tally.seconds, seconds), max(tally.bytes, grown)
    if os.WIFSIGNALED(status):
        return f"ended by {signal.Signals(os.WTERMSIG(status)).name}"
    code = os.WEXITSTATUS(status)
    if code in {_BROKEN, _MEMORY}:
        return words
    if seconds > MOST_SECONDS:
        return f"took {seconds:.1f} s of processor time"
    if grown > MOST_BYTES:
        return f"took {grown / 1e6:.0f} MB"
    tally.read += code == _READ
    tally.refused += code == _REFUSED
    return ""


def _child(target: Target, path: Path, tell: int) -> int:
    pages = map(int, Path("/proc/self/statm").read_text().split())
    size, resident = (next(pages) * resource.getpagesize() for _ in range(2))
    # What the child begins with, which is its parent's, is not the reader's.
    os.write(tell, resident.to_bytes(8, "little"))
    most = size + MOST_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    signal.alarm(_PATIENCE)
    try:
        # A warning would reach the user as well.
        warnings.simplefilter("error")
        target.load(path)
    except PhasmidError as error:
        text = str(error)
        if not error.what or len(text) > 2000 or not text.replace("\n", "").isprintable():
            os.write(tell, f"not a sentence: {text[:500]!r}".encode())
            return _BROKEN
        return _REFUSED
    except MemoryError:
        os.write(tell, b"asked for more than 500 MB: " + traceback.format_exc()[-600:].encode())
        return _MEMORY
    except BaseException:
        os.write(tell, traceback.format_exc()[-1500:].encode("utf-8", "replace"))
        return _BROKEN
    return _READ


def main() -> int:
    """Fuzz the named readers, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    known = targets()
    parser.add_argument("readers", nargs="*", metavar="READER", help=", ".join(known))
    parser.add_argument("--files", type=int, default=2000, help="damaged files per reader")
    parser.add_argument("--seed", type=int, default=1, help="of the first file")
    parser.add_argument("--keep", type=Path, default=Path("results/fuzz"))
    options = parser.parse_args()
    unknown = set(options.readers) - set(known)
    if unknown:
        parser.error(f"unknown reader {min(unknown)}; readers are {', '.join(known)}")
    broken: list[str] = []
    print("reader    read  refused  broken  longest s  most MB", flush=True)
    for name in options.readers or known:
        tally = fuzz(name, known[name], options.files, options.seed, options.keep)
        broken += tally.broken
        print(
            f"{name:8} {tally.read:5} {tally.refused:8} {len(tally.broken):7}"
            f" {tally.seconds:10.2f} {tally.bytes / 1e6:8.0f}",
            flush=True,
        )
    for words in broken[:20]:
        print(f"\n{words}")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
