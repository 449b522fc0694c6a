"""Findings about a robot's description."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum

from phasmid.errors import PhasmidError
from phasmid.units import plain_number

NAMED = 3
"""Number of subjects that are named before the rest is counted."""


class Severity(Enum):
    """Severity of a finding; the value is the word in tables."""

    IMPOSSIBLE = "impossible"
    SUSPECT = "suspect"
    NOTE = "note"


@dataclass(frozen=True)
class Finding:
    """One finding about a description.

    Attributes:
        severity: ``IMPOSSIBLE``: the robot cannot walk. ``SUSPECT``: the number is unlikely.
            ``NOTE``: something was ignored, assumed or rounded.
        subject: Its subject, such as ``link tibia_rf``.
        what: One sentence, with the value and the limit.
        where: File and line; empty if unknown.
        hint: One thing to try; empty without one.
    """

    severity: Severity
    subject: str
    what: str
    where: str = ""
    hint: str = ""

    @property
    def sentence(self) -> str:
        """Subject and finding, such as ``leg 3: no foot in the file; ...``."""
        if self.what.startswith(self.subject):
            return self.what
        return f"{self.subject}: {self.what}"


class Findings(list[Finding]):
    """List of findings with a method for each severity; arguments are those of `Finding`."""

    def note(self, subject: str, what: str, where: str = "", hint: str = "") -> None:
        """Add a note."""
        self.append(Finding(Severity.NOTE, subject, what, where, hint))

    def suspect(self, subject: str, what: str, where: str = "", hint: str = "") -> None:
        """Add a suspect number."""
        self.append(Finding(Severity.SUSPECT, subject, what, where, hint))

    def impossible(self, subject: str, what: str, where: str = "", hint: str = "") -> None:
        """Add an impossible number."""
        self.append(Finding(Severity.IMPOSSIBLE, subject, what, where, hint))

    @contextmanager
    def refusals(self, subject: str, where: str = "") -> Iterator[None]:
        """Turn an error into an impossible finding, so that what follows is judged, too."""
        try:
            yield
        except PhasmidError as error:
            what = error.what.removeprefix(f"{subject}: ")
            self.impossible(subject, what, error.where or where, error.hint)

    @property
    def any_impossible(self) -> bool:
        """There is a finding for which the robot cannot walk."""
        return any(finding.severity is Severity.IMPOSSIBLE for finding in self)

    def note_ignored(self, ignored: Counter[str], file: str) -> None:
        """Note how many elements of each tag were not read."""
        if not ignored:
            return
        listed = ", ".join(f"{n} <{tag}>" for tag, n in sorted(ignored.items())[:20])
        what = f"{listed} {'was' if ignored.total() == 1 else 'were'} ignored."
        self.note(f"file {file}", what, file)


def grouped(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Merge findings that differ in subject and place only; the subjects are listed."""
    alike: dict[tuple[object, ...], list[Finding]] = {}
    for finding in findings:
        noun = finding.subject.partition(" ")[0]
        alike.setdefault((finding.severity, noun, finding.what, finding.hint), []).append(finding)
    return tuple(
        replace(group[0], subject=_listed([f.subject for f in group])) for group in alike.values()
    )


def _listed(subjects: list[str]) -> str:
    noun = subjects[0].partition(" ")[0]
    names = list(dict.fromkeys(subject.partition(" ")[2] for subject in subjects))
    if len(names) == 1:
        return subjects[0]
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"{noun}s {', '.join(names[:NAMED])}{more}"


def mm(length: float) -> str:
    """Return a length [m] in millimetres, for a message."""
    return f"{plain_number(1000 * length, 3)} mm"
