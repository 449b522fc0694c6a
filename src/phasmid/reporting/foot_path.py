"""Foot paths in body axes and in the world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from phasmid import kinematics
from phasmid.recording import Recording
from phasmid.reporting.figure_layout import (
    Axes,
    check_legs,
    leg_name,
    listed_legs,
    name_panel,
    name_row,
    panel_figure,
)
from phasmid.reporting.layout import layout
from phasmid.reporting.required_channels import first_channel
from phasmid.reporting.runs import Run, shared_caption, shown_part
from phasmid.reporting.style import FAINT, Figure, leg_colour, styled, thin

NEEDS = (("foot_position",), ("body_position",), ("body_orientation",))
BODY_LINE: dict[str, Any] = {"color": FAINT, "linewidth": 1.1, "linestyle": (0, (4, 1.6))}


def foot_path_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Draw foot paths in body axes (left) and in the world (right), from above and from the side.

    Args:
        runs: Two rows of panels each.
        legs: Leg numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, note = shown_part(runs)
    for run in parts:
        check_legs(legs, run.source)
    alone = len(parts) == 1
    with styled():
        drawing = panel_figure(
            f"Foot paths of {listed_legs(legs)}",
            [*shared_caption(parts), note],
            [3.2, 2.0] * len(parts),
            columns=2,
            share_x=False,
            share_y=False,
            space=0.2,
            gap=0.42,
        )
        for number, run in enumerate(parts):
            block = drawing.axes[4 * number : 4 * number + 4]
            _draw(block, run, legs)
            if not alone:
                name_row(block[0], run.label)
        entries = [(leg_name(parts[0].source, leg), {"color": leg_colour(leg - 1)}) for leg in legs]
        entries.append(("body", BODY_LINE))
        drawing.add_legend(entries, columns=4, lines_below=0 if alone else 1)
    return drawing.figure


def feet_in_body(recording: Recording) -> np.ndarray:
    """Return the feet in the body frame [m], shape (N, L, 3).

    Raises:
        InvalidInput: A channel is absent.
    """
    feet, body, orientation = (first_channel(recording, names)[1] for names in NEEDS)
    R_world_body = kinematics.quaternion_rotation(orientation)
    seen: np.ndarray = np.einsum("nji,nlj->nli", R_world_body, feet - body[:, None, :])
    return seen


def _draw(axes: Sequence[Axes], run: Run, legs: tuple[int, ...]) -> None:
    in_body = feet_in_body(run.recording)
    in_world = np.asarray(run.recording["foot_position"].values)
    body = np.asarray(run.recording["body_position"].values)
    above_body, above_world, side_body, side_world = axes
    for above, side, feet in (
        (above_body, side_body, in_body),
        (above_world, side_world, in_world),
    ):
        for leg in legs:
            x, y, z = 1000 * feet[:, leg - 1].T
            # Seen from the right, legs of both sides may overlap: the first are wider.
            width = 2.6 if 2 * leg <= len(run.source.robot.legs) else 1.1
            line: dict[str, Any] = {"color": leg_colour(leg - 1), "linewidth": width}
            above.plot(*_path(run.time, x, y), **line)
            side.plot(*_path(run.time, x, z), **line)
    above_body.plot(0.0, 0.0, marker="+", markersize=8, color=FAINT, linestyle="")
    above_world.plot(*_path(run.time, 1000 * body[:, 0], 1000 * body[:, 1]), **BODY_LINE)
    for axis, name in (
        (above_body, "in body axes, from above"),
        (above_world, "in the world, from above"),
        (side_body, "in body axes, from the right"),
        (side_world, "in the world, from the right"),
    ):
        if layout().is_narrow:
            name = name.replace("in ", "").replace("from ", "").replace("the ", "")
        name_panel(axis, name)
        axis.set_xlabel("x, forward [mm]")
        axis.margins(x=0.05, y=0.1)
        axis.locator_params(nbins=3 if layout().is_narrow else 6)
    above_body.set_ylabel("y, left [mm]")
    side_body.set_ylabel("z, up [mm]")
    for axis in (above_body, above_world):
        axis.set_aspect("equal", adjustable="datalim")


def _path(time: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a path in the plane, reduced to the points that `thin` keeps of x or of y."""
    kept = np.union1d(thin(time, x)[0], thin(time, y)[0])
    rows = np.searchsorted(time, kept)
    return x[rows], y[rows]
