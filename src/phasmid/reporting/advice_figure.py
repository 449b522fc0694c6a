"""Figures of an advice: load of the joints over a cycle, and temperature over time."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.advice import Advice
from phasmid.advice.verdict import warming_power
from phasmid.reporting.panels import Entry, Panels
from phasmid.reporting.style import INK, JOINT_COLOURS, LIMIT_COLOUR, Figure, Layout, styled
from phasmid.robot import JOINTS
from phasmid.servo.heat import temperature_after
from phasmid.servo.words import servo_label

MINUTES = 60.0
"""Time over which temperatures are drawn [min]."""


@styled()
def advice_figure(advice: Advice) -> Figure:
    """Draw the load of the joints over a cycle and the temperature of the warmest servo.

    Bands reach from the best help of the floor to none. The load of a kind of joint is the largest
    share of its stall torque over the legs.
    """
    verdict, loads = advice.verdict, advice.loads
    notes = [
        f"{servo_label(verdict.servo)} at {verdict.voltage:g} V, {verdict.gait} gait, "
        f"{1000 * advice.speed:.3g} mm/s, payload {1000 * advice.experiment.payload:g} g",
        "solid: no help from the floor; dashed: its best help",
    ]
    losses, servo = warming_power(loads), advice.robot.servo
    known = losses is not None
    drawing = Panels(Layout(), [2.3, 2.1] if known else [2.3], share_x=False, share_y=False)
    limit: dict[str, Any] = {"color": LIMIT_COLOUR, "linewidth": 1.0}
    entries: list[Entry] = []
    load = drawing.axes[0]
    walks = loads.postures.weight > 0
    phase = 100 * loads.postures.phase[walks]
    for k, (joint, colour) in enumerate(zip(JOINTS, JOINT_COLOURS, strict=True)):
        share = loads.share[:, walks][..., k]
        high, low = 100 * np.nanmax(share, axis=2)
        load.fill_between(phase, low, high, color=colour, alpha=0.25, linewidth=0)
        load.plot(phase, high, color=colour)
        load.plot(phase, low, "--", color=colour, linewidth=1.0)
        entries.append((joint, {"color": colour, "linewidth": 5, "alpha": 0.7}))
    load.axhline(100, **limit)
    load.set_ylabel("share of stall torque [%]")
    load.set_xlabel("part of the cycle [%]")
    load.set_ylim(bottom=0)
    load.set_title("largest load of each kind of joint, at rest")
    load.set_xlim(phase[0], phase[-1])
    entries.append(("limit", limit))
    if losses is not None:
        axis, air = drawing.axes[1], servo.ambient_temperature
        minutes = np.linspace(0, MINUTES, 200)
        hot, cool = np.array([temperature_after(servo, 60 * t, air, losses) for t in minutes]).T
        axis.fill_between(minutes, cool, hot, color=INK, alpha=0.2, linewidth=0)
        axis.plot(minutes, hot, color=INK)
        axis.plot(minutes, cool, "--", color=INK, linewidth=1.0)
        axis.axhline(verdict.temperature_limit, **limit)
        axis.set_ylabel("warmest servo [°C]")
        axis.set_xlabel("time of walking or standing [min]")
        axis.set_xlim(0, MINUTES)
        axis.set_title("heat, from cold")
        # A servo beyond its limit has shut down, or burnt.
        axis.set_ylim(verdict.ambient_temperature, verdict.temperature_limit + 15)
    title = f"Load and heat of the servos, {advice.robot.name}"
    return drawing.complete(title, notes, entries, columns=4)
