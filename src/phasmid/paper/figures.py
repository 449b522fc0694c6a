"""The figures beside the paper's own: Eq. 10 as printed, and the force models against contact."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.dynamics import leg_torque
from phasmid.dynamics.printed import EQ_10, LegMisprint, printed_leg_torque
from phasmid.forces import FORCE_MODELS
from phasmid.kinematics import joint_angles
from phasmid.motion import plan
from phasmid.paper.comparisons import model_force_and_torque
from phasmid.paper.evidence import DRIVES, STIFF, Evidence, Trial
from phasmid.recording import JOINTS
from phasmid.reporting.style import (
    FAINT,
    INK,
    JOINT_COLOURS,
    STANCE_COLOUR,
    Figure,
    leg_colour,
    styled,
)

WIDTH = 7.2
"""Of a figure, as the paper's figures are drawn [inch]."""

SIMULATED: dict[str, Any] = {"color": "#b9bec7", "linewidth": 3.2}
"""Simulated curve, drawn beneath the computed ones."""

DASHES = "-", (0, (5, 2)), (0, (2, 2)), (0, (1, 1.5)), "-."
"""Of the force models; those that meet stay visible beneath each other."""

CYCLE = (2.0, 4.0)
"""The second cycle, which the start does not touch any more [s]."""


def as_printed_figure(evidence: Evidence) -> Figure:
    """Torques of leg 1 in its first swing: corrected, as printed, and as printed with θ3 fed in."""
    scenario = evidence.scenario.replace(mass_model="mid-length")
    walk = plan(scenario).sample(np.linspace(0.0, 1.0, 500, endpoint=False))
    leg = walk.robot.legs[0]
    motion = (walk.q[:, 0], walk.qd[:, 0], walk.qdd[:, 0])
    printed = (
        ("as printed", frozenset(EQ_10), "--"),
        ("as printed, fed with θ3 of Eq 9", frozenset({*EQ_10, LegMisprint.THETA_3_AS_FED}), ":"),
    )
    right = 1000 * leg_torque(leg, *motion)
    with styled():
        figure, axes = _panels(3, 1, 1.5, sharey=False)
        for joint, axis in enumerate(axes[:, 0]):
            colour = JOINT_COLOURS[joint]
            axis.plot(walk.time, right[:, joint], color=colour, linewidth=2.2, label="corrected")
            for label, switches, dash in printed:
                wrong = 1000 * printed_leg_torque(leg, *motion, misprints=switches)
                axis.plot(walk.time, wrong[:, joint], dash, color=INK, linewidth=1.2, label=label)
            axis.set(title=JOINTS[joint], ylabel="torque [mN·m]")
        axes[-1, 0].set(xlabel="time [s]", xlim=(0, 1))
        _name(
            figure,
            "Equation 10 as printed, leg 1 in its first swing",
            "phantomx-paper, masses at mid-length as Eq 10 assumes; no load on the foot",
        )
    return figure


def stance_laws_figure(evidence: Evidence) -> Figure:
    """Joint angles of legs 1 to 3 in the first cycle, under both stance laws side by side."""
    columns = {"coxa-only": "coxa-only, the text on Fig. 12", "straight": "straight, the default"}
    with styled():
        figure, axes = _panels(3, 2, 1.7, sharey=True)
        for column, (law, title) in enumerate(columns.items()):
            walk = evidence.variant(law, "as-given").walk
            neutral = joint_angles(walk.robot.arrays, walk.robot.arrays.neutral_foot)
            shown = walk.time <= evidence.scenario.stride.period + 1e-9
            time, angles = walk.time[shown], np.degrees(walk.q[shown] - neutral)
            axes[0, column].set_title(title)
            axes[-1, column].set_xlabel("time [s]")
            for leg, axis in enumerate(axes[:, column]):
                axis.fill_between(
                    time,
                    0,
                    1,
                    where=walk.stance[shown, leg],
                    color=STANCE_COLOUR,
                    transform=axis.get_xaxis_transform(),
                    linewidth=0,
                )
                for joint, colour in enumerate(JOINT_COLOURS):
                    label = JOINTS[joint]
                    axis.plot(time, angles[:, leg, joint], color=colour, label=label)
        for leg in range(3):
            axes[leg, 0].set_ylabel(f"leg {leg + 1}: angle [°]")
        axes[0, 0].set_xlim(0, evidence.scenario.stride.period)
        _name(
            figure,
            "Figure 12 under both stance laws, legs 1, 2 and 3",
            "phantomx-paper, planned; angles from those of the neutral stance; shaded: in support",
        )
    return figure


def sharing_figure(evidence: Evidence) -> Figure:
    """Forces on foot 2 over one cycle, by each drive in the engine and by each force model."""
    with styled():
        figure, axes = _panels(2, len(DRIVES), 2.1, sharey="row")
        for column, drive in zip(axes.T, DRIVES, strict=True):
            trial = evidence.driven(drive)
            seen = trial.channel("foot_force")
            _draw_foot(column, trial, seen, **SIMULATED, label="simulated")
            for number, models in enumerate(_alike(evidence)):
                force, _ = model_force_and_torque(trial, models[0])
                line = {"color": leg_colour(number), "linestyle": DASHES[number]}
                _draw_foot(column, trial, force, **line, label=", ".join(models))
            short = {"prescribed": "prescribed joints", STIFF: "40 N·m/rad"}
            column[0].set_title(short.get(drive, drive))
            column[1].set_xlabel("time [s]")
        axes[0, 0].set(ylabel="normal [N]", xlim=CYCLE, xticks=[2.0, 3.0, 4.0])
        axes[1, 0].set_ylabel("outward [N]")
        _name(
            figure,
            "Forces on foot 2: simulated, and by each force model",
            "phantomx-paper, tripod gait; outward: away from the hip; negative: pushed inwards",
            columns=1,
        )
    return figure


def _alike(evidence: Evidence) -> list[list[str]]:
    """Return the force models, those together whose forces on this walk are the same line."""
    found: list[tuple[np.ndarray, list[str]]] = []
    for model in FORCE_MODELS:
        force, _ = model_force_and_torque(evidence.walk, model)
        for other, names in found:
            if np.abs(force - other).max() < 0.01:
                names.append(model)
                break
        else:
            found.append((force, [model]))
    return [names for _, names in found]


def _draw_foot(axes: np.ndarray, trial: Trial, force: np.ndarray, **line: Any) -> None:
    """Draw normal and outward force on foot 2."""
    shown = slice(*np.searchsorted(trial.walk.time, CYCLE))
    outward = trial.walk.robot.arrays.R_body_hip[1, :, 0]
    for axis, values in zip(axes, (force[:, 1, 2], force[:, 1] @ outward), strict=True):
        axis.plot(trial.walk.time[shown], values[shown], **line)


def _panels(rows: int, columns: int, height: float, *, sharey: Any) -> tuple[Figure, np.ndarray]:
    """Return a figure of panels with rows of a height [inch]."""
    from matplotlib.figure import Figure as NewFigure

    figure = NewFigure(figsize=(WIDTH, 1.4 + height * rows), layout="constrained")
    return figure, figure.subplots(rows, columns, sharex=True, sharey=sharey, squeeze=False)


def _name(figure: Figure, title: str, subtitle: str, *, columns: int = 3) -> None:
    """Write the title with the legend above the panels, and the subtitle below them."""
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(),
        title=title,
        title_fontproperties={"size": 11.5, "weight": "bold"},
        loc="outside upper left",
        alignment="left",
        ncols=columns,
    )
    figure.supxlabel(subtitle, x=0.02, ha="left", fontsize=8.5, color=FAINT)
