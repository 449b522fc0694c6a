"""``phasmid cad``: a robot as solids and meshes."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from phasmid.cli.output import say
from phasmid.errors import plain

OPTIONS = {
    "ROBOT": "a robot file or preset",
    "--out DIR": "where the files go; default: results/ROBOT",
    "--force": "replace files of an earlier run",
    "--quiet": "print only errors",
}


def run(options: argparse.Namespace) -> int:
    """Write the solids of a robot, and return the exit status."""
    from phasmid.formats import load_robot
    from phasmid.formats.robots import write_files
    from phasmid.formats.solids.assembly import build123d
    from phasmid.formats.step_out import cad_files

    begin = time.perf_counter()
    robot = load_robot(options.robot)
    build123d()
    folder = Path(options.out or Path("results") / Path(options.robot).stem)
    files = cad_files(robot, folder)
    write_files({path: content for path, (_, content) in files.items()}, force=options.force)
    if not options.quiet:
        say(f"Written to {plain(str(folder))} in {time.perf_counter() - begin:.1f} s:")
        for path, (what, _) in files.items():
            say(f"  {plain(str(path.relative_to(folder))):<28} {what}")
    return 0
