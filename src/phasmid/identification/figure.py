"""Figure of an identification: measured and simulated angles, and their difference."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from phasmid.identification.logs import LegLog
from phasmid.identification.result import Identification
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
from phasmid.robot import JOINTS

MOST_PANELS = 6
"""Most joints of logs that are drawn: the ones of the largest errors."""


Panel: TypeAlias = tuple[str, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Title, time [s], target, position and simulated angle [rad], and which are compared."""


@styled()
def identification_figure(found: Identification) -> Figure:
    """Draw the angles of the joints with the largest errors, and measured less simulated angles."""
    panels: list[Panel] = []
    for log, modelled, kept in zip(found.logs, found.simulated, found.compared, strict=True):
        is_leg = isinstance(log, LegLog)
        for j, joint in enumerate(JOINTS if is_leg else ("",)):
            columns = [
                each.reshape(len(log.time), -1)[:, j]
                for each in (log.target, log.position, modelled, kept)
            ]
            title = f"{log.name}, {joint}" if is_leg else log.name
            if columns[3].any():
                panels.append((title, log.time - log.time[0], *columns))
    panels.sort(key=_error, reverse=True)
    panels = panels[:MOST_PANELS]
    drawing = Panels(
        Layout(), [1.5] * len(panels), columns=2, share_x=True, share_y=False, left=0.9
    )
    goal: dict[str, Any] = {"color": FAINT, "linewidth": 0.8, "linestyle": (0, (4, 2))}
    measured: dict[str, Any] = {"color": INK, "linewidth": 1.6}
    simulated: dict[str, Any] = {"color": RUN_COLOURS[1], "linewidth": 1.0}
    for (left, right), (title, time, *angles, kept) in zip(drawing.rows, panels, strict=True):
        target, position, modelled = np.degrees(angles)
        left.plot(time, target, drawstyle="steps-post", **goal)
        left.plot(time, position, **measured)
        left.plot(time, modelled, **simulated)
        right.plot(time, position - modelled, color=INK, linewidth=0.6)
        right.fill_between(
            time,
            0,
            1,
            where=~kept,
            step="post",
            transform=right.get_xaxis_transform(),
            color=LACKING_COLOUR,
            linewidth=0,
        )
        left.set_title(title, loc="left")
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
    return drawing.complete("Identified servo", notes, entries)


def _error(panel: Panel) -> float:
    """Return the mean square of a panel's compared residuals [rad²]."""
    *_, position, simulated, kept = panel
    return float(np.mean((position - simulated)[kept] ** 2))
