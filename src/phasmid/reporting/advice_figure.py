"""Figure of an advice: torque and temperature of every joint."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.advice.advice import MINUTES, Advice
from phasmid.reporting.panels import Entry, Panels
from phasmid.reporting.style import INK, JOINT_COLOURS, LIMIT_COLOUR, Figure, Layout, styled
from phasmid.robot import JOINTS
from phasmid.servo.words import servo_label

WIDTH = 0.26
"""Width of a joint's bar [distances between legs]."""

SHADES = 0.35, 0.65, 1.0
"""Opacities of the temperatures after the times of `MINUTES`."""


@styled()
def advice_figure(advice: Advice) -> Figure:
    """Draw the torque and the temperature of every servo.

    Bars of torque are the largest values, marks in them the root mean squares. Bars of temperature
    are expected values, lines on them the estimates from the lowest to the highest.
    """
    load, verdict = advice.load, advice.verdict
    legs = np.arange(len(advice.robot.legs))
    warmth = [advice.temperature(minutes) for minutes in MINUTES]
    known = all(rows is not None for rows in warmth)
    notes = [
        f"{servo_label(verdict.servo)} at {advice.voltage:g} V, {verdict.gait} gait, "
        f"{1000 * advice.speed:.3g} mm/s, payload {advice.experiment.payload:g} kg",
        "simulated with the servos' own law" if known else "simulated with ideal servos",
    ]
    drawing = Panels(Layout(), [2.3, 2.1] if known else [2.3], share_y=False)
    torque = drawing.axes[0]
    entries: list[Entry] = []
    for k, (joint, colour) in enumerate(zip(JOINTS, JOINT_COLOURS, strict=True)):
        at = legs + (k - 1) * (WIDTH + 0.02)
        torque.bar(at, load.peak_torque[:, k], WIDTH, color=colour, alpha=0.55)
        torque.hlines(
            load.rms_torque[:, k], at - WIDTH / 2, at + WIDTH / 2, color=INK, linewidth=1.4
        )
        entries.append((joint, {"color": colour, "linewidth": 5, "alpha": 0.7}))
        if known:
            _draw_warmth(drawing.axes[1], at, [rows[:, :, k] for rows in warmth], colour)  # type: ignore[index]
    limit: dict[str, Any] = {"color": LIMIT_COLOUR, "linewidth": 1.0}
    # One line where all joints are alike.
    for ratio in np.unique(advice.robot.arrays.strength):
        servo = advice.servo
        continuous = min(servo.continuous_torque, servo.stall_torque)
        torque.axhline(ratio * servo.stall_torque, **limit)
        torque.axhline(ratio * continuous, linestyle=(0, (4, 2)), **limit)
    torque.set_ylabel("torque [N·m]")
    entries += [
        ("rms", {"color": INK, "linewidth": 1.4}),
        ("limit", limit),
        ("continuous", limit | {"linestyle": (0, (4, 2))}),
    ]
    if known:
        axis = drawing.axes[1]
        axis.axhline(advice.servo.temperature_limit, **limit)
        after = ", ".join(f"{minutes:g}" for minutes in MINUTES)
        axis.set_ylabel(f"after {after} min [°C]")
        axis.set_ylim(bottom=advice.servo.ambient_temperature)
    names = [leg.name.replace("_", " ") for leg in advice.robot.legs]
    drawing.axes[-1].set_xticks(legs, names)
    title = f"Torque and heat of the servos, {advice.robot.name}"
    return drawing.complete(title, notes, entries, columns=6)


def _draw_warmth(axis: Any, at: np.ndarray, warmth: list[np.ndarray], colour: str) -> None:
    """Draw three bars side by side, one for each time; rows of `warmth` have shape (3, L)."""
    narrow = WIDTH / len(warmth)
    for i, ((low, expected, high), shade) in enumerate(zip(warmth, SHADES, strict=True)):
        place = at + (i - 1) * narrow
        axis.bar(place, expected, 0.9 * narrow, color=colour, alpha=shade)
        axis.vlines(place, low, high, color=INK, linewidth=0.8)
