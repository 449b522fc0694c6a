"""Power and energy of the joints and their servos, over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from phasmid.recording import Recording
from phasmid.reporting.envelope import NEEDS, torque_and_speed
from phasmid.reporting.joints import SHORTEST_WAY, drawn_power
from phasmid.reporting.panels import time_axis
from phasmid.reporting.runs import Run, shown, who
from phasmid.reporting.sheet import legend, sheet
from phasmid.reporting.source import Source
from phasmid.reporting.style import POWER_COLOURS, Figure, styled, thin
from phasmid.reporting.travel import travel

__all__ = ["NEEDS", "Power", "power_figure", "power_of"]

KINDS = {
    "net": ": Σ τω",
    "given": ": Σ max(τω, 0)",
    "absolute": ": Σ |τω|",
    "electrical": ", from the supply",
}
"""Each kind of power, and what it is."""

DASHES: tuple[Any, ...] = ("-", (0, (5, 1.6)), (0, (2, 1.4)), "-")


@dataclass(frozen=True, eq=False)
class Power:
    """What all joints together did.

    Attributes:
        name: In words.
        power: At each sample [W], shape (N,).
        energy: Since the first sample, by the trapezoidal rule [J], shape (N,).
        cost_of_transport: Energy over weight and way; None where the way is not known or none.
    """

    name: str
    power: np.ndarray
    energy: np.ndarray
    cost_of_transport: float | None


def power_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Power of all joints together and, under it, the energy since the run began.

    Args:
        runs: One with every kind of power, or several with what their joints gave.
        legs: All of them count, whichever are named.

    Raises:
        InvalidInput: A channel is absent.
    """
    del legs
    parts, note = shown(runs)
    found = [power_of(run.recording, run.source) for run in runs]
    alone = len(parts) == 1
    model = " by the model" if torque_and_speed(runs[0].recording)[2].endswith("_model") else ""
    told = f"cost of transport {_cost(found[0][1])} (given)" if alone else ""
    electric = found[0][3:]
    if alone and electric:
        told += f", {_cost(electric[0])} (electrical)"
    with styled():
        drawing = sheet(
            f"Power and energy of all joints{model}",
            [*who(parts), told, note],
            [2.1, 1.9],
            share_y=False,
            legend_rows=1 if alone else len(parts),
            gap=0.12,
        )
        above, below = drawing.axes
        labels: list[tuple[str, str, Any]] = []
        for run, whole, kinds in zip(parts, runs, found, strict=True):
            rows = np.searchsorted(whole.time, run.time)
            for number, kind in enumerate(kinds if alone else kinds[1:2]):
                colour = POWER_COLOURS[number] if alone else run.colour
                dash = DASHES[number] if alone else run.dash
                line: dict[str, Any] = {"color": colour, "linestyle": dash}
                line["linewidth"] = 1.3 if alone else run.width
                above.plot(*thin(run.time, kind.power[rows]), **line)
                below.plot(*thin(run.time, kind.energy[rows]), **line)
                labels.append((f"{kind.name}{KINDS[kind.name]}", colour, dash))
        if not alone:
            labels = []
            for run, kinds in zip(parts, found, strict=True):
                cost = _cost(kinds[1])
                labels.append((f"{run.label} · cost of transport {cost}", run.colour, run.dash))
        above.set_ylabel("power [W]" if alone else "power given [W]")
        below.set_ylabel("energy [J]" if alone else "energy given [J]")
        time_axis(below, parts[0].recording, shaded=False)
        drawing.figure.align_ylabels(drawing.axes)
        widths = [] if alone else [run.width for run in parts]
        legend(drawing, labels, columns=0 if alone else 1, widths=widths)
    return drawing.figure


def power_of(recording: Recording, source: Source) -> list[Power]:
    """What joints and servos gave, kind by kind.

    Args:
        recording: What was seen, or computed; all of a run.
        source: The experiment.

    Returns:
        ``net``, the sum over joints of torque times speed; ``given``, of its positive parts, as
        nothing is won back from a joint that brakes; ``absolute``, of its sizes; and where the
        servos' currents are known ``electrical``, the sum of output times supply voltage times
        current, of its positive parts for the same reason.

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
    known = way is not None and way >= SHORTEST_WAY
    cost = float(energy[-1]) / (source.weight * way) if known and way else None
    return Power(name, power, energy, cost)


def _cost(kind: Power) -> str:
    return "unknown" if kind.cost_of_transport is None else f"{kind.cost_of_transport:.2f}"
