"""The figures beside the paper's own: Eq. 10 as printed, and the force models against contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from phasmid.dynamics import leg_torque
from phasmid.dynamics.printed import EQ_10, LegMisprint, printed_leg_torque
from phasmid.forces import FORCE_MODELS
from phasmid.kinematics import joint_angles
from phasmid.motion import plan
from phasmid.paper.comparisons import model_force_and_torque
from phasmid.paper.evidence import DRIVES, SERVO_STIFFNESS, STIFF, Evidence, Trial
from phasmid.recording import JOINTS
from phasmid.reporting.panels import Axes, Entry, Panels, shade, time_axis
from phasmid.reporting.style import (
    DEFAULT_LAYOUT,
    INK,
    JOINT_COLOURS,
    STANCE_COLOUR,
    Figure,
    leg_colour,
    styled,
)
from phasmid.units import STANDARD_GRAVITY

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
    entries: list[Entry] = [
        ("corrected", {"color": JOINT_COLOURS[0], "linewidth": 2.2}),
        ("as printed", {"color": INK, "linewidth": 1.2, "linestyle": "--"}),
        ("as printed, fed with θ3 of Eq 9", {"color": INK, "linewidth": 1.2, "linestyle": ":"}),
    ]
    as_fed = {*EQ_10, LegMisprint.THETA_3_AS_FED}
    torques = [
        leg_torque(leg, *motion, gravity=STANDARD_GRAVITY),
        *(
            printed_leg_torque(leg, *motion, misprints=frozenset(m), gravity=STANDARD_GRAVITY)
            for m in (EQ_10, as_fed)
        ),
    ]
    with styled():
        drawing = Panels(DEFAULT_LAYOUT, [1.5] * 3, share_y=False)
        for joint, axis in enumerate(drawing.axes):
            for torque, (_, line) in zip(torques, entries, strict=True):
                colour = JOINT_COLOURS[joint] if torque is torques[0] else INK
                axis.plot(walk.time, 1000 * torque[:, joint], **line | {"color": colour})
            axis.set(title=JOINTS[joint], ylabel="torque [mN·m]")
        time_axis(axis, walk.time)
        notes = ["phantomx-paper", "masses at mid-length as Eq 10 assumes", "no load on the foot"]
        title = "Equation 10 as printed, leg 1 in its first swing"
        return drawing.complete(title, notes, entries)


def stance_laws_figure(evidence: Evidence) -> Figure:
    """Joint angles of legs 1 to 3 in the first cycle, under both stance laws side by side."""
    laws = {"coxa-only": "coxa-only, the text on Fig. 12", "straight": "straight, the default"}
    lines: list[Entry] = [
        (name, {"color": c}) for name, c in zip(JOINTS, JOINT_COLOURS, strict=True)
    ]
    with styled():
        drawing = Panels(DEFAULT_LAYOUT, [1.7] * 3, columns=2)
        for axes, (law, title) in zip(zip(*drawing.rows, strict=True), laws.items(), strict=True):
            walk = evidence.variant(law, "as-given").walk
            neutral = joint_angles(walk.robot.arrays, walk.robot.arrays.neutral_foot)
            shown = walk.time <= evidence.planned.experiment.course.stride.period + 1e-9
            time, angles = walk.time[shown], np.degrees(walk.q[shown] - neutral)
            for leg, axis in enumerate(axes):
                shade(axis, time, walk.stance[shown, leg], STANCE_COLOUR)
                for values, (_, line) in zip(angles[:, leg].T, lines, strict=True):
                    axis.plot(time, values, **line)
            axes[0].set_title(title)
            time_axis(axes[-1], time, "shaded: in support")
        for leg, row in enumerate(drawing.rows, 1):
            row[0].set_ylabel(f"leg {leg}: angle [°]")
        notes = ["phantomx-paper", "planned", "angles from those of the neutral stance"]
        title = "Figure 12 under both stance laws, legs 1, 2 and 3"
        return drawing.complete(title, notes, lines)


def sharing_figure(evidence: Evidence) -> Figure:
    """Forces on foot 2 over one cycle, by each drive in the engine and by each force model."""
    models = _alike(evidence)
    entries: list[Entry] = [("simulated", SIMULATED)] + [
        (", ".join(names), {"color": leg_colour(number), "linestyle": DASHES[number]})
        for number, names in enumerate(models)
    ]
    short = {"prescribed": "prescribed joints", STIFF: f"{SERVO_STIFFNESS:g} N·m/rad"}
    with styled():
        drawing = Panels(DEFAULT_LAYOUT, [2.1, 2.1], columns=len(DRIVES), share_y="row")
        for axes, drive in zip(zip(*drawing.rows, strict=True), DRIVES, strict=True):
            trial = evidence.driven(drive)
            forces = [trial.channel("foot_force")]
            forces += [model_force_and_torque(trial, names[0])[0] for names in models]
            for force, (_, line) in zip(forces, entries, strict=True):
                _draw_foot(axes, trial, force, line)
            axes[0].set_title(short.get(drive, drive))
            time_axis(axes[1], np.array(CYCLE))
        drawing.axes[0].set(ylabel="normal [N]", xticks=[2.0, 3.0, 4.0])
        drawing.rows[1][0].set_ylabel("outward [N]")
        notes = ["phantomx-paper", "tripod gait", "outward: away from the hip"]
        title = "Forces on foot 2: simulated, and by each force model"
        return drawing.complete(title, notes, entries, columns=1)


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


def _draw_foot(axes: Sequence[Axes], trial: Trial, force: np.ndarray, line: dict[str, Any]) -> None:
    """Draw normal and outward force on foot 2."""
    shown = slice(*np.searchsorted(trial.walk.time, CYCLE))
    outward = trial.walk.robot.arrays.R_body_hip[1, :, 0]
    for axis, values in zip(axes, (force[:, 1, 2], force[:, 1] @ outward), strict=True):
        axis.plot(trial.walk.time[shown], values[shown], **line)
