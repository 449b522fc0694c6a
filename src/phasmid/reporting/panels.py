"""What figures over time share: the part that is shown, a panel per leg, its stance shaded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.reporting.layout import layout, points
from phasmid.reporting.sheet import Axes, Sheet, caption, sheet, short
from phasmid.reporting.source import Source, attribute, channel, read_source
from phasmid.reporting.steps import intervals
from phasmid.reporting.style import STANCE_COLOUR, shrunk

MOST_CYCLES, LAST_CYCLES = 6, 5
"""Of a walk of more cycles than the first, only so many of the last are drawn: more make a comb."""


def shown_part(recording: Recording) -> tuple[Recording, str]:
    """The part of a recording that figures over time show, and what to say of it.

    All of a walk of at most `MOST_CYCLES` cycles, and then nothing is said; else the last ones.
    """
    time = np.asarray(recording["time"].values)
    period = read_source(recording).scenario.stride.period
    cycles = float(time[-1] - time[0]) / period
    if cycles <= MOST_CYCLES + 1e-6:
        return recording, ""
    first = int(np.searchsorted(time, time[-1] - LAST_CYCLES * period - 1e-9))
    return recording.isel(time=slice(first, None)), f"last {LAST_CYCLES} of {cycles:.4g} cycles"


def panels(
    recording: Recording,
    legs: tuple[int, ...],
    what: str,
    unit: str,
    notes: Sequence[str] = (),
    parts: Sequence[str] = ("",),
) -> Sheet:
    """A figure with one panel per leg, or one per leg and part of it, its stance shaded.

    Args:
        recording: Of which all is shown.
        legs: Their numbers, from 1.
        what: What is drawn, for the title.
        unit: Label of the panels' upright axis.
        notes: What the subtitle says besides who walked how; empty ones are left out.
        parts: Names of the panels side by side, of which each column has its own upright axis.

    Raises:
        InvalidInput: There is no such leg.
    """
    source = read_source(recording)
    check_legs(legs, source)
    panel = sheet(
        f"{what} of {listed_legs(legs)}",
        [*caption(recording, source), *notes],
        [1.65] * len(legs),
        columns=len(parts),
        share_y=len(parts) == 1,
        space=0.24,
    )
    columns = [panel.axes[k :: len(parts)] for k in range(len(parts))]
    for part, column in zip(parts, columns, strict=True):
        for axis, leg in zip(column, legs, strict=True):
            name_leg(axis, source, leg, part, first=axis in columns[0])
            if axis is not column[0] and len(parts) > 1:
                axis.sharey(column[0])
            shade_stance(axis, recording, leg)
        time_axis(column[-1], recording, noted=column is columns[0])
    for axis in columns[0]:
        axis.set_ylabel(unit)
    panel.figure.align_ylabels(columns[0])
    return panel


def check_legs(legs: tuple[int, ...], source: Source) -> None:
    """Refuse legs that the robot has not.

    Raises:
        InvalidInput: There is no such leg.
    """
    count = len(source.robot.legs)
    for leg in legs:
        if not 1 <= leg <= count:
            raise InvalidInput(f"there is no leg {leg}; legs are 1 to {count}.")


def listed_legs(legs: tuple[int, ...]) -> str:
    """Legs in words, such as ``legs 1, 2 and 3``."""
    numbers = ", ".join(map(str, legs[:-1])) + (" and " if legs[1:] else "") + str(legs[-1])
    return f"leg{'s' if legs[1:] else ''} {numbers}"


def leg_name(source: Source, leg: int) -> str:
    """A leg's name in words, by its number from 1."""
    return short(source.robot.legs[leg - 1].name).replace("_", " ")


def name_leg(axis: Axes, source: Source, leg: int, part: str = "", *, first: bool = True) -> None:
    """Write a leg's number, from 1, its name and a part of it over its panel.

    Only the first panel of a row names the leg.
    """
    name = f"Leg {leg}"
    if not (part and layout().is_narrow):
        name += f", {leg_name(source, leg)}"
    title = axis.set_title(": ".join(word for word in (name if first else "", part) if word))
    shrunk(title, axis.bbox.width, least=points(7.0))


def shade_stance(axis: Axes, recording: Recording, leg: int) -> None:
    """Shade when a leg, by its number from 1, is planned to stand."""
    stance = channel(recording, "stance")
    if stance is not None:
        shade(axis, np.asarray(recording["time"].values), stance[:, leg - 1], STANCE_COLOUR)


def shade(axis: Axes, time: np.ndarray, where: np.ndarray, colour: str) -> None:
    """Shade a panel over all its height, behind its lines.

    Args:
        axis: The panel.
        time: Of the samples [s], shape (N,).
        where: Which samples are shaded, each until the next one, shape (N,).
        colour: Of the shade.
    """
    last = len(time) - 1
    spans = [(time[start], time[min(stop, last)]) for start, stop in intervals(where)]
    bars = [(start, stop - start) for start, stop in spans]
    upright = axis.get_xaxis_transform()
    axis.broken_barh(bars, (0, 1), color=colour, linewidth=0, zorder=0, transform=upright)


def time_axis(axis: Axes, recording: Recording, *, shaded: bool = True, noted: bool = True) -> None:
    """Name the lowest panel's time, and let it be as long as the recording.

    Args:
        axis: The panel.
        recording: What is shown.
        shaded: Whether panels shade the planned stance where it is recorded.
        noted: Whether this panel's label says so.
    """
    time = np.asarray(recording["time"].values)
    note = "   (shaded: stance)" if noted and shaded and "stance" in recording.data_vars else ""
    axis.set_xlabel(f"time [s]{note}")
    if len(time) > 1:
        axis.set_xlim(time[0], time[-1])


def model_words(recording: Recording) -> str:
    """How the model shares the load among the feet, if the recording says so."""
    forces = short(attribute(recording, "force_model"))
    known = forces and any(str(name).endswith("_model") for name in recording.data_vars)
    return f"model forces: {forces}" if known else ""
