"""Figures of ``phasmid report --figures``, and pictures of other commands."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.options import Number
from phasmid.cli.output import print_table, say
from phasmid.cli.walk import leg_numbers
from phasmid.errors import InvalidInput, nearest, plain

if TYPE_CHECKING:
    from phasmid.recording import Recording
    from phasmid.reporting.catalogue import FigureKind
    from phasmid.reporting.run import Run
    from phasmid.reporting.style import Figure

KINDS = ("svg", "png", "pdf")

OPTIONS: dict[str, str | tuple[str, str] | Number] = {
    "--figures NAMES": "draw these figures in place of the result folder: names with commas "
    "between, or all",
    "--list-figures": "list the figures and stop",
    "--format KINDS": "svg, png, pdf, or several with commas between; default: svg",
    "--labels A,B,...": "names of the runs in the figures; default: those of their folders",
    "--width-mm MM": Number(
        "width of the figures, such as 85 or 175 for one or two columns of a paper; type keeps a "
        "legible size; default: 183",
        60,
        500,
        hint="85",
    ),
    "--dpi N": Number(
        "pixels per inch of png, and of pictures in pdf and svg; default: 150", 30, 1200, hint="300"
    ),
    "--no-title": "figures without title and subtitle, for use with a caption",
}
"""Options of figures."""

FIGURES_ALONE = ("format", "labels", "width_mm", "dpi", "no_title")
"""Options that need ``--figures``."""

DPI = 150.0
"""Pixels per inch where none are given."""


def list_figures() -> None:
    """Print the figures, a sentence each."""
    from phasmid.reporting.catalogue import CATALOGUE

    print_table([(kind.name, kind.sentence) for kind in CATALOGUE.values()])


def draw_figures(
    paths: Sequence[Path], recordings: Sequence[Recording], options: argparse.Namespace
) -> None:
    """Draw the figures of the options; several recordings are compared in one figure.

    Args:
        paths: Files or folders of the recordings.
        recordings: The recordings.
        options: Those of the command line.
    """
    from phasmid.recording.file import check_new_file
    from phasmid.reporting.catalogue import check_figure, draw_groups, find_figure
    from phasmid.reporting.run import gather
    from phasmid.reporting.style import NORMAL_WIDTH, Layout

    names = [name.strip() for name in options.figures.split(",")]
    kinds = _kinds(options.format or "svg")
    labels = options.labels.split(",") if options.labels else [run_name(path) for path in paths]
    folder = Path(options.out or Path("plots") / "_".join(run_name(path) for path in paths))
    runs = gather(recordings, labels)
    legs = leg_numbers(options.legs, runs[0].robot)
    chosen = _all_figures(runs) if "all" in names else [*map(find_figure, dict.fromkeys(names))]
    count = min(len(one.robot.legs) for one in runs)
    targets = {
        kind.name: _files(folder, kind.name, 1 if legs else len(kind.groups(count)), kinds)
        for kind in chosen
    }
    for path in (path for rows in targets.values() for row in rows for path in row):
        check_new_file(path, option="--out DIR", force=options.force)
    # Refuse before anything is drawn.
    for kind in chosen:
        check_figure(runs, kind)
    width = NORMAL_WIDTH if options.width_mm is None else options.width_mm / 1000
    layout = Layout(width, title=not options.no_title)
    for kind in chosen:
        figures = draw_groups(runs, kind, legs, layout)
        for figure, files in zip(figures, targets[kind.name], strict=True):
            write_figure(figure, files, options.dpi or DPI)
            if not options.quiet:
                say("\n".join(plain(str(path)) for path in files))


def _all_figures(runs: Sequence[Run]) -> list[FigureKind]:
    """Return all figures that can be drawn of each run."""
    from phasmid.reporting.catalogue import CATALOGUE, can_be_plotted

    fitting = [{kind.name for kind in can_be_plotted(one.recording)} for one in runs]
    return [
        kind
        for kind in CATALOGUE.values()
        if all(kind.name in found for found in fitting) and (kind.several or len(runs) == 1)
    ]


def run_name(path: Path) -> str:
    """Return the name of a run by its file or folder."""
    path = path.resolve()
    if path.is_dir():
        return path.name
    return path.parent.name if path.name == "recording.nc" else path.stem


def _kinds(text: str) -> list[str]:
    kinds = [part.strip().lower() for part in text.split(",")]
    for kind in kinds:
        if kind not in KINDS:
            guess = nearest(kind, KINDS)
            hint = f'"{guess}"' if guess else f"one of {', '.join(KINDS)}"
            raise InvalidInput(f'no format "{kind}".', hint=hint)
    return list(dict.fromkeys(kinds))


def _files(folder: Path, name: str, count: int, kinds: Sequence[str]) -> list[list[Path]]:
    from phasmid.reporting.catalogue import suffix_of

    return [[folder / f"{name}{suffix_of(k)}.{kind}" for kind in kinds] for k in range(count)]


def check_figure_path(flag: str, path: Path, *, force: bool) -> None:
    """Refuse a figure's file of another kind, or that cannot be written.

    Args:
        flag: Option that names the file.
        path: The file.
        force: Replace an older file.
    """
    from phasmid.recording.file import check_new_file

    if path.suffix[1:].lower() not in KINDS:
        raise InvalidInput(
            f'{flag} is "{plain(str(path))}"; it must end in .{", .".join(KINDS)}.',
            hint=f"{flag} picture.svg",
        )
    check_new_file(path, option=f"{flag} FILE", force=force)


def write_figure(figure: Figure, files: Sequence[Path], dpi: float | None = None) -> None:
    """Write a figure into files, each of the kind of its ending.

    Args:
        figure: The figure.
        files: The files; folders above them are made.
        dpi: Pixels per inch of png; the figure's by default.
    """
    from phasmid.recording.file import cannot_write, write_whole
    from phasmid.reporting.style import encoded_figure

    for path in files:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(path, error) from None
        write_whole(path, encoded_figure(figure, path.suffix[1:].lower(), dpi=dpi))
