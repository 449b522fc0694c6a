"""The whole paper in one go: walks, grades, comparisons, page and figures."""

from __future__ import annotations

from pathlib import Path

from phasmid.errors import AlreadyExists
from phasmid.interrupts import held_signals
from phasmid.paper.document import Graded, Parts, document
from phasmid.paper.equations import EQUATIONS
from phasmid.paper.evidence import Announce, Evidence
from phasmid.paper.figures import as_printed_figure, sharing_figure, stance_laws_figure
from phasmid.paper.statement import Statement
from phasmid.paper.structure import STRUCTURE
from phasmid.paper.trajectory import TRAJECTORY
from phasmid.paper.walking import WALKING
from phasmid.recording.file import cannot_write, check_new_file, check_place, write_whole
from phasmid.reporting import figures
from phasmid.reporting.style import encoded_figure

STATEMENTS: dict[str, tuple[Statement, ...]] = {
    "Structure and kinematics": STRUCTURE,
    "Equations": EQUATIONS,
    "Trajectories": TRAJECTORY,
    "Walk, torques and foot forces": WALKING,
}
"""Every statement that the paper makes about the robot, its model and its walk."""

PAGE, FOLDER = "paper.md", "paper"
"""Result of a reproduction: the page, and the folder of its figures beside it."""

RECORDED = ("fig12", "fig13", "fig14", "fig15", "fig16")
"""Names of the figures that are drawn of the walk as of any run."""

OWN_FIGURES = {
    "fig12-stance-laws": stance_laws_figure,
    "as-printed": as_printed_figure,
    "sharing": sharing_figure,
}
"""Further figures, by name."""

ROOM = 10e6
"""Room for the page and its figures, about ten times their size [bytes]."""


def reproduce(
    folder: str | Path, *, force: bool = False, announce: Announce | None = None
) -> Parts:
    """Reproduce the paper and write ``paper.md`` and the figures that it shows.

    Args:
        folder: Where the page goes, and a folder ``paper`` with its figures; it is made.
        force: Whether an earlier page and its figures are replaced.
        announce: Receives a sentence on the present work.

    Returns:
        The statements with their grades.

    Raises:
        AlreadyExists: There is such a page already.
        OutputError: The folder cannot be written.
    """
    folder = Path(folder)
    check_new_file(folder / PAGE, option="--out DIR", force=force)
    if (folder / FOLDER).exists() and not force:
        raise AlreadyExists(folder / FOLDER, option="--out DIR")
    check_place(folder / FOLDER, room=ROOM)
    evidence = Evidence(announce=announce)
    parts = {
        name: [Graded(statement, statement.measure(evidence)) for statement in statements]
        for name, statements in STATEMENTS.items()
    }
    text = document(parts, evidence)
    if announce:
        announce("drawing the figures")
    drawn = figures(evidence.walk.recording)
    drawn = {name: drawn[name] for name in RECORDED} | {
        name: draw(evidence) for name, draw in OWN_FIGURES.items()
    }
    files = {
        folder / FOLDER / f"{name}.png": encoded_figure(figure, "png")
        for name, figure in drawn.items()
    }
    try:
        (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from None
    # A page without its figures would be half-made: it comes last.
    with held_signals():
        for path, content in (files | {folder / PAGE: text.encode()}).items():
            write_whole(path, content)
    return parts
