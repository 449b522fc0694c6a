"""Figures of a case's answers, stored with a tolerance, and what differs from them."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from golden.running import HERE, Answers, Channel, is_smoke

SAMPLE_COUNT = 8
"""Samples of the coarse time series."""

DISTURBANCES = 1e-13 * np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
"""Changes of the feet's depth below the hips, which turn joints by about 1e-12 rad [m]."""

TOLERANCE_RATIO = 10.0
"""Tolerance over the spread of the disturbed runs."""

ROUNDING, SMALLEST_SCALE = 1e-9, 0.1
"""Least tolerance, as a share of the largest magnitude or of this scale: small differences of large
numbers round as those do. It allows for other processors and libraries."""

SPREAD_LIMIT, SMALLEST_SPREAD = 0.01, 1e-8
"""Largest spread as a share of the largest magnitude; below the second, the spread is rounding."""

NUMBER_SCALE = 1e-9
"""Magnitude above which a number of a text file is compared by its logarithm."""

FRACTION = re.compile(r"\d+\.\d*(?:[eE][-+]?\d+)?|\d+[eE][-+]?\d+")
"""A number in a sentence that is no whole number."""

LONGEST_TEXT = 2000
"""Longer texts are stored as their hash."""


def figures(channel: Channel) -> list[float]:
    """Return the number of absent values, rms, largest magnitude and samples.

    The samples are means over all entries, weighted from 1 to 2, so that two exchanged legs differ:
    at `SAMPLE_COUNT` times up to the last, or one without a time. Numbers of a text file are of
    very different size and count by their logarithm, so that a small one cannot change unnoticed.
    """
    values = channel.values
    if channel.dims == ("number",):
        values = np.sign(values) * np.log1p(np.abs(values) / NUMBER_SCALE)
    known = np.where(np.isfinite(values), values, 0.0)
    absent = float(values.size - np.isfinite(values).sum())
    rows = known.reshape(len(known), -1) if channel.time is not None else known.reshape(1, -1)
    if not rows.size:
        return [absent, 0.0, 0.0]
    rms, largest = float(np.sqrt(np.mean(known**2))), float(np.abs(known).max())
    times = np.linspace(0, len(rows) - 1, SAMPLE_COUNT + 1).round().astype(int)
    samples = rows[np.unique(times)[-SAMPLE_COUNT:]] @ np.linspace(1.0, 2.0, rows.shape[1])
    return [absent, rms, largest, *map(float, samples / rows.shape[1])]


def stored_path(name: str) -> Path:
    """Return the file of a case's stored figures."""
    return HERE / "stored" / f"{name}.json"


def stored_text(name: str, text: str) -> str:
    """Return a text of a case as it is stored: without fractions, which sentences round.

    Of a smoke case exit statuses are stored and what it says is not: that depends on the clock.
    """
    if is_smoke(name) and not text.isdecimal():
        return ""
    text = FRACTION.sub("#", text)
    if len(text) <= LONGEST_TEXT:
        return text
    return f"{text[:60]} … sha256 {hashlib.sha256(text.encode()).hexdigest()}"


def write(name: str, answers: list[Answers]) -> str:
    """Store the figures of a case; return why they cannot be stored.

    Args:
        name: Name of the case.
        answers: Undisturbed ones first.
    """
    first = answers[0]
    table: dict[str, list[Any]] = {}
    for label in sorted(first.channels):
        if is_smoke(name):
            table[label] = []
            continue
        rows = [figures(each.channels[label]) for each in answers if label in each.channels]
        if len(rows) < len(answers) or len({(len(row), row[0]) for row in rows}) > 1:
            return f"{label} has other values in disturbed runs: shorten the case."
        largest, spread = rows[0][2], float(np.ptp(rows, axis=0).max())
        if spread > max(SPREAD_LIMIT * largest, SMALLEST_SPREAD):
            return f"{label} spreads by {spread:.2g} of {largest:.2g}: shorten the case."
        tolerance = max(TOLERANCE_RATIO * spread, ROUNDING * max(largest, SMALLEST_SCALE))
        table[label] = [float(f"{tolerance:.1e}"), *(float(f"{x:.10g}") for x in rows[0])]
    differing = [
        label
        for label, text in first.texts.items()
        if any(
            stored_text(name, each.texts.get(label, "")) != stored_text(name, text)
            for each in answers
        )
    ]
    if differing:
        return f"{differing[0]} differs between disturbed runs: shorten the case."
    lines = ",\n".join(
        f"  {json.dumps(label)}: {json.dumps(row, separators=(',', ':'))}"
        for label, row in table.items()
    )
    texts = json.dumps(
        {label: stored_text(name, text) for label, text in sorted(first.texts.items())},
        indent=1,
        ensure_ascii=False,
    )
    stored_path(name).parent.mkdir(exist_ok=True)
    stored_path(name).write_text(f'{{"channels": {{\n{lines}\n}},\n"texts": {texts}}}\n', "utf-8")
    return ""


def differences(name: str, answers: Answers) -> list[str]:
    """Return how answers differ from the stored figures, the largest difference first."""
    stored = json.loads(stored_path(name).read_text("utf-8"))
    rows, texts = stored["channels"], stored["texts"]
    found: list[tuple[float, str]] = []
    for kind, ours, theirs in (
        ("channel", set(answers.channels), set(rows)),
        ("text", set(answers.texts), set(texts)),
    ):
        found += [(np.inf, f"{kind} {label} is new") for label in sorted(ours - theirs)]
        found += [(np.inf, f"{kind} {label} is missing") for label in sorted(theirs - ours)]
    for label in sorted(set(texts) & set(answers.texts)):
        ours = stored_text(name, answers.texts[label])
        if ours != texts[label]:
            found.append((np.inf, f"{label}: {ours!r} instead of {texts[label]!r}"))
    for label in sorted(set(rows) & set(answers.channels)) if not is_smoke(name) else ():
        tolerance, *expected = rows[label]
        got = figures(answers.channels[label])
        if len(got) != len(expected):
            found.append((np.inf, f"{label}: {len(got)} figures instead of {len(expected)}"))
            continue
        distance = np.abs(np.array(got) - expected)
        if got[0] != expected[0] or distance.max() > tolerance:
            place = 0 if got[0] != expected[0] else int(distance.argmax())
            which = (["absent", "rms", "largest"] + [f"sample {k}" for k in range(9)])[place]
            line = (
                f"{label}: {which} is {got[place]:.9g}, stored {expected[place]:.9g}, "
                f"tolerance {tolerance:.1e}"
            )
            found.append((distance.max() / max(expected[2], SMALLEST_SPREAD), line))
    return [line for _, line in sorted(found, key=lambda item: -item[0])]
