"""Equal findings of several links, joints or legs, as one finding."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from phasmid.formats.findings import Finding

NAMED = 3
"""Number of subjects that are named before the rest is counted."""


def grouped(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Group findings that differ in subject and place alone.

    Args:
        findings: As they were found.
    """
    alike: dict[tuple[object, ...], list[Finding]] = {}
    for finding in findings:
        noun = finding.subject.partition(" ")[0]
        key = (finding.severity, noun, finding.what, finding.hint)
        alike.setdefault(key, []).append(finding)
    return tuple(
        group[0]
        if len(group) == 1
        else replace(group[0], subject=_subjects(noun, [f.subject for f in group]))
        for (_, noun, *_), group in alike.items()
    )


def _subjects(noun: object, subjects: list[str]) -> str:
    names = list(dict.fromkeys(subject.partition(" ")[2] for subject in subjects))
    if len(names) == 1:
        return subjects[0]
    numbers = [int(name) for name in names if name.isdigit()]
    if len(numbers) == len(names) > 2 and numbers == list(range(numbers[0], numbers[-1] + 1)):
        return f"{noun}s {numbers[0]} to {numbers[-1]}"
    if len(names) > NAMED + 1:
        return f"{noun}s {', '.join(names[:NAMED])} and {len(names) - NAMED} more"
    return f"{noun}s {', '.join(names[:-1])} and {names[-1]}"
