"""The figures beside the paper's own: Eq. 10 as printed, and the force models against contact."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from phasmid.dynamics import leg_torque
from phasmid.dynamics.printed import EQ_10, LegMisprint, printed_leg_torque
from phasmid.forces import FORCE_MODELS
from phasmid.kinematics import joint_angles
from phasmid.motion import plan
from phasmid.paper.comparisons import model_force_and_torque
from phasmid.paper.evidence import DRIVES, Evidence, Trial
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

Line: TypeAlias = tuple[str, Any, float]
"""Colour, dash and width."""

SEEN: Line = ("#b9bec7", "-", 3.2)
"""Simulated curve, drawn beneath the computed one."""

LINES: tuple[Line, ...] = tuple(
    (leg_colour(number), dash, 1.4)
    for number, dash in enumerate(("-", (0, (5, 2)), (0, (2, 2)), (0, (1, 1.5)), "-."))
)
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
        figure, axes = _grid(
            3,
            1,
            "Equation 10 as printed, leg 1 in its first swing",
            "phantomx-paper, masses at mid-length as Eq 10 assumes; no load on the foot",
            row=1.5,
            sharey=False,
        )
        for joint, axis in enumerate(axes[:, 0]):
            colour = JOINT_COLOURS[joint]
            axis.plot(walk.time, right[:, joint], color=colour, linewidth=2.2)
            for _, switches, dash in printed:
                wrong = 1000 * printed_leg_torque(leg, *motion, misprints=switches)
                axis.plot(walk.time, wrong[:, joint], color=INK, linewidth=1.2, linestyle=dash)
            axis.set_title(JOINTS[joint])
            axis.set_ylabel("torque [mN·m]")
        axes[-1, 0].set_xlabel("time [s]")
        axes[-1, 0].set_xlim(0, 1)
        entries = [(name, INK, dash, 1.2) for name, _, dash in printed]
        _legend(figure, [("corrected", FAINT, "-", 2.2), *entries])
    return figure


def stance_laws_figure(evidence: Evidence) -> Figure:
    """Joint angles of legs 1 to 3 in the first cycle, under both stance laws side by side."""
    columns = {"coxa-only": "coxa-only, the text on Fig. 12", "straight": "straight, the default"}
    with styled():
        figure, axes = _grid(
            3,
            2,
            "Figure 12 under both stance laws, legs 1, 2 and 3",
            "phantomx-paper, planned; angles from those of the neutral stance; shaded: in support",
            row=1.7,
            sharey=True,
            room=0.12,
        )
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
                    axis.plot(time, angles[:, leg, joint], color=colour, linewidth=1.4)
        for leg in range(3):
            axes[leg, 0].set_ylabel(f"leg {leg + 1}: angle [°]")
        axes[0, 0].set_xlim(0, evidence.scenario.stride.period)
        pairs = zip(JOINTS, JOINT_COLOURS, strict=True)
        _legend(figure, [(name, colour, "-", 1.4) for name, colour in pairs])
    return figure


def sharing_figure(evidence: Evidence) -> Figure:
    """Forces on foot 2 over one cycle, by each drive in the engine and by each force model."""
    lines = _alike(evidence)
    with styled():
        figure, axes = _grid(
            2,
            len(DRIVES),
            "Forces on foot 2: simulated, and by each force model",
            "phantomx-paper, tripod gait; outward: away from the hip; negative: pushed inwards",
            row=2.1,
            sharey="row",
            room=0.12,
            legend=1 + len(lines),
        )
        for column, drive in enumerate(DRIVES):
            trial = evidence.driven(drive)
            _draw_foot(axes[:, column], trial, trial.channel("foot_force"), SEEN)
            for line, alike in zip(LINES, lines, strict=False):
                _draw_foot(axes[:, column], trial, model_force_and_torque(trial, alike[0])[0], line)
            short = {DRIVES[0]: "prescribed joints", DRIVES[1]: "40 N·m/rad"}
            axes[0, column].set_title(short.get(drive, drive))
            axes[1, column].set_xlabel("time [s]")
        axes[0, 0].set_ylabel("normal [N]")
        axes[1, 0].set_ylabel("outward [N]")
        axes[0, 0].set_xlim(*CYCLE)
        axes[0, 0].set_xticks([2.0, 3.0, 4.0])
        entries = [("simulated", SEEN)]
        entries += [(", ".join(alike), line) for line, alike in zip(LINES, lines, strict=False)]
        _legend(figure, [(label, *line) for label, line in entries], columns=1)
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


def _draw_foot(axes: np.ndarray, trial: Trial, force: np.ndarray, line: Line) -> None:
    """Normal and outward force on foot 2."""
    shown = slice(*np.searchsorted(trial.walk.time, CYCLE))
    outward = trial.walk.robot.arrays.R_body_hip[1, :, 0]
    colour, dash, width = line
    for axis, values in zip(axes, (force[:, 1, 2], force[:, 1] @ outward), strict=True):
        time = trial.walk.time[shown]
        axis.plot(time, values[shown], color=colour, linestyle=dash, linewidth=width)


def _grid(
    rows: int,
    columns: int,
    title: str,
    subtitle: str,
    *,
    row: float,
    sharey: Any,
    room: float = 0.34,
    legend: int = 1,
) -> tuple[Figure, np.ndarray]:
    """Return a figure of panels with title, subtitle and space for the legend."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as NewFigure

    head = 0.93 + 0.19 * legend
    height = 0.33 + head + row * rows
    figure = NewFigure(figsize=(WIDTH, height))
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, sharex=True, sharey=sharey, squeeze=False)
    figure.subplots_adjust(
        left=0.108,
        right=0.98,
        top=1 - head / height,
        bottom=0.47 / height,
        hspace=room,
        wspace=0.12,
    )
    place: dict[str, Any] = {"x": 0.108, "va": "top", "ha": "left"}
    figure.text(y=1 - 0.10 / height, s=title, fontsize=11.5, fontweight="bold", **place)
    figure.text(y=1 - 0.33 / height, s=subtitle, fontsize=8.5, color=FAINT, **place)
    return figure, axes


def _legend(figure: Figure, entries: list[tuple[str, str, Any, float]], columns: int = 4) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=colour, linestyle=dash, label=label, linewidth=width)
        for label, colour, dash, width in entries
    ]
    top = 1 - 0.50 / float(figure.get_figheight())
    look: dict[str, Any] = {"columnspacing": 1.4, "labelspacing": 0.3, "borderaxespad": 0.2}
    place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (0.1, top)}
    figure.legend(handles=handles, ncols=columns, **place, **look)
