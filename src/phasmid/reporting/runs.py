"""The runs that a figure shows, side by side: their names, colours, and what tells them apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from phasmid import units
from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.reporting.panels import LAST_CYCLES, MOST_CYCLES, shown_part
from phasmid.reporting.sheet import caption, short
from phasmid.reporting.source import Source, finite_part, read_source, run_title
from phasmid.reporting.style import RUN_COLOURS, RUN_DASHES, RUN_WIDTHS
from phasmid.scenario import option_keys
from phasmid.scenario.scenario import Scenario
from phasmid.tables import quantity

MOST_RUNS = len(RUN_COLOURS)
"""Most runs in one figure: of more nobody could tell the lines apart."""

MOST_DIFFERENCES = 3
"""Most differences that a run's label names."""


LEAST_TELLING = ("duration", "samples", "record_interval", "measured", "max_steps")
"""Fields that are named after all others."""


@dataclass(frozen=True, eq=False)
class Run:
    """One run as a figure shows it.

    Attributes:
        recording: Its finite part.
        source: The machine and the experiment behind it.
        label: What it is called beside others.
        colour: Of its lines beside others.
        dash: Of its lines beside others.
        width: Of its lines beside others [pt].
    """

    recording: Recording
    source: Source
    label: str
    colour: str
    dash: Any
    width: float

    @property
    def time(self) -> np.ndarray:
        """Of its samples [s], shape (N,)."""
        return np.asarray(self.recording["time"].values)


def gather(recordings: Sequence[Recording], labels: Sequence[str] | None = None) -> list[Run]:
    """Recordings as the runs of one figure.

    Args:
        recordings: One, or several that are compared.
        labels: What each is called; by default what it differs in, or its robot and gait.

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
    # A run without a label is called by what it differs in.
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
            RUN_COLOURS[number],
            RUN_DASHES[number],
            RUN_WIDTHS[number],
        )
        for number, (recording, source, word) in enumerate(
            zip(recordings, sources, words, strict=True)
        )
    ]


def differences(sources: Sequence[Source]) -> list[str]:
    """What each run's robot and scenario have that another's have not, in words.

    Args:
        sources: Of runs that are compared.
    """
    rows: list[list[str]] = []
    robots = [source.robot.name for source in sources]
    if len(set(robots)) > 1:
        rows.append(robots)
    # Which gait and which drive says more of a run than how long it was.
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
    """A field and its value, such as ``step length 40 mm``."""
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


def shown(runs: Sequence[Run]) -> tuple[list[Run], str]:
    """The part of each run that figures over time show, and what to say of it.

    One run is cut as `shown_part` does; several are cut at the end of the shortest, and to the
    last cycles before it.
    """
    if len(runs) == 1:
        recording, note = shown_part(runs[0].recording)
        return [replace(runs[0], recording=recording)], note
    first = max(float(run.time[0]) for run in runs)
    last = min(float(run.time[-1]) for run in runs)
    if last < first:
        raise InvalidInput("the runs have no time in common; they cannot be compared over time.")
    period = max(run.source.scenario.stride.period for run in runs)
    note = ""
    if last - first > MOST_CYCLES * period * (1 + 1e-6):
        first, note = last - LAST_CYCLES * period, f"{last - LAST_CYCLES * period:.4g}"
        note = f"{note} to {last:.4g} s"
    part = slice(first - 1e-9, last + 1e-9)
    return [replace(run, recording=run.recording.sel(time=part)) for run in runs], note


def who(runs: Sequence[Run]) -> list[str]:
    """Parts of the subtitle: who walked how; of several runs what they have in common."""
    if len(runs) == 1:
        return caption(runs[0].recording, runs[0].source)
    rows = [caption(run.recording, run.source) for run in runs]
    return [parts[0] for parts in zip(*rows, strict=True) if len(set(parts)) == 1]


def entries(runs: Sequence[Run]) -> list[tuple[str, str, Any]]:
    """Of a legend: each run's label, colour and dash."""
    return [(run.label, run.colour, run.dash) for run in runs]
