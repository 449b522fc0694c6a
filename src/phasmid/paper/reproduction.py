"""The whole paper in one go: walks, grades, comparisons, page and figures."""

from __future__ import annotations

import secrets
import shutil
from pathlib import Path

import numpy as np

from phasmid.errors import AlreadyExists, InvalidInput, OutputError
from phasmid.forces import FORCE_MODELS
from phasmid.paper.document import Graded, Results, document
from phasmid.paper.equations import EQUATIONS
from phasmid.paper.evidence import GAITS, Announce, Evidence
from phasmid.paper.figures import as_printed_figure, sharing_figure, stance_laws_figure
from phasmid.paper.sharing import (
    compare_creeps,
    compare_grips,
    compare_models,
    compare_relaxations,
    compare_squeezes,
)
from phasmid.paper.statement import Statement
from phasmid.paper.structure import STRUCTURE
from phasmid.paper.trajectory import TRAJECTORY
from phasmid.paper.variants import compare_variants
from phasmid.paper.walking import WALKING, force_differences
from phasmid.reporting import figures
from phasmid.reporting.style import Figure, save_figure

STATEMENTS: dict[str, tuple[Statement, ...]] = {
    "Structure and kinematics": STRUCTURE,
    "Equations": EQUATIONS,
    "Trajectories": TRAJECTORY,
    "Walk, torques and foot forces": WALKING,
}
"""Every statement that the paper makes about the robot, its model and its walk."""

PAGE, FOLDER = "paper.md", "paper"
"""Result of a reproduction: the page, and the folder of its figures beside it."""

FIGURES = (
    "fig12",
    "fig13",
    "fig14",
    "fig15",
    "fig16",
    "fig12-stance-laws",
    "as-printed",
    "sharing",
)
"""The figures' names, all ``.png``."""


def measure(evidence: Evidence) -> Results:
    """Grade every statement and make every comparison."""
    parts = {
        name: [Graded(statement, statement.measure(evidence)) for statement in statements]
        for name, statements in STATEMENTS.items()
    }
    against = evidence.walk.summary["model_against_simulation"]["torque"]["rms_mid_stance"]
    return Results(
        parts,
        compare_variants(evidence),
        compare_models(evidence, FORCE_MODELS),
        compare_grips(evidence, FORCE_MODELS),
        compare_squeezes(evidence),
        compare_creeps(evidence),
        compare_relaxations(evidence),
        {gait: force_differences(evidence.gait(gait))[0] for gait in GAITS},
        np.array(against),
    )


def reproduce(
    folder: str | Path, *, force: bool = False, announce: Announce | None = None
) -> Results:
    """Reproduce the paper and write ``paper.md`` and the figures that it shows.

    Args:
        folder: Where the page goes, and a folder ``paper`` with its figures; it is made.
        force: Whether an earlier page and its figures are replaced.
        announce: Receives a sentence on the present work.

    Returns:
        All grades and comparisons.

    Raises:
        InvalidInput: There is such a page already, or something else in its place.
        OutputError: The folder cannot be written; the figures of an earlier page are kept.
    """
    folder = Path(folder)
    check_place(folder, force=force)
    evidence = Evidence(announce=announce)
    results = measure(evidence)
    if announce:
        announce("drawing the figures")
    drawn = {
        name: figure for name, figure in figures(evidence.walk.recording).items() if name in FIGURES
    }
    drawn["fig12-stance-laws"] = stance_laws_figure(evidence)
    drawn["as-printed"] = as_printed_figure(evidence)
    drawn["sharing"] = sharing_figure(evidence, FORCE_MODELS)
    _write(folder, document(results, evidence), drawn, force=force)
    return results


def check_place(folder: Path, *, force: bool = False) -> None:
    """Refuse a place where the page cannot be written, before the work.

    Raises:
        InvalidInput: There is such a page already, or something else in its place.
        OutputError: The folder cannot be written.
    """
    page, pictures = folder / PAGE, folder / FOLDER
    try:
        for path in (page, pictures):
            if not force and (path.exists() or path.is_symlink()):
                raise AlreadyExists(path, option="--out DIR")
        if pictures.exists():
            ours = {f"{name}.png" for name in FIGURES}
            found = {path.name for path in pictures.iterdir()} if pictures.is_dir() else {""}
            foreign = sorted(found - ours)
            if foreign:
                raise InvalidInput(
                    f"{pictures} holds other things than the paper's figures; nothing was written.",
                    hint="another folder",
                )
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".{secrets.token_hex(4)}.partial"
        probe.mkdir()
        probe.rmdir()
    except OSError as error:
        raise _unwritable(folder, error) from None


def _write(folder: Path, text: str, drawn: dict[str, Figure], *, force: bool) -> None:
    """Everything goes into a folder of its own first, and takes its place at the end."""
    partial = folder / f".{FOLDER}.{secrets.token_hex(4)}.partial"
    try:
        try:
            (partial / FOLDER).mkdir(parents=True)
            (partial / PAGE).write_text(text, encoding="utf-8", newline="\n")
            for name, figure in drawn.items():
                save_figure(figure, partial / FOLDER / f"{name}.png")
            check_place(folder, force=force)
            # The page first: it replaces an older one in one step, the folder does in two.
            (partial / PAGE).replace(folder / PAGE)
            if (folder / FOLDER).exists():
                (folder / FOLDER).rename(partial / "old")
            try:
                (partial / FOLDER).rename(folder / FOLDER)
            except OSError:
                if (partial / "old").exists():
                    (partial / "old").rename(folder / FOLDER)
                raise
        finally:
            shutil.rmtree(partial, ignore_errors=True)
    except OSError as error:
        raise _unwritable(folder, error) from None


def _unwritable(folder: Path, error: OSError) -> OutputError:
    reason = (error.strerror or str(error)).lower()
    return OutputError(f"cannot write into {folder}: {reason}.", hint="another folder")
