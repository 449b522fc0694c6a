"""The figure of the three laws of contact: one leg over a cycle, and about a touchdown."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.reporting.style import FAINT, Figure, styled
from phasmid.verification.contact_laws import TOUCHDOWN, Comparison, Trial

LINES: dict[str, tuple[str, Any, float]] = {
    "spring-damper": ("#b9bec7", "-", 3.4),
    "mujoco": ("#bb5566", (0, (4, 1.6)), 1.3),
    "simscape": ("#004488", "-", 1.2),
}
"""Colour, dash and width of each law; those that meet stay visible beneath each other."""

LEG = 1
"""The leg that is shown, counted from 0: the right middle one, alone on its side."""

BEFORE = 0.08
"""Time before a touchdown from which on it is shown [s]."""

WIDTH, HEAD, ROW, FOOT = 7.2, 1.12, 1.55, 0.47
"""Of the figure, its title and legend, a row of panels, and the place below [inch]."""


def contact_figure(comparison: Comparison) -> Figure:
    """Normal and outward force on a foot and torque of its femur, under all laws.

    Args:
        comparison: The walks; of each at least two cycles.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as NewFigure
    from matplotlib.lines import Line2D

    first = next(iter(comparison.trials.values()))
    period = first.scenario.stride.period
    lands = _touchdown(first)
    spans = ((period, 2 * period), (lands - BEFORE, lands + TOUCHDOWN))
    rows = ("normal [N]", "outward [N]", "femur [N·m]")
    height = HEAD + ROW * len(rows) + FOOT
    with styled():
        figure = NewFigure(figsize=(WIDTH, height))
        FigureCanvasAgg(figure)
        axes = figure.subplots(len(rows), len(spans), sharex="col", squeeze=False)
        figure.subplots_adjust(
            left=0.108,
            right=0.98,
            top=1 - HEAD / height,
            bottom=FOOT / height,
            hspace=0.14,
            wspace=0.22,
        )
        for law, trial in comparison.trials.items():
            colour, dash, width = LINES[law]
            for row, values in enumerate(_shown(trial)):
                for column, (start, stop) in enumerate(spans):
                    part = slice(*np.searchsorted(trial.walk.time, (start, stop + 1e-9)))
                    moment = trial.walk.time[part]
                    axes[row, column].plot(
                        moment if column == 0 else 1000 * (moment - lands),
                        values[part],
                        color=colour,
                        linestyle=dash,
                        linewidth=width,
                    )
        for label, axis in zip(rows, axes[:, 0], strict=True):
            axis.set_ylabel(label)
        axes[0, 0].set_title("one cycle")
        axes[0, 1].set_title("a touchdown")
        axes[-1, 0].set_xlabel("time [s]")
        axes[-1, 1].set_xlabel("time since the plan's touchdown [ms]")
        axes[0, 0].set_xlim(*spans[0])
        axes[0, 1].set_xlim(-1000 * BEFORE, 1000 * TOUCHDOWN)
        figure.align_ylabels(axes[:, 0])
        leg = first.walk.robot.legs[LEG].name.replace("_", " ")
        place: dict[str, Any] = {"x": 0.108, "va": "top", "ha": "left"}
        title = f"Foot {LEG + 1}, {leg}, under three laws of contact"
        figure.text(y=1 - 0.10 / height, s=title, fontsize=11.5, fontweight="bold", **place)
        words = f"{first.walk.robot.name}, {first.walk.gait.name} gait, prescribed joints; "
        words += "outward: away from the hip"
        figure.text(y=1 - 0.33 / height, s=words, fontsize=8.5, color=FAINT, **place)
        handles = [
            Line2D([], [], color=colour, linestyle=dash, linewidth=width, label=law)
            for law, (colour, dash, width) in LINES.items()
        ]
        figure.legend(
            handles=handles,
            loc="upper left",
            bbox_to_anchor=(0.100, 1 - 0.50 / height),
            ncols=len(handles),
            columnspacing=1.4,
            borderaxespad=0.2,
        )
    return figure


def _touchdown(trial: Trial) -> float:
    """When the plan sets the shown foot down in the second cycle [s]."""
    stance, time = trial.walk.stance[:, LEG], trial.walk.time
    landed = np.flatnonzero(stance[1:] & ~stance[:-1]) + 1
    later = landed[time[landed] >= trial.scenario.stride.period]
    return float(time[later[0]])


def _shown(trial: Trial) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal and outward force, and the femur's torque."""
    force = trial.channel("foot_force")[:, LEG]
    outward = trial.walk.robot.arrays.R_body_hip[LEG, :, 0]
    return force[:, 2], force @ outward, trial.channel("joint_torque")[:, LEG, 1]
