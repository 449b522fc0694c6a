"""How much of the friction each standing foot uses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.reporting.demand import first_channel, how_to_get
from phasmid.reporting.panels import check_legs, listed_legs, name_leg, shade_stance
from phasmid.reporting.runs import Run, entries, shown, who
from phasmid.reporting.sheet import legend, sheet
from phasmid.reporting.source import Source, channel
from phasmid.reporting.style import LIMIT_COLOUR, Figure, leg_colour, styled, thin

LEAST_LOAD = 0.02
"""Part of the robot's weight below which a foot's demand is not told: of two forces near zero,
as at touchdown, the ratio says nothing."""

NEEDS = (("foot_force", "foot_force_model"), ("stance", "contact"))
LIMIT_DASH = (0, (5, 1.6))


def friction_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Tangential over normal force of each standing foot, and the coefficient of friction.

    Args:
        runs: A line each.
        legs: Their numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, note = shown(runs)
    for run in parts:
        check_legs(legs, run.source)
    found = [friction_demand(run.recording, run.source) for run in parts]
    alone = len(parts) == 1
    threshold = f"stances under at least {LEAST_LOAD * parts[0].source.weight:.2g} N"
    notes = [*who(parts), threshold if alone else "", note]
    with styled():
        columns = 2 if len(legs) > 1 else 1
        drawing = sheet(
            f"Friction demand of {listed_legs(legs)}",
            notes,
            [1.45] * -(-len(legs) // columns),
            columns=columns,
            space=0.10,
            legend_rows=1 if alone else len(parts) + 1,
        )
        highest = 0.0
        for axis, leg in zip(drawing.axes, legs, strict=False):
            name_leg(axis, parts[0].source, leg)
            if alone:
                shade_stance(axis, parts[0].recording, leg)
            for run, (demand, limit, _) in zip(parts, found, strict=True):
                line: dict[str, Any] = {"color": leg_colour(leg - 1)}
                if not alone:
                    line = {"color": run.colour, "linestyle": run.dash, "linewidth": run.width}
                axis.plot(*thin(run.time, demand[:, leg - 1]), **line)
                line = {"color": LIMIT_COLOUR, "linewidth": 1.1, "linestyle": LIMIT_DASH}
                axis.plot(*thin(run.time, limit[:, leg - 1]), **line)
                seen = demand[:, leg - 1][np.isfinite(demand[:, leg - 1])]
                most = max(float(limit.max()), float(seen.max(initial=0.0)))
                highest = max(highest, most)
        for axis in drawing.axes[len(legs) :]:
            axis.set_visible(False)
        for number, axis in enumerate(drawing.axes[: len(legs)]):
            if number % columns == 0:
                axis.set_ylabel("demand [1]")
            if number >= len(legs) - columns:
                first = number % columns == 0
                noted = first and alone and "stance" in parts[0].recording
                shaded = "   (shaded: stance)" if noted else ""
                axis.set_xlabel(f"time [s]{shaded}")
                axis.xaxis.set_tick_params(labelbottom=True)
        drawing.axes[0].set_ylim(0.0, 1.12 * highest)
        if len(parts[0].time) > 1:
            drawing.axes[0].set_xlim(parts[0].time[0], parts[0].time[-1])
        limit_entry = ("coefficient of friction", LIMIT_COLOUR, LIMIT_DASH)
        demand_entry = (f"tangential over normal force{found[0][2]}", leg_colour(0), "-")
        told = [demand_entry] if alone else entries(parts)
        widths = [] if alone else [*(run.width for run in parts), 1.1]
        legend(drawing, [*told, limit_entry], columns=0 if alone else 1, widths=widths)
    return drawing.figure


def friction_demand(recording: Recording, source: Source) -> tuple[np.ndarray, np.ndarray, str]:
    """Tangential over normal force on standing feet, and what the ground allows.

    Args:
        recording: What was seen, or computed.
        source: The experiment.

    Returns:
        Demand, NaN where the foot does not stand or its normal force is below `LEAST_LOAD` of the
        weight; static coefficient of friction under each foot; both of shape (N, L). The third
        says whose forces they are.

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
    # What is left of the force's square is the tangential part's; round-off may leave less.
    tangential = np.sqrt(np.maximum(np.sum(force**2, axis=-1) - normal**2, 0.0))
    loaded = standing & (normal >= LEAST_LOAD * source.weight)
    demand = np.where(loaded, tangential / np.where(loaded, normal, 1.0), np.nan)
    if feet is None:
        limit = np.full(demand.shape, source.scenario.terrain.friction)
    else:
        limit = ground.friction(feet[..., 0], feet[..., 1])
    return demand, limit, " of the model" if name.endswith("_model") else ""
