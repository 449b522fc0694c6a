"""The ways of the feet, as the body sees them and in the world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from phasmid import kinematics
from phasmid.recording import Recording
from phasmid.reporting.demand import first_channel
from phasmid.reporting.layout import layout, points
from phasmid.reporting.panels import check_legs, leg_name, listed_legs
from phasmid.reporting.runs import Run, shown, who
from phasmid.reporting.sheet import Axes, legend, name_row, sheet
from phasmid.reporting.style import FAINT, Figure, leg_colour, shrunk, styled, thin

NEEDS = (("foot_position",), ("body_position",), ("body_orientation",))
BODY_DASH = (0, (4, 1.6))


def foot_path_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Ways of the feet in body axes (left) and in the world (right), from above and from the side.

    Args:
        runs: Two rows of panels each.
        legs: Their numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, note = shown(runs)
    for run in parts:
        check_legs(legs, run.source)
    with styled():
        drawing = sheet(
            f"Foot paths of {listed_legs(legs)}",
            [*who(parts), note],
            [3.2, 2.0] * len(parts),
            columns=2,
            share_x=False,
            share_y=False,
            legend_rows=-(-(len(legs) + 1) // 4) + (len(parts) > 1),
            space=0.2,
            gap=0.42,
        )
        for number, run in enumerate(parts):
            block = drawing.axes[4 * number : 4 * number + 4]
            _draw(block, run, legs)
            if len(parts) > 1:
                name_row(block[0], run.label)
        entries: list[tuple[str, str, Any]] = [
            (f"{leg} {leg_name(parts[0].source, leg)}", leg_colour(leg - 1), "-") for leg in legs
        ]
        legend(drawing, [*entries, ("body", FAINT, BODY_DASH)], columns=4)
    return drawing.figure


def feet_in_body(recording: Recording) -> np.ndarray:
    """Feet in the body frame [m], shape (N, L, 3).

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
            # Seen from the right, legs of both sides may lie upon each other: the first are wider.
            width = 2.6 if 2 * leg <= len(run.source.robot.legs) else 1.1
            line: dict[str, Any] = {"color": leg_colour(leg - 1), "linewidth": width}
            above.plot(*_path(run.time, x, y), **line)
            side.plot(*_path(run.time, x, z), **line)
    above_body.plot(0.0, 0.0, marker="+", markersize=8, color=FAINT, linestyle="")
    track: dict[str, Any] = {"color": FAINT, "linewidth": 1.1, "linestyle": BODY_DASH}
    above_world.plot(*_path(run.time, 1000 * body[:, 0], 1000 * body[:, 1]), **track)
    for axis, name, down in (
        (above_body, "in body axes, from above", "y, left [mm]"),
        (above_world, "in the world, from above", "y, left [mm]"),
        (side_body, "in body axes, from the right", "z, up [mm]"),
        (side_world, "in the world, from the right", "z, up [mm]"),
    ):
        narrow = layout().is_narrow
        words = name.replace("in ", "").replace("from ", "").replace("the ", "")
        title = axis.set_title(words if narrow else name)
        shrunk(title, axis.bbox.width, least=points(6.5))
        axis.set_xlabel("x, forward [mm]")
        if axis in (above_body, side_body):
            axis.set_ylabel(down)
        axis.margins(x=0.05, y=0.1)
        axis.locator_params(nbins=3 if narrow else 6)
    for axis in (above_body, above_world):
        axis.set_aspect("equal", adjustable="datalim")


def _path(time: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A way in the plane with the points that one would see: those that `thin` keeps of either."""
    kept = np.union1d(thin(time, x)[0], thin(time, y)[0])
    rows = np.searchsorted(time, kept)
    return x[rows], y[rows]
