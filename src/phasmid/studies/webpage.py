"""A study's page: one HTML file that needs nothing else."""

from __future__ import annotations

import math
from html import escape
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
import pandas as pd

from phasmid.errors import plain
from phasmid.reporting.webpage import content_policy, own_text
from phasmid.reporting.webpage.packing import json_block, packed
from phasmid.studies.results import StudyResults, causes

BINS = 8
"""Groups of equal size into which sampled ranges are divided for main effects."""

MOST_CAUSES = 12
"""Causes of failures that the page lists."""


def study_page(results: StudyResults, command: str) -> str:
    """Return a study's page: scatter plot, parallel coordinates, main effects, best runs, failures.

    Args:
        results: The rows.
        command: Command that made the study, to which ``--only`` and a run's number are added.
    """
    study, table = results.study, results.table
    done = table[table["status"] == "done"]
    metrics = [metric.name for metric in study.metrics]
    axes = [*study.axes, *(["seed"] if study.seeds else [])]
    best = results.best_numbers
    scene = {
        "command": command,
        "count": len(done),
        "axes": [_column(done[name], name) for name in axes],
        "metrics": [_column(done[name], name) for name in metrics],
        "number": packed(done["number"].to_numpy(), "u32"),
        "recordings": {
            str(row.number): row.recording for row in done.itertuples() if row.recording
        },
        "endings": _column(done["ending"], "ending"),
        "best": best,
        "objectives": [] if study.search is None else study.search.objectives,
        "effects": {axis: main_effects(done, axis, metrics) for axis in study.axes},
    }
    style = "".join(map(own_text, ("colours.css", "style.css"))) + _own("study.css")
    script = own_text("algebra.js") + own_text("plotting.js") + _own("study.js")
    return Template(_own("study.html")).substitute(
        policy=content_policy(style, script),
        title=escape(f"{study.name} · phasmid"),
        style=style,
        script=script,
        name=escape(study.name),
        description=escape(_sentence(results)),
        failures=failure_table(table),
        version=escape(str(table["phasmid_version"].iloc[0])),
        scene=json_block(scene),
    )


def _own(name: str) -> str:
    return (Path(__file__).with_name("page") / name).read_text(encoding="utf-8")


def _sentence(results: StudyResults) -> str:
    """Return what was run, in a sentence or two."""
    study, table = results.study, results.table
    kinds = {
        "plan": "planned walks with inverse dynamics",
        "simulate": "simulated walks",
        "drive": "driven walks",
    }
    how = f"chosen by {study.search.algorithm}" if study.search else f"sampler {study.sampler}"
    failed = int((table["status"] == "failed").sum())
    text = f"{len(table)} {kinds[study.kind]} of the scenario “{study.scenario}”, {how}"
    if study.seeds:
        text += f", {len(study.seeds)} seeds each"
    text += f"; {failed} failed." if failed else "; none failed."
    return f"{study.description} {text}".strip()


def _column(values: pd.Series[Any], name: str) -> dict[str, Any]:
    """Return a column as numbers, or as texts with the index of each."""
    if values.dtype.kind in "biuf":
        return {"name": name, "data": packed(values.to_numpy(float), "f32")}
    texts = sorted({str(value) for value in values})
    codes = {text: code for code, text in enumerate(texts)}
    found = np.array([codes[str(value)] for value in values])
    return {"name": name, "texts": [plain(text) for text in texts], "data": packed(found, "u16")}


def main_effects(done: pd.DataFrame, axis: str, metrics: list[str]) -> dict[str, Any]:
    """Return the mean of each metric at each value of an axis, with its 95 % interval over seeds.

    A sampled range is divided into groups of equal size. The interval is Student's, of the means of
    each seed; without several seeds there is none.
    """
    from scipy.stats import t

    values = done[axis]
    labels: list[Any] = sorted(values.unique().tolist())
    groups = values
    if values.dtype.kind in "iuf" and len(labels) > 2 * BINS:
        order = values.rank(method="first")
        groups = np.ceil(order * BINS / len(values)).astype(int)
        labels = [float(values[groups == group].mean()) for group in sorted(groups.unique())]
    found: dict[str, Any] = {"labels": labels}
    for name in metrics:
        means = done.groupby(groups)[name].mean()
        halves: list[float | None] = [None] * len(means)
        if "seed" in done and done["seed"].nunique() > 1:
            by_seed = done.groupby([groups, "seed"])[name].mean().groupby(level=0)
            count = by_seed.count()
            half = by_seed.std() / np.sqrt(count) * t.ppf(0.975, np.maximum(count - 1, 1))
            halves = [float(h) if math.isfinite(h) else None for h in half]
        found[name] = [[float(mean), half] for mean, half in zip(means, halves, strict=True)]
    return found


def failure_table(table: pd.DataFrame) -> str:
    """Return the causes of failed runs as a table."""
    failed = table[table["status"] == "failed"]
    if failed.empty:
        return "<p>No run failed.</p>"
    groups = causes(failed)
    rows = ""
    for count, first in groups[:MOST_CAUSES]:
        cells = str(count), str(first["number"]), escape(plain(str(first["error"])))
        rows += f"<tr>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"
    if len(groups) > MOST_CAUSES:
        rows += f"<tr><td></td><td></td><td>{len(groups) - MOST_CAUSES} more causes</td></tr>"
    return (
        '<div class="scrolls"><table><thead>'
        "<tr><th>runs</th><th>first</th><th>cause (of the first)</th></tr>"
        f"</thead><tbody>{rows}</tbody></table></div>"
    )
