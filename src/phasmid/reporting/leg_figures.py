"""Joint angles, torques, servo channels and normal forces over time, as the paper's Figs 12 to 16.

Several runs are drawn as a line each, in a panel for each leg and joint.
"""

from __future__ import annotations

import string
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from phasmid.recording.channels import CHANNELS, JOINTS
from phasmid.reporting.figure_layout import (
    Axes,
    Entry,
    check_legs,
    leg_name,
    leg_title,
    listed_legs,
    model_words,
    name_panel,
    panel_figure,
    shade,
    time_axis,
)
from phasmid.reporting.layout import layout
from phasmid.reporting.required_channels import first_channel
from phasmid.reporting.runs import Run, entries, shared_caption, shown_part
from phasmid.reporting.source import attribute
from phasmid.reporting.style import (
    FAINT,
    INK,
    JOINT_COLOURS,
    STANCE_COLOUR,
    Figure,
    darker,
    leg_colour,
    styled,
    thin,
)


@dataclass(frozen=True)
class Quantity:
    """A quantity of joints or feet.

    Attributes:
        title: Title of its figure.
        label: Label of the vertical axis, with the unit.
        channels: The simulated or recorded channel, then the computed one; one suffices.
        scale: Factor from the channel's unit to the figure's.
        computed: Word for the computed channel in the legend.
    """

    title: str
    label: str
    channels: tuple[str, ...]
    scale: float = 1.0
    computed: str = "model"


ANGLES = Quantity(
    "Joint angles",
    "angle [°]",
    ("joint_position", "joint_position_target"),
    float(np.degrees(1.0)),
    "planned",
)
TORQUES = Quantity("Joint torques", "torque [N·m]", ("joint_torque", "joint_torque_model"))
FORCES = Quantity("Normal forces", "force [N]", ("foot_normal_force", "foot_normal_force_model"))
SERVO_QUANTITIES = (
    Quantity("Servo output", "output [%]", ("servo_duty",), 100.0),
    Quantity("Servo current", "current [A]", ("servo_current",)),
    Quantity("Servo temperature", "temperature [°C]", ("servo_temperature",)),
)

LEGS_PER_FIGURE = 3
MODEL_DASH = (0, (3.2, 1.8))

COXA_APART = ("coxa", "femur and tibia")
"""Panels of each leg's angles: the coxa turns by some degrees, the others by ten times as much."""


def suffix_of(number: int) -> str:
    """Return the suffix of the files of one kind: none, then b, c and so on, then a number."""
    letters = string.ascii_lowercase
    return "" if number == 0 else letters[number] if number < 26 else f"-{number + 1}"


def leg_groups(count: int) -> list[tuple[int, ...]]:
    """Return leg numbers from 1 in even groups of at most three."""
    parts = np.array_split(np.arange(1, count + 1), -(-count // LEGS_PER_FIGURE))
    return [tuple(int(leg) for leg in part) for part in parts]


def quantity_figure(runs: Sequence[Run], legs: tuple[int, ...], quantity: Quantity) -> Figure:
    """Draw a quantity of some legs over time.

    Args:
        runs: One, with its simulated and its computed channel, or several that are compared.
        legs: Leg numbers, from 1.
        quantity: The quantity.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, note = shown_part(runs)
    for run in parts:
        check_legs(legs, run.source)
    draw = _draw_run if len(parts) == 1 else _draw_comparison
    with styled():
        return draw(parts, legs, quantity, note)


def _draw_run(runs: Sequence[Run], legs: tuple[int, ...], quantity: Quantity, note: str) -> Figure:
    run = runs[0]
    first_channel(run.recording, quantity.channels)
    seen, computed = (run.channel(name) for name in (*quantity.channels, "")[:2])
    title = quantity.title
    if quantity is ANGLES and seen is None:
        title = "Planned joint angles"
    notes = {
        TORQUES: [model_words(run.recording)],
        FORCES: [model_words(run.recording), f"weight {run.source.weight:.4g} N"],
    }.get(quantity, [])
    if quantity in SERVO_QUANTITIES:
        notes = [f"{run.source.scenario.servo.supply(run.source.robot.servo):g} V"]
    columns = COXA_APART if quantity is ANGLES else ("",)
    drawing = panel_figure(
        f"{title} of {listed_legs(legs)}",
        [*shared_caption(runs), *notes, note],
        [1.65] * len(legs),
        columns=len(columns),
        share_y="col",
        space=0.24,
    )
    stance = run.channel("stance")
    for leg, row in zip(legs, drawing.rows(), strict=True):
        colours = (leg_colour(leg - 1),) if quantity is FORCES else JOINT_COLOURS
        for joint, colour in enumerate(colours):
            of = (slice(None), leg - 1) if quantity is FORCES else (slice(None), leg - 1, joint)
            pair = [None if v is None else quantity.scale * v[of] for v in (seen, computed)]
            _draw_pair(row[min(joint, len(row) - 1)], run.time, pair[0], pair[1], colour)
        for axis, part in zip(row, columns, strict=True):
            named = leg_title(run.source, leg) if axis is row[0] else ""
            if part and layout().is_narrow:
                named = named.split(",")[0]
            name_panel(axis, ": ".join(filter(None, (named, part))))
            if stance is not None:
                shade(axis, run.time, stance[:, leg - 1], STANCE_COLOUR)
        row[0].set_ylabel(quantity.label)
    for axis in row:
        shaded = axis is row[0] and stance is not None
        time_axis(axis, run.time, "shaded: stance" if shaded else "")
    drawing.figure.align_ylabels(drawing.axes[:: len(columns)])
    labels: list[Entry] = []
    if quantity is not FORCES:
        labels = [(name, {"color": c}) for name, c in zip(JOINTS, JOINT_COLOURS, strict=True)]
    if quantity not in SERVO_QUANTITIES:
        labels += _pair_entries(run, seen is not None, computed is not None, quantity.computed)
    drawing.add_legend(labels)
    return drawing.figure


def _draw_pair(
    axis: Axes,
    time: np.ndarray,
    seen: np.ndarray | None,
    computed: np.ndarray | None,
    colour: str,
) -> None:
    """Draw the simulated line, and the computed one darker and dashed on top."""
    # A single sample makes no line.
    mark: dict[str, Any] = {"marker": "o" if len(time) == 1 else ""}
    if seen is not None:
        width = 1.5 if computed is None else 1.9
        axis.plot(*thin(time, seen), color=colour, linewidth=width, **mark)
    if computed is not None and seen is None:
        axis.plot(*thin(time, computed), color=colour, **mark)
    elif computed is not None:
        mark |= {"color": darker(colour), "linewidth": 1.1, "linestyle": MODEL_DASH}
        axis.plot(*thin(time, computed), **mark)


def _pair_entries(run: Run, seen: bool, computed: bool, word: str) -> list[Entry]:
    simulated = attribute(run.recording, "kind") == "simulation"
    name = "simulated" if simulated else "recorded"
    if seen and computed:
        dashed = {"color": INK, "linestyle": MODEL_DASH}
        return [(name, {"color": FAINT}), (f"{word} (darker)", dashed)]
    return [(name if seen else word, {"color": FAINT})]


def _draw_comparison(
    runs: Sequence[Run], legs: tuple[int, ...], quantity: Quantity, note: str
) -> Figure:
    found = [first_channel(run.recording, quantity.channels) for run in runs]
    used = {name for name, _ in found}
    kinds = " or ".join(CHANNELS[name].long_name for name in quantity.channels if name in used)
    # Shape (N, legs, panels of a row).
    lines = [values.reshape(*values.shape[:2], -1) for _, values in found]
    columns = lines[0].shape[2]
    drawing = panel_figure(
        f"{quantity.title} of {listed_legs(legs)}",
        [*shared_caption(runs), kinds, note],
        [1.4 if columns > 1 else 1.5] * len(legs),
        columns=columns,
        space=0.13,
    )
    for leg, row in zip(legs, drawing.rows(), strict=True):
        for joint, axis in enumerate(row):
            if columns == 1:
                name_panel(axis, leg_title(runs[0].source, leg))
            elif layout().is_narrow:
                name_panel(axis, (f"leg {leg} · " if joint == 0 else "") + JOINTS[joint], 8.5)
            else:
                name_panel(axis, f"{leg_name(runs[0].source, leg)} · {JOINTS[joint]}", 8.5)
            for run, values in zip(runs, lines, strict=True):
                axis.plot(*thin(run.time, quantity.scale * values[:, leg - 1, joint]), **run.line)
        row[0].set_ylabel(quantity.label)
    for axis in row:
        time_axis(axis, runs[0].time)
        if columns > 1 and not layout().is_narrow:
            axis.locator_params(axis="x", nbins=5)
    drawing.figure.align_ylabels(drawing.axes[::columns])
    drawing.add_legend(entries(runs), columns=1)
    return drawing.figure
