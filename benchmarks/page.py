"""How long the page of the paper's run and its whole folder take, and how large the page is.

Times of parts are the processor's, which a busy neighbour disturbs less than the clock's; the first
round also imports what draws. The clock is that of a user who waits, so that it means something on
a machine with nothing else to do.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from phasmid import load_scenario, plan, report, save_recording, simulate, summarise
from phasmid.cores import cores
from phasmid.reporting.companion import FREE, SWITCH, drawing, free_cores
from phasmid.reporting.gallery import WALK, File, Gallery
from phasmid.reporting.style import uncollected
from phasmid.reporting.webpage import Page, Picture

ROUNDS = 3
LARGEST, LONGEST = 5e6, 3.0
"""The goals for the page of the paper's run: bytes, and seconds of two cores with nothing else."""


def main() -> None:
    scenario = load_scenario("paper")
    recording = simulate(scenario, plan(scenario))
    rounds = []
    for _ in range(ROUNDS):
        with uncollected():
            rounds.append(page_of(recording))
    print(f"{'processor time [s]':36}{'first':>8}{'least':>8}")
    for what in rounds[0][1]:
        spent = [times[what] for _, times in rounds]
        print(f"{what:36}{spent[0]:8.2f}{min(spent):8.2f}")
    whole = min(sum(times.values()) for _, times in rounds)
    size = len(rounds[0][0])
    print(f"{'all of the page':36}{sum(rounds[0][1].values()):8.2f}{whole:8.2f}")
    print(f"the page: {size / 1e6:.2f} MB; the goals are {LARGEST / 1e6:g} MB and {LONGEST:g} s\n")
    told = f"cores: {cores()}, free in the last minute: {free_cores():.1f}"
    print(told if free_cores() >= FREE else f"{told}, so that one process draws")
    print(f"{'clock [s]':36}{'first':>8}{'least':>8}")
    with TemporaryDirectory() as folder:
        file, run = Path(folder) / "paper.nc", Path(folder) / "run"
        save_recording(recording, file)
        command = [sys.executable, "-m", "phasmid", "report", str(file), "--force", "--quiet"]
        jobs: dict[str, Callable[[], object]] = {
            "the page": lambda: page_beside(recording),
            "report(), the whole folder": lambda: report(recording, run, force=True),
            "phasmid report FILE.nc": lambda: subprocess.run(
                [*command, "--out", str(run)], check=True
            ),
        }
        for what, job in jobs.items():
            print_clock(what, job)
        os.environ[SWITCH] = "1"
        for what, job in jobs.items():
            print_clock(f"{what}, one process", job)


def print_clock(what: str, job: Callable[[], object]) -> None:
    """Print how long a job takes by the clock, at first and at the least.

    Args:
        what: It is called.
        job: What is done.
    """
    spent = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        job()
        spent.append(time.perf_counter() - begin)
    print(f"{what:36}{spent[0]:8.2f}{min(spent):8.2f}")


def page_beside(recording) -> str:
    """The page as `report` makes it, with a second process where there is a second core."""
    gallery = Gallery(recording)
    with uncollected(), drawing(gallery) as draw:
        page = Page(recording, summarise(recording))
        drawn = draw(gallery.of_page)
        return page.html(pictures(gallery, drawn), drawn[WALK])


def pictures(gallery: Gallery, drawn: Mapping[File, bytes]) -> list[Picture]:
    """The page's figures."""
    return [
        Picture(name, kind.sentence, drawn[name, "svg"])
        for name, kind in gallery.kinds.items()
        if kind.in_page
    ]


def page_of(recording) -> tuple[bytes, dict[str, float]]:
    """The page by one process, and what each of its parts took [s]."""
    times: dict[str, float] = {}
    gallery = Gallery(recording)

    def timed(what, work):
        begin = time.process_time()
        made = work()
        times[what] = time.process_time() - begin
        return made

    def draw(files):
        return {file: gallery.drawn(file) for file in files}

    summary = timed("summary", lambda: summarise(recording))
    drawn = timed("figures", lambda: draw(gallery.of_page[:-1]))
    still = timed("picture of the robot", lambda: gallery.drawn(WALK))
    page = timed(
        "replay, data and HTML",
        lambda: Page(recording, summary).html(pictures(gallery, drawn), still),
    )
    return page.encode(), times


if __name__ == "__main__":
    main()
