"""``phasmid study``: make the runs of a study, one row of numbers for each."""

from __future__ import annotations

import argparse
import re
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from phasmid.cli.options import Number, refuse_given
from phasmid.cli.output import print_table, say
from phasmid.cli.progress import progress_bar
from phasmid.errors import InvalidInput, plain

if TYPE_CHECKING:
    import pandas as pd

    from phasmid.studies import StudyResults

LINE_EVERY = 60.0
"""Time between two lines of progress without a terminal [s]."""

MOST_POINTS, MOST_CAUSES = 10, 3
"""Points of a search, and causes of failures, that are printed."""

OPTIONS = {
    "FILE": "a study (.toml)",
    "--out DIR": "folder of the study; default: results/NAME",
    "--workers N": Number("number of processes; default: one per core", 1, 999_999, is_whole=True),
    "--max-failures N": Number(
        "stop after more failed runs; default: never", 0, 999_999, is_whole=True
    ),
    "--part K/N": "make the K-th of N parts of the runs, for several machines with one --out",
    "--only N": Number(
        "make run number N again, compare it with its row, and write its report",
        0,
        9_999_999,
        is_whole=True,
    ),
    "--force": "delete the rows of another study of this name",
    "--quiet": "print only errors",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--retry", choices=("failed",), help="also make the runs again that failed before"
    )
    parser.add_argument(
        "--ray",
        nargs="?",
        const="local",
        metavar="ADDRESS",
        help="make the runs on a Ray cluster, or on a local Ray without an address (extra ray)",
    )


def run(options: argparse.Namespace) -> int:
    """Make the missing runs, and return the exit status: 1 where all runs failed."""
    from phasmid.studies.results import DamagedPart

    with warnings.catch_warnings():
        show = warnings.showwarning

        def print_damage(message: Warning | str, *place: Any, **more: Any) -> None:
            if isinstance(message, DamagedPart):
                say(f"phasmid: {message}", file=sys.stderr)
            else:
                show(message, *place, **more)

        warnings.simplefilter("always", DamagedPart)
        warnings.showwarning = print_damage
        if options.only is not None:
            return _repeat(options, options.only)
        return _make(options)


def _make(options: argparse.Namespace) -> int:
    """Make the missing runs, and return the exit status."""
    from phasmid.studies import study
    from phasmid.studies.results import causes

    with progress_bar("studying", quiet=options.quiet) as progress:
        try:
            results = study(
                options.file,
                out=options.out,
                workers=options.workers,
                retry_failed=options.retry == "failed",
                max_failures=options.max_failures,
                ray=options.ray,
                part=_part(options.part),
                force=options.force,
                progress=_shown(progress, quiet=options.quiet),
            )
        except KeyboardInterrupt as stop:
            raise KeyboardInterrupt(
                "stopped; rows of completed runs are kept.\n"
                f"  try  phasmid study {plain(options.file)}, which makes the others"
            ) from stop
    table = results.table
    failed = table[table["status"] == "failed"]
    if not options.quiet:
        _print_metrics(results.table, [metric.name for metric in results.study.metrics])
        if results.study.search is not None:
            _print_best(results)
        folder = plain(str(results.folder))
        total = results.study.count()
        page = "study.html, " if len(table) == total else ""
        many = f"{len(table)} runs" if page else f"{len(table)} of {total} runs"
        say(f"\n{many}, {len(failed)} failed. Written to {folder}: {page}parts/")
    for count, first in causes(failed)[:MOST_CAUSES]:
        error = plain(str(first["error"]))
        say(f"phasmid: failed: {count}, such as run {first['number']}: {error}", file=sys.stderr)
    return 1 if len(failed) == len(table) else 0


def _shown(bar: Callable[..., None] | None, *, quiet: bool) -> Callable[[int, int, int], None]:
    """Return what shows runs done, rate and failures: in a bar, or else in a line each minute."""
    begin = next_line = time.monotonic()
    first = -1

    def show(done: int, total: int, failures: int) -> None:
        nonlocal first, next_line
        now = time.monotonic()
        # Rows of an earlier call are done at once.
        first = done if first < 0 else first
        rate = (done - first) / max(now - begin, 1e-9)
        failed = f", {failures} failed" if failures else ""
        note = f"{done} of {total}, {rate:.3g}/s{failed}"
        if bar is not None:
            bar(done, total=total, note=f" {note}")
        elif now > next_line + LINE_EVERY and not quiet:
            next_line = now
            left = f", {(total - done) / rate / 60:.0f} min left" if rate else ""
            say(f"phasmid: {note}{left}", file=sys.stderr)

    return show


def _repeat(options: argparse.Namespace, number: int) -> int:
    """Make one run again, and return the exit status: 1 where it differs from its row."""
    from phasmid.reporting import check_folder, report
    from phasmid.studies import load_study_file, repeat_run

    idle = ("workers", "max_failures", "part", "retry", "ray")
    refuse_given(options, idle, "does nothing with --only, which makes one run")
    study, _ = load_study_file(options.file)
    folder = Path(options.out or Path("results") / study.name) / "runs" / str(number)
    check_folder(folder, force=options.force)
    recording, different = repeat_run(options.file, number, out=options.out)
    report(recording, folder, force=options.force)
    if different:
        say(f"different: {plain(', '.join(different))}.")
    elif not options.quiet:
        say("equal: every metric is that of its row, to the last bit.")
    if not options.quiet:
        say(f"Written to {plain(str(folder))}: report.html, recording.nc, figures/")
    return 1 if different else 0


def _print_metrics(table: pd.DataFrame, metrics: list[str]) -> None:
    """Print least, mean and largest value of each metric, and how the runs ended."""
    rows = [["", "least", "mean", "largest"]]
    for name in metrics:
        values = table[name]
        rows.append(
            [plain(name), *(f"{x:.5g}" for x in (values.min(), values.mean(), values.max()))]
        )
    print_table(rows, right=(1, 2, 3))
    endings = table.loc[table["ending"] != "", "ending"].value_counts()
    say(", ".join(f"{ending} {count}" for ending, count in endings.items()))


def _print_best(results: StudyResults) -> None:
    best = results.best
    say(f"\n{len(best)} points that no other surpasses in all objectives:")
    if len(best):
        for line in best.head(MOST_POINTS).to_string(index=False, float_format="%.5g").splitlines():
            say(plain(line))


def _part(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    if not re.fullmatch("[0-9]{1,6}/[0-9]{1,6}", text):
        raise InvalidInput(f'--part is "{text}"; it must be a part of several.', hint="--part 1/4")
    first, count = text.split("/")
    return int(first), int(count)
