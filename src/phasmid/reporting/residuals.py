"""How the model's forces and torques differ from the simulated ones, over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from phasmid.recording import Recording
from phasmid.recording.channels import JOINTS
from phasmid.reporting.demand import first_channel
from phasmid.reporting.layout import layout, points
from phasmid.reporting.panels import (
    check_legs,
    leg_name,
    listed_legs,
    model_words,
    shade,
    time_axis,
)
from phasmid.reporting.runs import Run, entries, shown, who
from phasmid.reporting.sheet import Axes, legend, sheet
from phasmid.reporting.source import channel
from phasmid.reporting.steps import SETTLING, away_from_switches
from phasmid.reporting.style import STANCE_COLOUR, Figure, leg_colour, paler, shrunk, styled, thin

NEEDS = (
    ("foot_normal_force",),
    ("foot_normal_force_model",),
    ("joint_torque",),
    ("joint_torque_model",),
)


def residuals_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Normal forces and joint torques by the model less the simulated ones.

    Args:
        runs: One with a line for each leg, or several with each one's rms over these legs.
        legs: Their numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, note = shown(runs)
    for run in parts:
        check_legs(legs, run.source)
    found = [residuals(run.recording) for run in parts]
    alone = len(parts) == 1
    models = {model_words(run.recording) for run in parts}
    settling = f"shaded: {1000 * SETTLING:g} ms around the switches of legs"
    calm = [_calm(run) for run in parts]
    notes = [*who(parts), *(models if len(models) == 1 else []), note]
    what = "Model less simulation" if alone else "Model less simulation, rms over the feet"
    with styled():
        drawing = sheet(
            f"{what}, {listed_legs(legs)}" if alone else what,
            notes,
            [1.35] * 4,
            share_y=False,
            legend_rows=-(-len(legs) // 3) if alone else len(parts),
            gap=0.26,
            left=0.13,
        )
        names = ["normal force", *(f"{joint} torque" for joint in JOINTS)]
        for row, (axis, name) in enumerate(zip(drawing.axes, names, strict=True)):
            axis.set_title(name)
            axis.set_ylabel("force [N]" if row == 0 else "torque [N·m]")
            for run, values, quiet in zip(parts, found, calm, strict=True):
                _draw(axis, run, values[row], quiet, legs, alone=alone)
            _keep_calm(axis, [values[row] for values in found], calm, legs, alone=alone)
        time_axis(drawing.axes[-1], parts[0].recording, shaded=False)
        shaded = alone and "stance" in parts[0].recording.data_vars
        drawing.axes[-1].set_xlabel(f"time [s]   ({settling})" if shaded else "time [s]")
        drawing.figure.align_ylabels(drawing.axes)
        if alone:
            told: list[tuple[str, str, Any]] = [
                (f"{leg} {leg_name(parts[0].source, leg)}", leg_colour(leg - 1), "-")
                for leg in legs
            ]
            legend(drawing, told, columns=min(3, len(legs)))
        else:
            legend(drawing, entries(parts), columns=1, widths=[run.width for run in parts])
    return drawing.figure


def residuals(recording: Recording) -> list[np.ndarray]:
    """The model's normal forces [N] less the simulated ones, then torques [N·m] of each joint.

    Returns:
        Four arrays of shape (N, L): normal force, coxa, femur, tibia.

    Raises:
        InvalidInput: A channel is absent.
    """
    seen, model, tau, tau_model = (first_channel(recording, names)[1] for names in NEEDS)
    return [model - seen, *np.moveaxis(tau_model - tau, -1, 0)]


def _calm(run: Run) -> np.ndarray:
    """Samples away from the switches of all legs; all of them where no stance is recorded."""
    stance = channel(run.recording, "stance")
    if stance is None:
        return np.ones(len(run.time), dtype=bool)
    calm: np.ndarray = np.all(away_from_switches(run.time, stance), axis=1)
    return calm


def _line(values: np.ndarray, legs: tuple[int, ...]) -> np.ndarray:
    """Rms over these legs, shape (N,)."""
    rms: np.ndarray = np.sqrt(np.mean(values[:, [leg - 1 for leg in legs]] ** 2, axis=1))
    return rms


def _draw(
    axis: Axes,
    run: Run,
    values: np.ndarray,
    calm: np.ndarray,
    legs: tuple[int, ...],
    *,
    alone: bool,
) -> None:
    time = run.time
    if not alone:
        look: dict[str, Any] = {"color": run.colour, "linestyle": run.dash, "linewidth": run.width}
        axis.plot(*thin(time, _line(values, legs)), **look)
        return
    shade(axis, time, ~calm, STANCE_COLOUR)
    for leg in legs:
        colour, line = leg_colour(leg - 1), values[:, leg - 1]
        axis.plot(*thin(time, line), color=paler(colour), linewidth=0.8)
        axis.plot(*thin(time, np.where(calm, line, np.nan)), color=colour, linewidth=1.2)


def _keep_calm(
    axis: Axes,
    rows: Sequence[np.ndarray],
    calm: Sequence[np.ndarray],
    legs: tuple[int, ...],
    *,
    alone: bool,
) -> None:
    """Choose the upright axis for what lies away from switches, and say what that leaves out."""
    chosen = [leg - 1 for leg in legs]
    lines = [values[:, chosen] if alone else _line(values, legs)[:, None] for values in rows]
    most = max(float(np.abs(line).max(initial=0.0)) for line in lines)
    quiet = max(
        float(np.abs(line[mask]).max(initial=0.0)) for line, mask in zip(lines, calm, strict=True)
    )
    if quiet == 0.0 or most <= 3 * quiet:
        return
    axis.set_ylim(-1.6 * quiet if alone else 0.0, 1.6 * quiet)
    unit = "N" if axis.get_ylabel().endswith("[N]") else "N·m"
    name = axis.get_title(loc="left")
    words = f"impacts up to {most:.2g} {unit}" + ("" if layout().is_narrow else " are cut off")
    title = axis.set_title(f"{name}   ({words})")
    shrunk(title, axis.bbox.width, least=points(6.5))
