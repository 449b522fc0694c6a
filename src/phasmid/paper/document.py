"""The page on the paper: every statement with its number, figures and comparisons."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import NamedTuple

from phasmid.paper.comparisons import (
    CREEPS,
    grips_table,
    relaxations_table,
    shares_tables,
    squeezes_table,
    table,
    variants_table,
)
from phasmid.paper.evidence import DRIVES, GAITS, SERVO_STIFFNESS, Evidence
from phasmid.paper.misprints import MISPRINTS, two_digits
from phasmid.paper.statement import RULES, Finding, Grade, Statement
from phasmid.paper.trajectory import turned_in_support
from phasmid.paper.walking import force_differences


class Graded(NamedTuple):
    """Statement with its finding."""

    statement: Statement
    finding: Finding


Parts = dict[str, list[Graded]]
"""The graded statements under their headings."""


def tally(parts: Parts) -> str:
    """Return how many statements there are of each grade, a sentence."""
    grades = [line.finding.grade for lines in parts.values() for line in lines]
    counted = Counter(grades)
    each = (f"{grade.value}: {counted[grade]}" for grade in Grade if counted[grade])
    return f"{len(grades)} statements. {' · '.join(each)}"


def document(parts: Parts, evidence: Evidence) -> str:
    """Return the page, in Markdown: the template ``page.md`` with all numbers."""
    template = Path(__file__).with_name("page.md").read_text(encoding="utf-8")
    femur, tibia = turned_in_support(evidence, "straight")
    return template.format(
        parts="".join(_part(name, lines) for name, lines in parts.items()),
        rules=table(("grade", "given where"), [(g.value, rule) for g, rule in RULES.items()]),
        count=tally(parts),
        slip=1000 * evidence.variant("coxa-only", "as-given").summary["slip"]["mean"],
        femur=femur,
        tibia=tibia,
        variants=variants_table(evidence),
        misprints=_misprints(),
        model=_model_torque(evidence),
        position=SERVO_STIFFNESS,
        own=evidence.robot.servo.stiffness,
        friction=evidence.scenario.terrain.friction,
        shares=shares_tables(evidence),
        grips=grips_table(evidence),
        squeezes=squeezes_table("joints", {drive: evidence.driven(drive) for drive in DRIVES}),
        creeps=squeezes_table(
            "friction damping", {f"{c:g} N·s/m a point": evidence.creeping(c) for c in CREEPS}
        ),
        relaxations=relaxations_table(evidence),
        more_feet=", ".join(
            f"{force_differences(evidence.gait(gait))[0]:.2f} N ({gait})" for gait in GAITS
        ),
    )


def _part(name: str, lines: list[Graded]) -> str:
    rows = []
    for statement, finding in lines:
        measured = finding.number + (f". {finding.note}" if finding.note else "")
        rows.append((statement.where, statement.says, measured, finding.grade.value))
    return f"## {name}\n\n{table(('where', 'the paper says', 'measured', 'grade'), rows)}\n\n"


def _misprints() -> str:
    rows = []
    for name in ("eq-10", "theta-3-as-fed", "eq-10-as-fed", "eq-11-sign"):
        row = next(misprint for misprint in MISPRINTS if misprint.name == name)
        rows.append((row.where, *(two_digits(1000 * extent.largest) for extent in row.cost())))
    return table(("largest error of a torque [mN·m]", "swing", "support", "random states"), rows)


def _model_torque(evidence: Evidence) -> str:
    gap = evidence.walk.summary["model_against_simulation"]["torque"]["rms_mid_stance"]
    rows = [
        (f"{number} {name.replace('_', ' ')}", *(f"{1000 * value:.1f}" for value in joints))
        for number, (name, joints) in enumerate(zip(evidence.robot.leg_names, gap, strict=True), 1)
    ]
    return table(("leg", "coxa", "femur", "tibia"), rows)
