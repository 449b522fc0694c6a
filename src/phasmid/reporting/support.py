"""Static stability margin over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from phasmid.gait import support_margin
from phasmid.recording import Recording
from phasmid.reporting.feet import centre_of_mass
from phasmid.reporting.figure_layout import Entry, panel_figure, shade, time_axis
from phasmid.reporting.required_channels import first_channel
from phasmid.reporting.runs import Run, entries, shared_caption, shown_part
from phasmid.reporting.source import Source
from phasmid.reporting.style import (
    JOINT_COLOURS,
    LACKING_COLOUR,
    LIMIT_COLOUR,
    Figure,
    styled,
    thin,
)

NEEDS = (("foot_position",), ("contact", "stance"), ("body_position",))
WORDS = {"contact": "feet in contact", "stance": "feet in planned stance"}


def support_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Draw the distance of the centre of mass from the edge of the support polygon.

    Args:
        runs: A line each; a single run has one of its contacts and one of its planned stance.
        legs: Ignored: all legs count.

    Raises:
        InvalidInput: A channel is absent.
    """
    del legs
    parts, note = shown_part(runs)
    alone = len(parts) == 1
    margins = [
        {
            name: margin_over_time(run.recording, run.source, name)
            for name in [n for n in WORDS if n in run.recording.data_vars][: 2 if alone else 1]
        }
        for run in parts
    ]
    first = [first_channel(run.recording, NEEDS[1])[0] for run in parts]
    of_what = {found[name][1] for found, name in zip(margins, first, strict=True)}
    margin = margins[0][first[0]][0]
    least = _least(parts[0], margin) if alone else ""
    notes = [*shared_caption(parts), f"of the {' or the '.join(sorted(of_what))}", least, note]
    with styled():
        drawing = panel_figure("Support margin", notes, [2.7])
        axis = drawing.axes[0]
        labels: list[Entry] = []
        for run, found in zip(parts, margins, strict=True):
            for number, (name, (values, _)) in enumerate(found.items()):
                look: dict[str, Any] = {"color": JOINT_COLOURS[2 * number]}
                look["linestyle"] = ("-", (0, (3.2, 1.8)))[number]
                line = look if alone else run.line
                known = np.where(np.isfinite(values), 1000 * values, np.nan)
                axis.plot(*thin(run.time, known), **line)
                labels.append((WORDS[name], line))
        undefined = ~np.isfinite(margin) & alone
        shade(axis, parts[0].time, undefined, LACKING_COLOUR)
        axis.axhline(0.0, color=LIMIT_COLOUR, linewidth=1.0)
        axis.set_ylabel("margin [mm]")
        words = "shaded: fewer than three feet" if undefined.any() else ""
        time_axis(axis, parts[0].time, words)
        drawing.add_legend(labels if alone else entries(parts), columns=0 if alone else 1)
    return drawing.figure


def margin_over_time(recording: Recording, source: Source, standing: str) -> tuple[np.ndarray, str]:
    """Return the static stability margin of every sample.

    Args:
        recording: The recording.
        source: Its robot and experiment.
        standing: Channel of the stance feet: ``contact`` or ``stance``.

    Returns:
        Margin [m], shape (N,), minus infinity where fewer than three feet stand, or all in a
        line; and its reference point: the centre of mass or, where the joint angles or the pose are
        not recorded, the body's origin.

    Raises:
        InvalidInput: A channel is absent.
    """
    feet = first_channel(recording, ("foot_position",))[1]
    centre, what = centre_of_mass(recording, source), "centre of mass"
    if centre is None:
        centre, what = first_channel(recording, ("body_position",))[1], "body's origin"
    down = first_channel(recording, (standing,))[1]
    return support_margin(feet[..., :2], down, centre[..., :2]), what


def _least(run: Run, margin: np.ndarray) -> str:
    finite = np.where(np.isfinite(margin), margin, np.inf)
    at = int(np.argmin(finite))
    if not np.isfinite(finite[at]):
        return "never three feet on the ground"
    while_three = "" if np.isfinite(margin).all() else " while three feet stand"
    return f"least {1000 * margin[at]:.1f} mm at {run.time[at]:.2f} s{while_three}"
