"""How long the page of the paper's run takes, and how large it is.

Times are the processor's, which a busy neighbour disturbs less than the clock's; the first round
also imports what draws.
"""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from phasmid import load_scenario, plan, report, simulate, summarise
from phasmid.reporting.catalogue import drawn
from phasmid.reporting.drawing import walk_picture
from phasmid.reporting.style import encoded_figure, uncollected
from phasmid.reporting.webpage import Picture, web_page

ROUNDS = 3
LARGEST, LONGEST = 5e6, 3.0
"""The goals for the page of the paper's run: bytes, and seconds of a machine with nothing else."""


def main() -> None:
    scenario = load_scenario("paper")
    recording = simulate(scenario, plan(scenario))
    rounds = []
    for _ in range(ROUNDS):
        with uncollected():
            rounds.append(page_of(recording))
    print(f"{'processor time [s]':28}{'first':>8}{'least':>8}")
    for what in rounds[0][1]:
        spent = [times[what] for _, times in rounds]
        print(f"{what:28}{spent[0]:8.2f}{min(spent):8.2f}")
    whole = min(sum(times.values()) for _, times in rounds)
    size = len(rounds[0][0])
    print(f"{'all of the page':28}{sum(rounds[0][1].values()):8.2f}{whole:8.2f}")
    print(f"the page: {size / 1e6:.2f} MB; the goals are {LARGEST / 1e6:g} MB and {LONGEST:g} s")
    with TemporaryDirectory() as folder:
        begin, clock = time.process_time(), time.perf_counter()
        report(recording, Path(folder) / "run")
        spent, passed = time.process_time() - begin, time.perf_counter() - clock
    print(f"the run's whole folder: {spent:.2f} s of the processor, {passed:.2f} s by the clock")


def page_of(recording) -> tuple[bytes, dict[str, float]]:
    """The page, and what each of its parts took [s]."""
    times: dict[str, float] = {}

    def timed(what, work):
        begin = time.process_time()
        made = work()
        times[what] = time.process_time() - begin
        return made

    def figures():
        return [
            Picture(name, kind.sentence, encoded_figure(figure, "svg"))
            for name, kind, figure in drawn(recording)
            if kind.in_page
        ]

    summary = timed("summary", lambda: summarise(recording))
    pictures = timed("figures, as SVG", figures)
    still = timed("picture of the robot", lambda: encoded_figure(walk_picture(recording), "png"))
    page = timed(
        "replay, data and HTML", lambda: web_page(recording, summary, pictures, still=still)
    )
    return page.encode(), times


if __name__ == "__main__":
    main()
