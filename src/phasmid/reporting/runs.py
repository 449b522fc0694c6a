"""The runs of a figure: labels, line properties, and differences between their scenarios."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from phasmid import units
from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.reporting.figure_layout import Entry, caption, short
from phasmid.reporting.source import Source, channel, finite_part, read_source, run_title
from phasmid.reporting.style import RUN_LINES
from phasmid.scenario import option_keys
from phasmid.scenario.scenario import Scenario
from phasmid.tables import quantity

MOST_RUNS = len(RUN_LINES)
"""Most runs in one figure."""

MOST_CYCLES, LAST_CYCLES = 6, 5
"""Walks of more cycles than the first are drawn over the second number of last cycles."""

MOST_DIFFERENCES = 3
"""Most differences that a run's label names."""

LEAST_TELLING = ("duration", "samples", "record_interval", "measured", "max_steps")
"""Fields that are named after all others."""


@dataclass(frozen=True, eq=False)
class Run:
    """A run in a figure.

    Attributes:
        recording: Its finite part.
        source: Its robot and experiment.
        label: Its name beside others.
        line: Properties of its lines beside others.
    """

    recording: Recording
    source: Source
    label: str
    line: dict[str, Any]

    @property
    def time(self) -> np.ndarray:
        """Times of the samples [s], shape (N,)."""
        return np.asarray(self.recording["time"].values)

    def channel(self, name: str) -> np.ndarray | None:
        """Return a channel's values, or None where it is not recorded."""
        return channel(self.recording, name)


def gather(recordings: Sequence[Recording], labels: Sequence[str] | None = None) -> list[Run]:
    """Return recordings as the runs of one figure.

    Args:
        recordings: One, or several that are compared.
        labels: Name of each; by default its differences, or its robot and gait.

    Raises:
        InvalidInput: There are none or too many, or one does not carry its robot and scenario.
    """
    count = len(recordings)
    if not 1 <= count <= MOST_RUNS:
        raise InvalidInput(f"{count} runs were given; a figure shows 1 to {MOST_RUNS}.")
    if labels is not None and len(labels) != count:
        raise InvalidInput(f"{len(labels)} labels were given for {count} runs; each needs one.")
    sources = [read_source(recording) for recording in recordings]
    unlike = differences(sources)
    words = [short(name or run_title(source)) for name, source in zip(unlike, sources, strict=True)]
    if labels:
        words = [
            f"{short(label)}: {short(difference)}" if difference else short(label)
            for label, difference in zip(labels, unlike, strict=True)
        ]
    return [
        Run(
            finite_part(recording),
            source,
            f"{word}, run {number + 1}" if words.count(word) > 1 else word,
            RUN_LINES[number],
        )
        for number, (recording, source, word) in enumerate(
            zip(recordings, sources, words, strict=True)
        )
    ]


def differences(sources: Sequence[Source]) -> list[str]:
    """Return the fields of each run's robot and scenario that differ between runs, in words."""
    rows: list[list[str]] = []
    robots = [source.robot.name for source in sources]
    if len(set(robots)) > 1:
        rows.append(robots)
    for key, path in sorted(option_keys().items(), key=lambda item: item[1][-1] in LEAST_TELLING):
        if path[-1] in {"name", "description", "robot"} and len(path) == 1:
            continue
        values = [_field(source.scenario, path) for source in sources]
        if any(value != values[0] for value in values[1:]):
            rows.append([_in_words(key, path, value) for value in values])
    more = len(rows) - MOST_DIFFERENCES
    columns = [", ".join(row[k] for row in rows[:MOST_DIFFERENCES]) for k in range(len(sources))]
    return [f"{words}, and {more} more" if more > 0 else words for words in columns]


def _field(scenario: Scenario, path: tuple[str, ...]) -> Any:
    value: Any = scenario
    for part in path:
        value = getattr(value, part)
    return value


def _in_words(key: str, path: tuple[str, ...], value: Any) -> str:
    """Return a field and its value, such as ``step length 40 mm``."""
    table: Any = Scenario
    for part in path[:-1]:
        table = table.model_fields[part].annotation
    field = table.model_fields[path[-1]]
    carried = quantity(field)
    name = (path[-1] if carried else key).replace("_", " ")
    if value is None:
        return f"{name} by default"
    if isinstance(value, float | int) and not isinstance(value, bool):
        return f"{name} {units.text(value, carried.unit) if carried else format(value, '.4g')}"
    text = str(value)
    return f"{name} {text if len(text) <= 24 else f'{text[:23]}…'}"


def shown_part(runs: Sequence[Run]) -> tuple[list[Run], str]:
    """Return the part of each run that figures over time show, and a note on it.

    One run is cut to its last `LAST_CYCLES` where it has more than `MOST_CYCLES`. Several are cut
    at the end of the shortest, and to the last cycles before it.

    Raises:
        InvalidInput: The runs have no time in common.
    """
    first = max(float(run.time[0]) for run in runs)
    last = min(float(run.time[-1]) for run in runs)
    if last < first:
        raise InvalidInput("the runs have no time in common; they cannot be compared over time.")
    period = max(run.source.scenario.stride.period for run in runs)
    cycles = (last - first) / period
    note = ""
    if cycles > MOST_CYCLES + 1e-6:
        first = last - LAST_CYCLES * period
        note = f"{first:.4g} to {last:.4g} s"
        if len(runs) == 1:
            note = f"last {LAST_CYCLES} of {cycles:.4g} cycles"
    part = slice(first - 1e-9, last + 1e-9)
    return [replace(run, recording=run.recording.sel(time=part)) for run in runs], note


def shared_caption(runs: Sequence[Run]) -> list[str]:
    """Return the parts of the caption that all runs have in common."""
    rows = [caption(run.recording, run.source) for run in runs]
    return [parts[0] for parts in zip(*rows, strict=True) if len(set(parts)) == 1]


def entries(runs: Sequence[Run]) -> list[Entry]:
    """Return a legend's entry for each run."""
    return [(run.label, run.line) for run in runs]
