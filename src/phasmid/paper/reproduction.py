"""The whole paper in one go: walks, grades, comparisons, page and figures."""

from __future__ import annotations

from pathlib import Path

from phasmid.errors import AlreadyExists
from phasmid.paper.document import Graded, Parts, document
from phasmid.paper.equations import EQUATIONS
from phasmid.paper.evidence import Announce, Evidence
from phasmid.paper.figures import as_printed_figure, sharing_figure, stance_laws_figure
from phasmid.paper.statement import Statement
from phasmid.paper.structure import STRUCTURE
from phasmid.paper.trajectory import TRAJECTORY
from phasmid.paper.walking import WALKING
from phasmid.recording.file import cannot_write, check_new_file, write_whole
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
        "fig12-stance-laws": stance_laws_figure(evidence),
        "as-printed": as_printed_figure(evidence),
        "sharing": sharing_figure(evidence),
    }
    try:
        (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from None
    for name, figure in drawn.items():
        write_whole(folder / FOLDER / f"{name}.png", encoded_figure(figure, "png"))
    write_whole(folder / PAGE, text.encode())
    return parts
