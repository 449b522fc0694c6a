"""The paper's Figs 12 to 16: joint angles, joint torques and normal forces of each leg."""

from __future__ import annotations

import string
from typing import Any

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.recording.channels import JOINTS
from phasmid.reporting.panels import model_words, panels, shown_part
from phasmid.reporting.sheet import Axes, Sheet, legend
from phasmid.reporting.source import attribute, channel, read_source
from phasmid.reporting.style import (
    FAINT,
    INK,
    JOINT_COLOURS,
    Figure,
    darker,
    leg_colour,
    styled,
    thin,
)

ANGLES = ("joint_position", "joint_position_target")
TORQUES = ("joint_torque", "joint_torque_model")
FORCES = ("foot_normal_force", "foot_normal_force_model")
"""Channels of which each kind of figure needs one."""

LEGS_PER_FIGURE = 3
MODEL_DASH = (0, (3.2, 1.8))
SERVO_FIGURES = {
    "servo_duty": ("Servo output", "output [%]", 100.0),
    "servo_current": ("Servo current", "current [A]", 1.0),
    "servo_temperature": ("Servo temperature", "temperature [°C]", 1.0),
}
"""Channels of the servos that are drawn: title, label of the axis, and its scale."""

COXA_APART = ("coxa", "femur and tibia")
"""Panels of each leg's angles: the coxa turns by some degrees, the others by ten times as much."""

JOINT_ENTRIES: list[tuple[str, str, Any]] = [
    (joint, colour, "-") for joint, colour in zip(JOINTS, JOINT_COLOURS, strict=True)
]


def suffix_of(number: int) -> str:
    """What tells the files of one kind apart: nothing, then b, c and so on, then a number."""
    letters = string.ascii_lowercase
    return "" if number == 0 else letters[number] if number < 26 else f"-{number + 1}"


def leg_groups(count: int) -> list[tuple[int, ...]]:
    """Leg numbers from 1 in groups of at most three, as even as can be."""
    parts = np.array_split(np.arange(1, count + 1), -(-count // LEGS_PER_FIGURE))
    return [tuple(int(leg) for leg in part) for part in parts]


def trajectory_figure(recording: Recording, legs: tuple[int, ...]) -> Figure:
    """Joint angles of some legs over time, as in Fig. 12; the coxa has its own axis.

    Args:
        recording: What was seen, or at least planned.
        legs: Their numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    recording, span = shown_part(recording)
    seen = channel(recording, "joint_position")
    planned = channel(recording, "joint_position_target")
    if seen is None and planned is None:
        _needed(recording, "joint_position")
    what = "Joint angles" if seen is not None else "Planned joint angles"
    with styled():
        panel = panels(recording, legs, what, "angle [°]", [span], COXA_APART)
        _draw_joints(panel, recording, legs, seen, planned, scale=np.degrees(1.0))
        legend(panel, JOINT_ENTRIES + _pair_entries(recording, seen, planned, "planned"))
    return panel.figure


def torque_figure(recording: Recording, legs: tuple[int, ...]) -> Figure:
    """Joint torques of some legs over time, as in Figs. 13 and 14; simulated and of the model.

    Args:
        recording: What was seen, computed or both.
        legs: Their numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    recording, span = shown_part(recording)
    seen, model = channel(recording, "joint_torque"), channel(recording, "joint_torque_model")
    if seen is None and model is None:
        _needed(recording, "joint_torque")
    notes = [model_words(recording), span]
    with styled():
        panel = panels(recording, legs, "Joint torques", "torque [N·m]", notes)
        _draw_joints(panel, recording, legs, seen, model)
        legend(panel, JOINT_ENTRIES + _pair_entries(recording, seen, model, "model"))
    return panel.figure


def normal_force_figure(recording: Recording, legs: tuple[int, ...]) -> Figure:
    """Normal forces on some feet over time, as in Figs. 15 and 16; simulated and of the model.

    Args:
        recording: What was seen, computed or both.
        legs: Their numbers, from 1.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    recording, span = shown_part(recording)
    seen = channel(recording, "foot_normal_force")
    model = channel(recording, "foot_normal_force_model")
    if seen is None and model is None:
        _needed(recording, "foot_normal_force")
    source = read_source(recording)
    notes = [model_words(recording), f"weight {source.weight:.4g} N", span]
    time = np.asarray(recording["time"].values)
    with styled():
        panel = panels(recording, legs, "Normal forces", "force [N]", notes)
        for axis, leg in zip(panel.axes, legs, strict=True):
            _pair(axis, time, seen, model, (leg - 1,), leg_colour(leg - 1))
        legend(panel, _pair_entries(recording, seen, model, "model"))
    return panel.figure


def servo_figure(recording: Recording, legs: tuple[int, ...], name: str) -> Figure:
    """What the servos of some legs gave over time.

    Args:
        recording: What was seen.
        legs: Their numbers, from 1.
        name: A channel of `SERVO_FIGURES`.

    Raises:
        InvalidInput: There is no such leg or no such channel.
    """
    recording, span = shown_part(recording)
    values, (what, unit, scale) = _needed(recording, name), SERVO_FIGURES[name]
    source = read_source(recording)
    voltage = source.scenario.servo.supply(source.robot.servo)
    with styled():
        panel = panels(recording, legs, what, unit, [f"{voltage:g} V", span])
        _draw_joints(panel, recording, legs, values, None, scale=scale)
        legend(panel, JOINT_ENTRIES)
    return panel.figure


def _draw_joints(
    panel: Sheet,
    recording: Recording,
    legs: tuple[int, ...],
    seen: np.ndarray | None,
    model: np.ndarray | None,
    *,
    scale: float = 1.0,
) -> None:
    time = np.asarray(recording["time"].values)
    seen, model = (None if values is None else scale * values for values in (seen, model))
    for row, leg in enumerate(legs):
        axes = panel.axes[panel.columns * row : panel.columns * (row + 1)]
        for joint, colour in enumerate(JOINT_COLOURS):
            _pair(axes[min(joint, len(axes) - 1)], time, seen, model, (leg - 1, joint), colour)


def _pair(
    axis: Axes,
    time: np.ndarray,
    seen: np.ndarray | None,
    model: np.ndarray | None,
    of: tuple[int, ...],
    colour: str,
) -> None:
    """One quantity as simulated, and as computed: darker and dashed on top where both are."""
    # A single sample makes no line.
    mark: dict[str, Any] = {"marker": "o" if len(time) == 1 else ""}
    if seen is not None:
        width = 1.5 if model is None else 1.9
        axis.plot(*thin(time, _column(seen, of)), color=colour, linewidth=width, **mark)
    if model is not None:
        line = thin(time, _column(model, of))
        if seen is None:
            axis.plot(*line, color=colour, **mark)
        else:
            dash: dict[str, Any] = {"linewidth": 1.1, "linestyle": MODEL_DASH}
            axis.plot(*line, color=darker(colour), **dash, **mark)


def _column(values: np.ndarray, of: tuple[int, ...]) -> np.ndarray:
    return values.reshape(len(values), -1)[:, np.ravel_multi_index(of, values.shape[1:])]


def _pair_entries(
    recording: Recording, seen: np.ndarray | None, model: np.ndarray | None, computed: str
) -> list[tuple[str, str, Any]]:
    seen_name = "simulated" if attribute(recording, "kind") == "simulation" else "recorded"
    if seen is not None and model is not None:
        return [(seen_name, FAINT, "-"), (f"{computed} (darker)", INK, MODEL_DASH)]
    return [(seen_name if seen is not None else computed, FAINT, "-")]


def _needed(recording: Recording, name: str) -> np.ndarray:
    values = channel(recording, name)
    if values is None:
        raise InvalidInput(f"the recording has no {name}; this figure needs it.")
    return values
