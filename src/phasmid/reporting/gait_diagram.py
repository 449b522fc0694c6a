"""Planned stance and recorded contact of each leg over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.reporting.figure_layout import (
    Axes,
    Entry,
    check_legs,
    leg_name,
    name_panel,
    panel_figure,
    spans,
    time_axis,
)
from phasmid.reporting.layout import points
from phasmid.reporting.required_channels import first_channel
from phasmid.reporting.runs import Run, shared_caption, shown_part
from phasmid.reporting.steps import durations
from phasmid.reporting.style import FAINT, Figure, leg_colour, paler, shrink, styled

NEEDS = (("stance", "contact"),)


def gait_diagram(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Draw bars of each leg's planned stance and, narrower and darker, of its contact.

    Args:
        runs: One block each.
        legs: Leg numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, note = shown_part(runs)
    for run in parts:
        check_legs(legs, run.source)
        first_channel(run.recording, NEEDS[0])
    alone = len(parts) == 1
    notes = [*shared_caption(parts), _agreement(parts[0], legs) if alone else "", note]
    with styled():
        height = 0.27 * len(legs) + 0.35
        drawing = panel_figure(
            "Gait diagram", notes, [height] * len(parts), left=0.19, share_y=False
        )
        for axis, run in zip(drawing.axes, parts, strict=True):
            draw_bars(axis, run, legs)
            if not alone:
                name_panel(axis, " · ".join(filter(None, (run.label, _agreement(run, legs)))))
        time_axis(drawing.axes[-1], parts[0].time)
        names = {str(name) for run in parts for name in run.recording.data_vars}
        entries: list[Entry] = []
        if "stance" in names:
            entries.append(("planned stance", {"color": paler(FAINT), "linewidth": 6.0}))
        if "contact" in names:
            entries.append(("recorded contact", {"color": FAINT, "linewidth": 6.0}))
        drawing.add_legend(entries)
    return drawing.figure


def agreement(run: Run, legs: tuple[int, ...]) -> float | None:
    """Return the share of the time, over all these legs, in which contact and stance are equal."""
    stance, contact = run.channel("stance"), run.channel("contact")
    if stance is None or contact is None:
        return None
    chosen = [leg - 1 for leg in legs]
    share = durations(run.time) / durations(run.time).sum()
    return float(share @ (stance == contact)[:, chosen].mean(axis=1))


def _agreement(run: Run, legs: tuple[int, ...]) -> str:
    share = agreement(run, legs)
    return "" if share is None else f"contact {100 * share:.1f} % as planned"


def draw_bars(axis: Axes, run: Run, legs: tuple[int, ...]) -> None:
    """Draw the bars of legs, numbered from 1, in a panel."""
    for name, height in (("stance", 0.76), ("contact", 0.34)):
        down = run.channel(name)
        if down is None:
            continue
        for row, leg in enumerate(legs):
            colour = leg_colour(leg - 1)
            axis.broken_barh(
                spans(run.time, down[:, leg - 1]),
                (row - height / 2, height),
                color=paler(colour) if name == "stance" else colour,
                linewidth=0,
            )
    axis.set_ylim(len(legs) - 0.5, -0.5)
    axis.set_yticks(np.arange(len(legs)), [leg_name(run.source, leg) for leg in legs])
    for label, leg in zip(axis.get_yticklabels(), legs, strict=True):
        label.set_color(leg_colour(leg - 1))
        shrink(label, 0.9 * float(axis.bbox.x0), least=points(5.0))
    axis.tick_params(axis="y", length=0)
    axis.grid(visible=False, axis="y")
    axis.spines["left"].set_visible(False)
