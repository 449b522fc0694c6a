"""The paper's kinds of figure for several runs: a line for each run in every panel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.recording.channels import CHANNELS, JOINTS
from phasmid.reporting.demand import first_channel
from phasmid.reporting.layout import layout, points
from phasmid.reporting.panels import check_legs, leg_name, listed_legs, name_leg, time_axis
from phasmid.reporting.runs import Run, entries, shown, who
from phasmid.reporting.sheet import legend, sheet
from phasmid.reporting.style import Figure, shrunk, styled, thin


def compare_joints(
    runs: Sequence[Run],
    legs: tuple[int, ...],
    names: Sequence[str],
    what: str,
    unit: str,
    scale: float = 1.0,
) -> Figure:
    """A row of panels for each leg, one for each joint, with a line for each run.

    Args:
        runs: Two or more.
        legs: Their numbers, from 1.
        names: Of each run the first of these channels that it has is drawn.
        what: For the title.
        unit: Label of the upright axis.
        scale: From the channel's unit to the figure's.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, found, notes = _parts(runs, legs, names)
    with styled():
        drawing = sheet(
            f"{what} of {listed_legs(legs)}",
            notes,
            [1.4] * len(legs),
            columns=3,
            legend_rows=len(parts),
            space=0.13,
        )
        for row, leg in enumerate(legs):
            for joint, axis in enumerate(drawing.axes[3 * row : 3 * row + 3]):
                # A row is of one leg.
                name = f"{leg} {leg_name(parts[0].source, leg)} · {JOINTS[joint]}"
                if layout().is_narrow:
                    name = f"leg {leg} · {JOINTS[joint]}" if joint == 0 else JOINTS[joint]
                title = axis.set_title(name, fontsize=points(8.5))
                shrunk(title, axis.bbox.width, least=points(6.5))
                for run, values in zip(parts, found, strict=True):
                    line = thin(run.time, scale * values[:, leg - 1, joint])
                    axis.plot(*line, color=run.colour, linestyle=run.dash, linewidth=run.width)
            drawing.axes[3 * row].set_ylabel(unit)
        for axis in drawing.axes[-3:]:
            time_axis(axis, parts[0].recording, shaded=False)
            if not layout().is_narrow:
                axis.locator_params(axis="x", nbins=5)
        drawing.figure.align_ylabels(drawing.axes[::3])
        legend(drawing, entries(parts), columns=1, widths=[run.width for run in parts])
    return drawing.figure


def compare_feet(
    runs: Sequence[Run], legs: tuple[int, ...], names: Sequence[str], what: str, unit: str
) -> Figure:
    """A panel for each leg with a line for each run; arguments as of `compare_joints`.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, found, notes = _parts(runs, legs, names)
    with styled():
        drawing = sheet(
            f"{what} of {listed_legs(legs)}", notes, [1.5] * len(legs), legend_rows=len(parts)
        )
        for axis, leg in zip(drawing.axes, legs, strict=True):
            name_leg(axis, parts[0].source, leg)
            axis.set_ylabel(unit)
            for run, values in zip(parts, found, strict=True):
                line = thin(run.time, values[:, leg - 1])
                axis.plot(*line, color=run.colour, linestyle=run.dash, linewidth=run.width)
        time_axis(drawing.axes[-1], parts[0].recording, shaded=False)
        legend(drawing, entries(parts), columns=1, widths=[run.width for run in parts])
    return drawing.figure


def _parts(
    runs: Sequence[Run], legs: tuple[int, ...], names: Sequence[str]
) -> tuple[list[Run], list[np.ndarray], list[str]]:
    """What is shown of the runs, their channels, and parts of the subtitle."""
    parts, note = shown(runs)
    for run in parts:
        check_legs(legs, run.source)
    found = [first_channel(run.recording, names) for run in parts]
    used = {name for name, _ in found}
    kinds = " or ".join(CHANNELS[name].long_name for name in names if name in used)
    return parts, [values for _, values in found], [*who(parts), kinds, note]
