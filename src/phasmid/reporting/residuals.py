"""Differences of the model's forces and torques from the simulated ones, over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.recording import Recording
from phasmid.recording.channels import JOINTS
from phasmid.reporting.figure_layout import (
    Axes,
    check_legs,
    leg_name,
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
from phasmid.reporting.steps import SETTLING, away_from_switches
from phasmid.reporting.style import STANCE_COLOUR, Figure, leg_colour, paler, styled, thin

NEEDS = (
    ("foot_normal_force",),
    ("foot_normal_force_model",),
    ("joint_torque",),
    ("joint_torque_model",),
)


def residuals_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Draw normal forces and joint torques of the model less the simulated ones.

    Args:
        runs: One with a line for each leg, or several with the rms over these legs.
        legs: Leg numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    parts, note = shown_part(runs)
    for run in parts:
        check_legs(legs, run.source)
    found = [residuals(run.recording) for run in parts]
    calm = [_calm(run) for run in parts]
    alone = len(parts) == 1
    models = {model_words(run.recording) for run in parts}
    title = "Model less simulation"
    title += f", {listed_legs(legs)}" if alone else ", rms over the feet"
    notes = [*shared_caption(parts), *(models if len(models) == 1 else []), note]
    with styled():
        drawing = panel_figure(title, notes, [1.35] * 4, share_y=False, gap=0.26, left=0.13)
        names = ["normal force", *(f"{joint} torque" for joint in JOINTS)]
        for row, (axis, name) in enumerate(zip(drawing.axes, names, strict=True)):
            axis.set_ylabel("force [N]" if row == 0 else "torque [N·m]")
            for run, values, quiet in zip(parts, found, calm, strict=True):
                _draw(axis, run, values[row], quiet, legs, alone=alone)
            impacts = _limit(axis, [values[row] for values in found], calm, legs, alone=alone)
            unit = "N" if row == 0 else "N·m"
            cut = "" if layout().is_narrow else " are cut off"
            words = f"   (impacts up to {impacts:.2g} {unit}{cut})" if impacts else ""
            name_panel(axis, name + words)
        shaded = alone and "stance" in parts[0].recording.data_vars
        words = f"shaded: {1000 * SETTLING:g} ms around the switches of legs" if shaded else ""
        time_axis(drawing.axes[-1], parts[0].time, words)
        drawing.figure.align_ylabels(drawing.axes)
        if alone:
            labels = [
                (leg_name(parts[0].source, leg), {"color": leg_colour(leg - 1)}) for leg in legs
            ]
            drawing.add_legend(labels, columns=3)
        else:
            drawing.add_legend(entries(parts), columns=1)
    return drawing.figure


def residuals(recording: Recording) -> list[np.ndarray]:
    """Return normal forces [N] of the model less the simulated ones, then torques [N·m].

    Returns:
        Four arrays of shape (N, L): normal force, coxa, femur, tibia.

    Raises:
        InvalidInput: A channel is absent.
    """
    seen, model, tau, tau_model = (first_channel(recording, names)[1] for names in NEEDS)
    return [model - seen, *np.moveaxis(tau_model - tau, -1, 0)]


def _calm(run: Run) -> np.ndarray:
    """Return the samples away from the switches of all legs; all without a recorded stance."""
    stance = run.channel("stance")
    if stance is None:
        return np.ones(len(run.time), dtype=bool)
    calm: np.ndarray = np.all(away_from_switches(run.time, stance), axis=1)
    return calm


def _line(values: np.ndarray, legs: tuple[int, ...]) -> np.ndarray:
    """Return the rms over these legs, shape (N,)."""
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
    if not alone:
        axis.plot(*thin(run.time, _line(values, legs)), **run.line)
        return
    shade(axis, run.time, ~calm, STANCE_COLOUR)
    for leg in legs:
        colour, line = leg_colour(leg - 1), values[:, leg - 1]
        axis.plot(*thin(run.time, line), color=paler(colour), linewidth=0.8)
        axis.plot(*thin(run.time, np.where(calm, line, np.nan)), color=colour, linewidth=1.2)


def _limit(
    axis: Axes,
    rows: Sequence[np.ndarray],
    calm: Sequence[np.ndarray],
    legs: tuple[int, ...],
    *,
    alone: bool,
) -> float:
    """Limit the vertical axis to values away from switches; return the largest value cut off."""
    chosen = [leg - 1 for leg in legs]
    lines = [np.abs(values[:, chosen] if alone else _line(values, legs)) for values in rows]
    most = max(float(line.max(initial=0.0)) for line in lines)
    quiet = max(float(line[mask].max(initial=0.0)) for line, mask in zip(lines, calm, strict=True))
    if quiet == 0.0 or most <= 3 * quiet:
        return 0.0
    axis.set_ylim(-1.6 * quiet if alone else 0.0, 1.6 * quiet)
    return most
