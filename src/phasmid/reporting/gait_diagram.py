"""Which foot is down when: as planned, and as seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.reporting.demand import first_channel
from phasmid.reporting.layout import points
from phasmid.reporting.panels import check_legs, leg_name
from phasmid.reporting.runs import Run, shown, who
from phasmid.reporting.sheet import Axes, legend, sheet
from phasmid.reporting.source import channel
from phasmid.reporting.steps import durations, intervals
from phasmid.reporting.style import FAINT, Figure, leg_colour, paler, shrunk, styled

NEEDS = (("stance", "contact"),)


def gait_diagram(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Bars of each leg's planned stance and, narrower and darker, of the contact that was seen.

    Args:
        runs: One block each.
        legs: Their numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, note = shown(runs)
    for run in parts:
        check_legs(legs, run.source)
        first_channel(run.recording, NEEDS[0])
    notes = [*who(parts), *([_agreement(parts[0], legs)] if len(parts) == 1 else []), note]
    with styled():
        height = 0.27 * len(legs) + 0.35
        drawing = sheet("Gait diagram", notes, [height] * len(parts), left=0.19, share_y=False)
        for axis, run in zip(drawing.axes, parts, strict=True):
            _bars(axis, run, legs)
            if len(parts) > 1:
                words = " · ".join(word for word in (run.label, _agreement(run, legs)) if word)
                shrunk(axis.set_title(words), 0.95 * float(axis.bbox.width), least=points(6.5))
        drawing.axes[-1].set_xlabel("time [s]")
        if len(parts[0].time) > 1:
            drawing.axes[-1].set_xlim(parts[0].time[0], parts[0].time[-1])
        names = {str(name) for run in parts for name in run.recording.data_vars}
        entries = [("stance as planned", paler(FAINT), "-")] if "stance" in names else []
        entries += [("contact as seen", FAINT, "-")] if "contact" in names else []
        legend(drawing, entries, width=6.0)
    return drawing.figure


def agreement(run: Run, legs: tuple[int, ...]) -> float | None:
    """Part of the time, over all these legs, for which contact and planned stance are the same."""
    stance, contact = (channel(run.recording, name) for name in ("stance", "contact"))
    if stance is None or contact is None:
        return None
    chosen = [leg - 1 for leg in legs]
    share = durations(run.time) / durations(run.time).sum()
    return float(share @ (stance == contact)[:, chosen].mean(axis=1))


def _agreement(run: Run, legs: tuple[int, ...]) -> str:
    part = agreement(run, legs)
    return "" if part is None else f"contact {100 * part:.1f} % as planned"


def _bars(axis: Axes, run: Run, legs: tuple[int, ...]) -> None:
    time = run.time
    for name, height in (("stance", 0.76), ("contact", 0.34)):
        down = channel(run.recording, name)
        for row, leg in enumerate([] if down is None else legs):
            assert down is not None
            bars = []
            for start, stop in intervals(down[:, leg - 1]):
                until = time[min(stop, len(time) - 1)]
                bars.append((time[start], until - time[start]))
            colour = leg_colour(leg - 1)
            colour = paler(colour) if name == "stance" else colour
            axis.broken_barh(bars, (row - height / 2, height), color=colour, linewidth=0)
    axis.set_ylim(len(legs) - 0.5, -0.5)
    axis.set_yticks(np.arange(len(legs)), [f"{leg} {leg_name(run.source, leg)}" for leg in legs])
    for label, leg in zip(axis.get_yticklabels(), legs, strict=True):
        label.set_color(leg_colour(leg - 1))
        shrunk(label, 0.9 * axis.bbox.x0, least=points(5.0))
    axis.tick_params(axis="y", length=0)
    axis.grid(visible=False, axis="y")
    axis.spines["left"].set_visible(False)
