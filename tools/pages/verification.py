"""The physics against closed forms: the tables of docs/verification.md, from tests/physics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

import mujoco

from physics.bench import Bench
from physics.checks import CHECKS
from physics.rows import Row

PAGE = Path(__file__).parents[2] / "docs" / "verification.md"
TABLE, REASONS, END = "## What came out", "\n- **1**", "\n\n## What the rows do not claim"


def page(measured: Mapping[int, Sequence[Row]]) -> str:
    """Return the page with the rows of each check, its prose as it is."""
    lines = ["| | check | expected | got | tolerance | |", "|---|---|---|---|---|---|"]
    reasons = []
    for number, rows in measured.items():
        title, law, _ = CHECKS[number]
        lines.append(f"| **{number}** | **{title}**: {_cell(law)} | | | | |")
        for row in rows:
            verdict = "reported" if row.tolerance is None else "passes"
            cells = (row.case, *_numbers(row), verdict if row.holds else "FAILS")
            lines.append(f"| | {' | '.join(map(_cell, cells))} |")
        reasons += _reasons(number, rows)
    text = PAGE.read_text("utf-8")
    head, intro = text[: text.index(TABLE)], text[text.index("## How each") : text.index(REASONS)]
    versions = f"phasmid {version('phasmid')}, MuJoCo {mujoco.__version__}."
    came_out = "\n\n".join([TABLE, f"{_tally(measured)} {versions}", "\n".join(lines), intro])
    return head + came_out + "\n" + "\n".join(reasons) + text[text.index(END) :]


def _tally(measured: Mapping[int, Sequence[Row]]) -> str:
    rows = [row for rows in measured.values() for row in rows]
    failed = sum(not row.holds for row in rows)
    reported = sum(row.tolerance is None and row.holds for row in rows)
    return (
        f"{len(measured)} checks, {len(rows)} numbers: {len(rows) - failed - reported} pass, "
        f"{failed} fail, {reported} are reported."
    )


def _reasons(number: int, rows: Sequence[Row]) -> list[str]:
    """Return the sources of a check's tolerances, each with its cases."""
    cases: dict[str, list[str]] = {}
    for row in rows:
        cases.setdefault(row.why, []).append(row.case)
    if len(cases) == 1:
        return [f"- **{number}**: {rows[0].why}"]
    return [f"- **{number}** ({'; '.join(named)}): {why}" for why, named in cases.items()]


def _numbers(row: Row) -> tuple[str, str, str]:
    """Return expected and measured value and tolerance; the empty text for nothing claimed."""

    def quantity(value: float) -> str:
        if value == 0:
            return "0"
        if row.tolerance is None and value.is_integer():
            return f"{value:.0f}"
        digits = f"{value:.6g}" if row.expected else f"{value:.3g}"
        return digits if row.unit == "1" else f"{digits} {row.unit}"

    if row.tolerance is None:
        return "", quantity(row.got), ""
    margin = "exact" if row.tolerance == 0 else f"± {row.tolerance:.2g}"
    return quantity(row.expected), quantity(row.got), margin


def _cell(text: str) -> str:
    """Return a text that does not end its cell."""
    return text.replace("|", "\\|")


def main() -> None:
    """Measure all rows and write the page."""
    bench = Bench()
    measured = {number: list(measure(bench)) for number, (*_, measure) in CHECKS.items()}
    PAGE.write_text(page(measured), "utf-8")
