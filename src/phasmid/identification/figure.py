"""Figure of an identification: measured and simulated angles, and their difference."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.identification.fit import SETTLING, Identification
from phasmid.reporting.panels import Entry, Panels
from phasmid.reporting.style import (
    FAINT,
    INK,
    LACKING_COLOUR,
    RUN_COLOURS,
    Figure,
    Layout,
    styled,
)

MOST_LOGS = 6
"""Most logs that are drawn: the ones of the largest errors."""


@styled()
def identification_figure(found: Identification) -> Figure:
    """Draw the angles of the logs with the largest errors, and measured less simulated angles."""
    errors = [float(np.sqrt(np.mean(r**2))) for r in found.residuals]
    chosen = sorted(np.argsort(errors)[::-1][:MOST_LOGS].tolist())
    drawing = Panels(
        Layout(), [1.5] * len(chosen), columns=2, share_x=True, share_y=False, left=0.9
    )
    goal: dict[str, Any] = {"color": FAINT, "linewidth": 0.8, "linestyle": (0, (4, 2))}
    measured: dict[str, Any] = {"color": INK, "linewidth": 1.6}
    simulated: dict[str, Any] = {"color": RUN_COLOURS[1], "linewidth": 1.0}
    for (left, right), i in zip(drawing.rows, chosen, strict=True):
        log, time = found.logs[i], found.logs[i].time - found.logs[i].time[0]
        left.plot(time, np.degrees(log.target), drawstyle="steps-post", **goal)
        left.plot(time, np.degrees(log.position), **measured)
        left.plot(time, np.degrees(found.simulated[i]), **simulated)
        right.plot(time, np.degrees(found.residuals[i]), color=INK, linewidth=0.6)
        right.axvspan(0, SETTLING, color=LACKING_COLOUR, linewidth=0)
        left.set_title(log.name, loc="left")
        left.set_ylabel("angle [°]")
        right.set_title("measured − simulated [°]", loc="left")
    for axis in drawing.rows[-1]:
        axis.set_xlabel("time [s]")
    entries: list[Entry] = [
        ("goal", goal),
        ("measured", measured),
        ("simulated", simulated),
        ("not compared", {"color": LACKING_COLOUR, "linewidth": 6}),
    ]
    notes = [
        f"{found.servo.name}, model {found.model}",
        f"rms error {np.degrees(found.rms_error):.2f}°",
    ]
    return drawing.complete("Identified servo on the bench", notes, entries)
