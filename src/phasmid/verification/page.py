"""Page on the verification: table of the checks, and the derivation of their tolerances."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from itertools import groupby

from phasmid.verification.row import Row, Verdict

_PAGE = """\
# The physics, verified

This page is written by `make verify`. `phasmid verify` prints the same table on any machine in
about half a minute, `phasmid verify --explain` with the reason for each tolerance; it ends with
status 1 where a row fails. `phasmid.verify()` returns the rows.

Every row is an experiment with a known outcome: a closed form, a conservation law, or an
independent calculation. Where a row is about the robot, it is the robot that users run:
its model, its four contact points a foot, its integrator and its loop.

A test breaks the physics under each row that has a tolerance, with the same settings, and requires
that the row fails. A largest value over no samples would pass: such rows count their samples, and a
count of 0 fails.

## What came out

{tally} phasmid {phasmid}, MuJoCo {mujoco}.

{table}

## How each tolerance comes about

A tolerance is derived, never fitted: from round-off (2e-16 of the numbers that are summed), from
the order of the integrator and the time step, or from what the law leaves out. No row is weaker
than the project's charter of physics tests asks for.

{reasons}

## What the rows do not claim

- **Rows without a tolerance are reported.** The model's torques differ from the simulated ones by
  row 30, because statics does not determine internal forces of the feet ([forces](forces.md)).
  No row compares with the torques of a real robot: nothing here was measured on one.
- **Servo limits.** Row 21 walks with 4 kg more at a period of 0.6 s and sweeps the coxas in the
  air, so that the servos saturate. Ideal servos and joints driven by torque take any goal: the plan
  keeps their joints in range. The servo's own law clamps the goal, not the joint, which passes it
  by less than a step of the position sensor.
- **Creep.** Friction that sticks is a damper of `friction_damping` for each point; row 17 states
  the speed. With 5000 N·s/m a point creep is below 1e-4 m/s, at the price of internal forces
  between the feet that fade more slowly ([architecture](architecture.md)).
- **Fast slides.** A point that slips by v is pushed up by μ · `damping` · v besides its spring, as
  engines with convex contact have it. From a slip of load / (μ · `damping`) on, about 0.1 m/s for
  the paper's robot, feet hop: mean forces and ways stay right (row 18), forces of single instants
  do not.
- **The beginning and end of a slide.** Along the ground a point resists its own acceleration with
  `friction_damping` / `damping` times the mass with which it does so upwards, 1.5 kg on the paper's
  robot. Friction therefore comes and goes within 5 ms, and a stop is longer by 0.1 mm.
- **Bouncing feet.** What that mass gives at a touchdown askew, the damper must take: with 20 N·s/m
  and more no impact gained energy (row 20, 30 N·s/m), with 15 and less some did.
- **The engine's solver** stops by its own tolerance, which leaves up to 1 mN unbalanced at single
  instants (row 12 reports it for four); solved to the end, forces and accelerations agree to
  round-off.
- **Time step.** Row 28 is for the paper's walk. `phasmid walk --check-time-step` makes the same
  comparison for any other.
- **Bits** are repeated on one machine with one set of packages (row 29). Other processors and other
  versions of the engine round otherwise.
"""


def page(rows: Sequence[Row]) -> str:
    """Return the page, in Markdown."""
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
    return _PAGE.format(
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
