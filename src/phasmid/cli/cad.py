"""``phasmid cad``: a robot as solids and meshes, with their masses."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from phasmid.errors import plain

OPTIONS = {
    "ROBOT": "a robot file or preset",
    "--out DIR": "where the files go; default: results/ROBOT",
    "--force": "replace files of an earlier run",
    "--quiet": "print only errors",
}


def run(options: argparse.Namespace) -> int:
    """Write the solids of a robot, and return the exit status."""
    from phasmid.cad.library import build123d
    from phasmid.formats import load_robot
    from phasmid.formats.step_out import write_solids

    def announce(what: str) -> None:
        if not options.quiet:
            print(f"… {what}", file=sys.stderr, flush=True)

    begin = time.perf_counter()
    robot = load_robot(options.robot)
    build123d()
    folder = Path(options.out or Path("results") / Path(options.robot).stem)
    files = write_solids(robot, folder, force=options.force, announce=announce)
    if not options.quiet:
        print(f"Written to {plain(str(folder))} in {time.perf_counter() - begin:.1f} s:")
        for path, what in files.items():
            print(f"  {plain(str(path.relative_to(folder))):<28} {what}")
    return 0
