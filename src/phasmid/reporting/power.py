"""Power and energy of the joints and their servos over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from phasmid.recording import Recording
from phasmid.reporting.envelope import NEEDS, torque_and_speed
from phasmid.reporting.figure_layout import Entry, panel_figure, time_axis
from phasmid.reporting.joints import SHORTEST_DISTANCE, drawn_power
from phasmid.reporting.runs import Run, shared_caption, shown_part
from phasmid.reporting.source import Source
from phasmid.reporting.style import POWER_COLOURS, Figure, styled, thin
from phasmid.reporting.travel import travel

__all__ = ["NEEDS", "Power", "power_figure", "power_of"]

KINDS: dict[str, tuple[str, Any]] = {
    "net": ("Σ τω", "-"),
    "given": ("Σ max(τω, 0)", (0, (5, 1.6))),
    "absolute": ("Σ |τω|", (0, (2, 1.4))),
    "electrical": ("from the supply", "-"),
}
"""Kinds of power: definition and dash."""

COSTS = ("given", "electrical")
"""Kinds of power whose cost of transport the subtitle states."""


@dataclass(frozen=True, eq=False)
class Power:
    """Power of all joints together.

    Attributes:
        name: A key of `KINDS`.
        power: Power of each sample [W], shape (N,).
        energy: Its integral by the trapezoidal rule [J], shape (N,).
        cost_of_transport: Energy over weight and distance; None where the distance is unknown or 0.
    """

    name: str
    power: np.ndarray
    energy: np.ndarray
    cost_of_transport: float | None


def power_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Draw the power of all joints together and, under it, its integral since the start.

    Args:
        runs: One with every kind of power, or several with the positive power of their joints.
        legs: Ignored: all legs count.

    Raises:
        InvalidInput: A channel is absent.
    """
    del legs
    parts, note = shown_part(runs)
    # Energy counts from the start of the whole run.
    found = [power_of(run.recording, run.source) for run in runs]
    alone = len(parts) == 1
    model = " by the model" if torque_and_speed(runs[0].recording)[2].endswith("_model") else ""
    costs = [f"{_cost(kind)} ({kind.name})" for kind in found[0] if kind.name in COSTS]
    cost = f"cost of transport {', '.join(costs)}" if alone else ""
    with styled():
        title = f"Power and energy of all joints{model}"
        notes = [*shared_caption(parts), cost, note]
        drawing = panel_figure(title, notes, [2.1, 1.9], share_y=False, gap=0.12)
        labels: list[Entry] = []
        for run, whole, kinds in zip(parts, runs, found, strict=True):
            rows = np.searchsorted(whole.time, run.time)
            for kind, colour in zip(kinds, POWER_COLOURS, strict=False):
                words, dash = KINDS[kind.name]
                line = {"color": colour, "linestyle": dash, "linewidth": 1.3}
                label = f"{kind.name}: {words}".replace(": from", ", from")
                if not alone:
                    if kind.name != "given":
                        continue
                    line, label = run.line, f"{run.label} · cost of transport {_cost(kind)}"
                for axis, values in zip(drawing.axes, (kind.power, kind.energy), strict=True):
                    axis.plot(*thin(run.time, values[rows]), **line)
                labels.append((label, line))
        given = "" if alone else " given"
        drawing.axes[0].set_ylabel(f"power{given} [W]")
        drawing.axes[1].set_ylabel(f"energy{given} [J]")
        time_axis(drawing.axes[1], parts[0].time)
        drawing.figure.align_ylabels(drawing.axes)
        drawing.add_legend(labels, columns=0 if alone else 1)
    return drawing.figure


def power_of(recording: Recording, source: Source) -> list[Power]:
    """Return each kind of power of joints and servos.

    Args:
        recording: A whole run, recorded or computed.
        source: Its robot and experiment.

    Returns:
        ``net``, the sum over joints of torque times speed; ``given``, that of the positive parts,
        as braking recovers nothing; ``absolute``, that of the magnitudes; and with recorded servo
        currents ``electrical``, the positive part of output times supply voltage times current.

    Raises:
        InvalidInput: A channel is absent.
    """
    tau, qd, _ = torque_and_speed(recording)
    time = np.asarray(recording["time"].values)
    way = travel(recording, source).get("distance")
    work = tau * qd
    kinds = {"net": work, "given": np.maximum(work, 0.0), "absolute": np.abs(work)}
    drawn = drawn_power(recording, source)
    if drawn is not None:
        kinds["electrical"] = drawn
    return [
        _summed(name, values.sum(axis=(1, 2)), time, source, way) for name, values in kinds.items()
    ]


def _summed(
    name: str, power: np.ndarray, time: np.ndarray, source: Source, way: float | None
) -> Power:
    means = (power[1:] + power[:-1]) / 2 * np.diff(time)
    energy = np.concatenate([[0.0], np.cumsum(means)])
    known = way is not None and way >= SHORTEST_DISTANCE
    cost = float(energy[-1]) / (source.weight * way) if known and way else None
    return Power(name, power, energy, cost)


def _cost(kind: Power) -> str:
    return "unknown" if kind.cost_of_transport is None else f"{kind.cost_of_transport:.2f}"
