"""How far the robot is from tipping over, over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.gait import support_margin
from phasmid.recording import Recording
from phasmid.reporting.demand import first_channel
from phasmid.reporting.feet import centre_of_mass
from phasmid.reporting.panels import shade, time_axis
from phasmid.reporting.runs import Run, entries, shown, who
from phasmid.reporting.sheet import legend, sheet
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
WORDS = {"contact": "feet in contact", "stance": "feet planned to stand"}


def support_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Distance of the centre of mass, seen from above, from the edge of the support polygon.

    Args:
        runs: A line each; of one alone as its feet stood, and as they were planned to stand.
        legs: All of them count, whichever are named.

    Raises:
        InvalidInput: A channel is absent.
    """
    del legs
    parts, note = shown(runs)
    alone = len(parts) == 1
    margins = [
        _margins(run.recording, run.source, [n for n in WORDS if n in run.recording.data_vars])
        for run in parts
    ]
    own = [found[_standing(run)] for run, found in zip(parts, margins, strict=True)]
    least = _least(parts[0], own[0][0]) if alone else ""
    what = {of_what for _, of_what in own}
    notes = [*who(parts), f"of the {' or the '.join(sorted(what))}", least, note]
    with styled():
        drawing = sheet(
            "Support margin", notes, [2.7], legend_rows=1 if alone else len(parts), left=0.108
        )
        axis = drawing.axes[0]
        labels: list[tuple[str, str, object]] = []
        for run, found in zip(parts, margins, strict=True):
            for number, name in enumerate(list(found) if alone else list(found)[:1]):
                margin, _ = found[name]
                colour = JOINT_COLOURS[2 * number] if alone else run.colour
                dash = ("-", (0, (3.2, 1.8)))[number] if alone else run.dash
                known = np.where(np.isfinite(margin), 1000 * margin, np.nan)
                width = 1.4 if alone else run.width
                axis.plot(*thin(run.time, known), color=colour, linestyle=dash, linewidth=width)
                labels.append((WORDS[name], colour, dash))
                if alone and number == 0:
                    shade(axis, run.time, ~np.isfinite(margin), LACKING_COLOUR)
        axis.axhline(0.0, color=LIMIT_COLOUR, linewidth=1.0)
        axis.set_ylabel("margin [mm]")
        time_axis(axis, parts[0].recording, shaded=False)
        if alone:
            none = not np.isfinite(own[0][0]).all()
            axis.set_xlabel("time [s]" + ("   (shaded: fewer than three feet)" if none else ""))
        if alone:
            legend(drawing, labels)
        else:
            legend(drawing, entries(parts), columns=1, widths=[run.width for run in parts])
    return drawing.figure


def margin_over_time(recording: Recording, source: Source, standing: str) -> tuple[np.ndarray, str]:
    """The support margin of every sample.

    Args:
        recording: What was seen.
        source: The experiment.
        standing: Channel that tells which feet stand: ``contact`` or ``stance``.

    Returns:
        Margin [m], shape (N,), minus infinity where fewer than three feet stand, or all in a
        line; and what it is the margin of: the centre of mass where the recording tells it, or
        else the body frame's origin.

    Raises:
        InvalidInput: A channel is absent.
    """
    return _margins(recording, source, [standing])[standing]


def _standing(run: Run) -> str:
    return first_channel(run.recording, NEEDS[1])[0]


def _margins(
    recording: Recording, source: Source, names: Sequence[str]
) -> dict[str, tuple[np.ndarray, str]]:
    """What `margin_over_time` gives of each channel that tells which feet stand."""
    feet = first_channel(recording, ("foot_position",))[1]
    centre, what = centre_of_mass(recording, source), "centre of mass"
    if centre is None:
        centre, what = first_channel(recording, ("body_position",))[1], "body's origin"
    down = {name: first_channel(recording, (name,))[1] for name in names}
    return {
        name: (support_margin(feet[..., :2], standing, centre[..., :2]), what)
        for name, standing in down.items()
    }


def _least(run: Run, margin: np.ndarray) -> str:
    finite = np.where(np.isfinite(margin), margin, np.inf)
    at = int(np.argmin(finite))
    if not np.isfinite(finite[at]):
        return "never three feet on the ground"
    while_three = "" if np.isfinite(margin).all() else " while three feet stand"
    return f"least {1000 * margin[at]:.1f} mm at {run.time[at]:.2f} s{while_three}"
