"""Time of the page, folder and film of the paper's run, and size of the page.

Times of parts are the processor's, which a busy neighbour disturbs less than the clock's; the first
round also imports what draws.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from phasmid import (
    load_scenario,
    plan,
    report,
    save_recording,
    save_video,
    simulate,
    summarise,
)
from phasmid.reporting import walk_picture
from phasmid.reporting.catalogue import report_figures
from phasmid.reporting.style import encoded_figure
from phasmid.reporting.webpage import page_html

ROUNDS = 3
LARGEST, LONGEST = 5e6, 6.0
"""The goals for the page of the paper's run: bytes, and seconds with nothing else to do."""


def main() -> None:
    scenario = load_scenario("paper")
    recording = simulate(scenario, plan(scenario))
    rounds = [page_of(recording) for _ in range(ROUNDS)]
    print(f"{'processor time [s]':36}{'first':>8}{'least':>8}")
    for what in rounds[0][1]:
        print_times(what, [times[what] for _, times in rounds])
    print_times("all of the page", [sum(times.values()) for _, times in rounds])
    size = len(rounds[0][0].encode())
    print(f"the page: {size / 1e6:.2f} MB; the goals are {LARGEST / 1e6:g} MB and {LONGEST:g} s\n")
    print(f"{'clock [s]':36}{'first':>8}{'least':>8}")
    with TemporaryDirectory() as folder:
        file, run = Path(folder) / "paper.nc", Path(folder) / "run"
        save_recording(recording, file)
        command = [sys.executable, "-m", "phasmid", "report", str(file), "--force", "--quiet"]
        jobs: dict[str, Callable[[], object]] = {
            "report(), the whole folder": lambda: report(recording, run, force=True),
            "phasmid report FILE.nc": lambda: subprocess.run(
                [*command, "--out", str(run)], check=True
            ),
        }
        for what, job in jobs.items():
            print_times(what, [timed(job, time.perf_counter)[1] for _ in range(ROUNDS)])
        film = Path(folder) / "walk.mp4"
        spent = timed(lambda: save_video(recording, film), time.process_time)[1]
        print(f"10 s as MP4, 1280 x 720, 300 frames: {spent:.1f} s of processor time")


def print_times(what: str, spent: list[float]) -> None:
    """Print the first and the least of some times [s]."""
    print(f"{what:36}{spent[0]:8.2f}{min(spent):8.2f}")


def timed(work: Callable[[], Any], clock: Callable[[], float]) -> tuple[Any, float]:
    """Return the result of some work, and its time [s]."""
    begin = clock()
    return work(), clock() - begin


def page_of(recording) -> tuple[str, dict[str, float]]:
    """Return the page, and the processor time of each of its parts [s]."""
    times: dict[str, float] = {}

    def part(what: str, work: Callable[[], Any]) -> Any:
        made, times[what] = timed(work, time.process_time)
        return made

    def figures() -> list[tuple[str, str, bytes]]:
        return [
            (name, kind.sentence, encoded_figure(figure, "svg"))
            for name, kind, figure in report_figures(recording)
            if kind.in_page
        ]

    summary = part("summary", lambda: summarise(recording))
    pictures = part("figures", figures)
    still = part("picture of the robot", lambda: encoded_figure(walk_picture(recording), "png"))
    page = part("replay, data and HTML", lambda: page_html(recording, summary, pictures, still))
    return page, times


if __name__ == "__main__":
    main()
