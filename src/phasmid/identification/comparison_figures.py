"""Figures of a comparison: joint angles of one leg, errors of all joints, and their spectrum."""

from __future__ import annotations

from typing import Any

import numpy as np

from phasmid.identification.comparison import Comparison
from phasmid.reporting.panels import Entry, Panels, time_axis
from phasmid.reporting.style import FAINT, RUN_COLOURS, Figure, Layout, styled
from phasmid.robot import JOINTS

TARGET: dict[str, Any] = {"color": FAINT, "linewidth": 1.0, "linestyle": (0, (4, 2))}
ROBOT: dict[str, Any] = {"color": RUN_COLOURS[1], "linewidth": 1.6}
SIMULATION: dict[str, Any] = {"color": RUN_COLOURS[0], "linewidth": 1.3}
FITTED: dict[str, Any] = {"color": RUN_COLOURS[2], "linewidth": 1.1, "linestyle": (0, (2.2, 1.4))}

LONGEST_SHOWN = 2.5
"""Longest time shown of joint angles [s]."""

WIDTH = 0.38
"""Width of a bar [distances between legs]."""

HIGHEST_FREQUENCY = 25.0
"""Highest frequency shown [Hz]."""


def comparison_figures(comparison: Comparison) -> dict[str, Figure]:
    """Return the figures of a comparison by name."""
    return {
        "angles": angles_figure(comparison),
        "errors": errors_figure(comparison),
        "spectrum": spectrum_figure(comparison),
    }


def _errors(comparison: Comparison, simulated: np.ndarray) -> np.ndarray:
    """Return log minus replay where samples are compared [°], shape (M, L, 3)."""
    error = comparison.log.position - simulated
    return np.asarray(np.degrees(error[comparison.used]))


def _notes(comparison: Comparison) -> list[str]:
    """Return the parts of the subtitle."""
    return [
        f"log {comparison.log.name}",
        comparison.robot.name,
        f"rms error {np.degrees(comparison.error):.2g}°, "
        f"{np.degrees(comparison.rest):.2g}° with the fitted servo",
    ]


@styled()
def angles_figure(comparison: Comparison) -> Figure:
    """Draw target, robot, simulation and fitted simulation of the leg with the largest error."""
    log, robot = comparison.log, comparison.robot
    error = _errors(comparison, comparison.simulated)
    leg = int(np.nanmean(error**2, axis=(0, 2)).argmax())
    shown = comparison.used & (log.time <= log.time[comparison.used][0] + LONGEST_SHOWN)
    time = log.time[shown]
    drawing = Panels(Layout(), [1.7] * 3, share_y=False)
    for k, axis in enumerate(drawing.axes):
        axis.plot(time, np.degrees(log.target[shown, leg, k]), **TARGET)
        # Of a servo bus each row has readings of some joints, each with a time of its own.
        read = shown & np.isfinite(log.position[:, leg, k])
        times = log.time if log.read_time is None else log.read_time[:, leg, k]
        for angles, look in (
            (log.position, ROBOT),
            (comparison.simulated, SIMULATION),
            (comparison.fitted, FITTED),
        ):
            axis.plot(times[read], np.degrees(angles[read, leg, k]), **look)
        axis.set_ylabel(f"{JOINTS[k]} [°]")
    time_axis(drawing.axes[-1], time)
    entries: list[Entry] = [
        ("target", TARGET),
        ("robot", ROBOT),
        ("simulation", SIMULATION),
        ("fitted simulation", FITTED),
    ]
    name = robot.legs[leg].name.replace("_", " ")
    return drawing.complete(f"Joint angles of the {name} leg", _notes(comparison), entries)


@styled()
def errors_figure(comparison: Comparison) -> Figure:
    """Draw the root mean square of log minus simulation, before and after the fit."""
    robot = comparison.robot
    legs = np.arange(len(robot.legs))
    drawing = Panels(Layout(), [1.5] * 3, share_y=True)
    for side, (simulated, look) in enumerate(
        ((comparison.simulated, SIMULATION), (comparison.fitted, FITTED))
    ):
        rms = np.sqrt(np.nanmean(_errors(comparison, simulated) ** 2, axis=0))
        for k, axis in enumerate(drawing.axes):
            axis.bar(legs + (side - 0.5) * WIDTH, rms[:, k], 0.94 * WIDTH, color=look["color"])
            axis.set_ylabel(f"{JOINTS[k]} [°]")
    names = [leg.name.replace("_", " ") for leg in robot.legs]
    drawing.axes[-1].set_xticks(legs, names)
    drawing.axes[-1].set_xlim(-0.5, len(legs) - 0.5)
    entries: list[Entry] = [
        ("robot minus simulation, rms", {"color": SIMULATION["color"], "linewidth": 5}),
        ("robot minus fitted simulation", {"color": FITTED["color"], "linewidth": 5}),
    ]
    return drawing.complete("Error of every joint", _notes(comparison), entries)


@styled()
def spectrum_figure(comparison: Comparison) -> Figure:
    """Draw the amplitudes over frequency of motion and errors, rms over all legs."""
    log = comparison.log
    time = log.time[comparison.used]
    step = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1], step)
    frequency = np.fft.rfftfreq(len(even), step)
    shown = (frequency > 0) & (frequency <= HIGHEST_FREQUENCY)
    window = np.hanning(len(even))

    def amplitude(angles: np.ndarray) -> np.ndarray:
        signal = np.array(
            [
                np.interp(even, time[np.isfinite(each)], each[np.isfinite(each)])
                for each in angles.reshape(len(time), -1).T
            ]
        )
        signal -= signal.mean(axis=1, keepdims=True)
        spectrum = np.abs(np.fft.rfft(signal * window, axis=1)) * 2 / window.sum()
        each = spectrum.reshape(-1, 3, len(frequency))
        return np.asarray(np.sqrt((each**2).mean(axis=0))[:, shown])

    drawing = Panels(Layout(), [1.6] * 3, share_y=True)
    for angles, look in (
        (np.degrees(log.position[comparison.used]), ROBOT),
        (_errors(comparison, comparison.simulated), SIMULATION),
        (_errors(comparison, comparison.fitted), FITTED),
    ):
        for k, (axis, line) in enumerate(zip(drawing.axes, amplitude(angles), strict=True)):
            axis.loglog(frequency[shown], line, **look)
            axis.set_ylabel(f"{JOINTS[k]} [°]")
            for one in (axis.xaxis, axis.yaxis):
                one.set_major_formatter("{x:g}")
                one.set_minor_formatter("")
    drawing.axes[-1].set_xlabel("frequency [Hz]")
    entries: list[Entry] = [
        ("robot", ROBOT),
        ("robot minus simulation", SIMULATION),
        ("robot minus fitted simulation", FITTED),
    ]
    return drawing.complete("Amplitude of motion and error", _notes(comparison), entries)
