"""Rows of the verification as text, and the page on them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from itertools import groupby
from pathlib import Path

from phasmid.verification.row import Row, Verdict


def page(rows: Sequence[Row]) -> str:
    """Return the page, in Markdown: the template ``page.md`` with the rows."""
    import mujoco

    lines = ["| | check | expected | got | tolerance | |", "|---|---|---|---|---|---|"]
    reasons = []
    for number, group in groupby(rows, key=lambda row: row.number):
        some = list(group)
        lines.append(f"| **{number}** | **{some[0].title}**: {_cell(some[0].equation)} | | | | |")
        for row in some:
            cells = (*map(_cell, (row.case or "all", *words(row))), row.verdict.value)
            lines.append(f"| | {' | '.join(cells)} |")
        reasons += _reasons(number, some)
    template = Path(__file__).with_name("page.md").read_text(encoding="utf-8")
    return template.format(
        tally=tally(rows),
        phasmid=version("phasmid"),
        mujoco=mujoco.__version__,
        table="\n".join(lines),
        reasons="\n".join(reasons),
    )


def _reasons(number: int, rows: Sequence[Row]) -> list[str]:
    """Where a check's tolerances come from, each reason once, with the cases that it is for."""
    cases: dict[str, list[str]] = {}
    for row in rows:
        cases.setdefault(row.why, []).append(row.case)
    if len(cases) == 1:
        return [f"- **{number}**: {rows[0].why}"]
    return [f"- **{number}** ({'; '.join(named)}): {why}" for why, named in cases.items()]


def tally(rows: Sequence[Row]) -> str:
    """Return how many rows there are of each verdict, a sentence."""
    counted = Counter(row.verdict for row in rows)
    checks = len({row.number for row in rows})
    verbs = {Verdict.PASSES: "pass", Verdict.FAILS: "fail", Verdict.REPORTED: "are reported"}
    each = ", ".join(
        f"{counted[verdict]} {verb}"
        for verdict, verb in verbs.items()
        if counted[verdict] or verdict is Verdict.FAILS
    )
    return f"{checks} check{'s' * (checks != 1)}, {len(rows)} numbers: {each}."


def words(row: Row) -> tuple[str, str, str]:
    """Return expected value, measured value and tolerance as texts; empty where nothing is claimed.

    Zeros stand without a unit, since nothing of anything is nothing.
    """

    def quantity(value: float) -> str:
        if not math.isfinite(value):
            return "none"
        if value == 0:
            return "0"
        if row.tolerance is None and value.is_integer():
            return f"{value:.0f}"
        # Of what shall be nothing, the size is enough.
        digits = f"{value:.6g}" if row.expected else f"{value:.3g}"
        return digits if row.unit == "1" else f"{digits} {row.unit}"

    if row.tolerance is None:
        return "", quantity(row.got), ""
    margin = "exact" if row.tolerance == 0 else f"± {row.tolerance:.2g}"
    return quantity(row.expected), quantity(row.got), margin


def _cell(text: str) -> str:
    """Return a text that does not end its cell."""
    return text.replace("|", "\\|")
