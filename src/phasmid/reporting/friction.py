"""Friction demand of the stance feet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.reporting.figure_layout import (
    Entry,
    check_legs,
    leg_title,
    listed_legs,
    name_panel,
    panel_figure,
    shade,
    time_axis,
)
from phasmid.reporting.required_channels import first_channel, how_to_get
from phasmid.reporting.runs import Run, entries, shared_caption, shown_part
from phasmid.reporting.source import Source, channel
from phasmid.reporting.style import LIMIT_COLOUR, STANCE_COLOUR, Figure, leg_colour, styled, thin

LEAST_LOAD = 0.02
"""Share of the weight below which a foot has no demand: the ratio of two forces near zero, as at
touchdown, is meaningless."""

NEEDS = (("foot_force", "foot_force_model"), ("stance", "contact"))
LIMIT_LINE: dict[str, Any] = {
    "color": LIMIT_COLOUR,
    "linewidth": 1.1,
    "linestyle": (0, (5, 1.6)),
}


def friction_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Draw tangential over normal force of each stance foot, and the coefficient of friction.

    Args:
        runs: A line each.
        legs: Leg numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, note = shown_part(runs)
    for run in parts:
        check_legs(legs, run.source)
    found = [friction_demand(run.recording, run.source) for run in parts]
    alone = len(parts) == 1
    threshold = f"stances under at least {LEAST_LOAD * parts[0].source.weight:.2g} N"
    columns = 2 if len(legs) > 1 else 1
    with styled():
        drawing = panel_figure(
            f"Friction demand of {listed_legs(legs)}",
            [*shared_caption(parts), threshold if alone else "", note],
            [1.45] * -(-len(legs) // columns),
            columns=columns,
            space=0.10,
        )
        stance = parts[0].channel("stance") if alone else None
        highest = 0.0
        for axis, leg in zip(drawing.axes, legs, strict=False):
            name_panel(axis, leg_title(parts[0].source, leg))
            if stance is not None:
                shade(axis, parts[0].time, stance[:, leg - 1], STANCE_COLOUR)
            for run, (demand, limit, _) in zip(parts, found, strict=True):
                line = {"color": leg_colour(leg - 1)} if alone else run.line
                axis.plot(*thin(run.time, demand[:, leg - 1]), **line)
                axis.plot(*thin(run.time, limit[:, leg - 1]), **LIMIT_LINE)
                largest = np.nanmax(demand[:, leg - 1], initial=0.0)
                highest = max(highest, float(limit.max()), float(largest))
        for axis in drawing.axes[len(legs) :]:
            axis.set_visible(False)
        for number, axis in enumerate(drawing.axes[: len(legs)]):
            first = number % columns == 0
            if first:
                axis.set_ylabel("demand [1]")
            if number >= len(legs) - columns:
                shaded = first and stance is not None
                time_axis(axis, parts[0].time, "shaded: stance" if shaded else "")
                axis.xaxis.set_tick_params(labelbottom=True)
        drawing.axes[0].set_ylim(0.0, 1.12 * highest)
        limits: Entry = ("coefficient of friction", LIMIT_LINE)
        if alone:
            words = f"tangential over normal force{found[0][2]}"
            drawing.add_legend([(words, {"color": leg_colour(0)}), limits])
        else:
            drawing.add_legend([*entries(parts), limits], columns=1)
    return drawing.figure


def friction_demand(recording: Recording, source: Source) -> tuple[np.ndarray, np.ndarray, str]:
    """Return tangential over normal force on stance feet, and the coefficient of friction.

    Args:
        recording: A recording with foot forces.
        source: Its robot and experiment.

    Returns:
        Demand, NaN where the foot does not stand or its normal force is below `LEAST_LOAD` of the
        weight; static coefficient of friction under each foot; both of shape (N, L). Then
        a note on forces of the model.

    Raises:
        InvalidInput: A channel is absent.
    """
    name, force = first_channel(recording, NEEDS[0])
    _, standing = first_channel(recording, NEEDS[1])
    ground, feet = source.scenario.load_terrain(), channel(recording, "foot_position")
    normal = channel(recording, name.replace("foot_force", "foot_normal_force"))
    if normal is None:
        if feet is None and not ground.is_level:
            raise InvalidInput(
                "the recording has no foot_normal_force; on this ground the demand needs it.",
                hint=how_to_get("foot_normal_force"),
            )
        normal = force[..., 2]
        if feet is not None and not ground.is_level:
            normal = np.einsum("tlk,tlk->tl", force, ground.normal(feet[..., 0], feet[..., 1]))
    # Round-off may leave less than zero.
    tangential = np.sqrt(np.maximum(np.sum(force**2, axis=-1) - normal**2, 0.0))
    loaded = standing & (normal >= LEAST_LOAD * source.weight)
    demand = np.where(loaded, tangential / np.where(loaded, normal, 1.0), np.nan)
    if feet is None:
        limit = np.full(demand.shape, source.scenario.terrain.friction)
    else:
        limit = ground.friction(feet[..., 0], feet[..., 1])
    return demand, limit, " of the model" if name.endswith("_model") else ""
