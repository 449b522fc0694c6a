"""Figures of a case's answers, stored with a tolerance, and what differs from them."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from golden.running import HERE, NUMBER, Answers, Channel, is_smoke

INSTANTS = 8
"""Instants of the coarse time series."""

DISTURBANCES = 1e-13 * np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
"""Changes of the feet's depth below the hips, which turn joints by about 1e-12 rad [m]."""

MARGIN = 10.0
"""Tolerance over the spread of the disturbed runs."""

ROUNDING = 1e-9
"""Least tolerance, as a share of the largest magnitude: differences of processors and libraries."""

WIDEST = 0.01
"""Largest spread of a recorded channel, as a share of its largest magnitude."""

LONGEST_TEXT = 300
"""Longer texts are stored as their hash."""


def figures(channel: Channel) -> list[float]:
    """Return rms, largest magnitude and number of absent values, and samples.

    The samples are means over all entries, weighted from 1 to 2, so that two exchanged legs differ:
    at `INSTANTS` times up to the last, or one without a time.
    """
    values = channel.values
    known = np.where(np.isfinite(values), values, 0.0)
    absent = float(values.size - np.isfinite(values).sum())
    rows = known.reshape(len(known), -1) if channel.time is not None else known.reshape(1, -1)
    if not rows.size:
        return [0.0, 0.0, absent]
    rms, largest = float(np.sqrt(np.mean(known**2))), float(np.abs(known).max())
    chosen = np.unique(np.linspace(0, len(rows) - 1, INSTANTS + 1).round().astype(int))[-INSTANTS:]
    samples = rows[chosen] @ np.linspace(1.0, 2.0, rows.shape[1]) / rows.shape[1]
    return [rms, largest, absent, *map(float, samples)]


def stored_path(name: str) -> Path:
    """Return the file of a case's stored figures."""
    return HERE / "stored" / f"{name}.json"


def _text(text: str) -> str:
    """Return a text without its numbers, of which some are rounded to few digits.

    A text that is a number alone stays: it is the exit status of a command or page.
    """
    text = text if text.lstrip("-").isdecimal() else NUMBER.sub("#", text)
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
        shapes = {each.channels[label].values.shape for each in answers}
        rows = np.array([figures(each.channels[label]) for each in answers if len(shapes) == 1])
        largest = rows[0][1] if len(rows) else 0.0
        spread = float(np.ptp(rows, axis=0).max()) if len(rows) else np.inf
        if first.channels[label].time is not None and spread > WIDEST * largest > 0:
            return f"{label} spreads by {spread:.2g} of {largest:.2g}: shorten the case."
        if spread == np.inf:
            return f"{label} has another shape in disturbed runs: shorten the case."
        tolerance = max(MARGIN * spread, ROUNDING * largest)
        table[label] = [float(f"{tolerance:.1e}"), *(float(f"{x:.10g}") for x in rows[0])]
    differing = [
        label
        for label, text in first.texts.items()
        if any(_text(each.texts[label]) != _text(text) for each in answers)
    ]
    if differing:
        return f"{differing[0]} differs between disturbed runs: shorten the case."
    lines = ",\n".join(
        f"  {json.dumps(label)}: {json.dumps(row, separators=(',', ':'))}"
        for label, row in table.items()
    )
    texts = json.dumps(
        {label: _text(text) for label, text in sorted(first.texts.items())},
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
        ours = _text(answers.texts[label])
        if ours != texts[label]:
            found.append((np.inf, f"{label}: {ours!r} instead of {texts[label]!r}"))
    for label in sorted(set(rows) & set(answers.channels)) if not is_smoke(name) else ():
        tolerance, *expected = rows[label]
        got = figures(answers.channels[label])
        if len(got) != len(expected):
            found.append((np.inf, f"{label}: {len(got)} figures instead of {len(expected)}"))
            continue
        away = np.abs(np.array(got) - expected)
        if away.max() > tolerance:
            place = int(away.argmax())
            which = ("rms", "largest", "absent")[place] if place < 3 else f"sample {place - 2}"
            line = (
                f"{label}: {which} is {got[place]:.9g}, stored {expected[place]:.9g}, "
                f"tolerance {tolerance:.1e}"
            )
            found.append((away.max() / max(expected[1], 1e-12), line))
    return [line for _, line in sorted(found, key=lambda item: -item[0])]
