"""``phasmid plot``: draw figures of one run, or compare several."""

from __future__ import annotations

import argparse
import os
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.options import Number
from phasmid.cli.output import print_table, say
from phasmid.cli.report import print_damage
from phasmid.cli.walk import leg_numbers
from phasmid.errors import InvalidInput, nearest, plain

if TYPE_CHECKING:
    from phasmid.reporting.catalogue import FigureKind
    from phasmid.reporting.run import Run
    from phasmid.reporting.style import Figure

KINDS = ("svg", "png", "pdf")

OPTIONS = {
    "--list": "list the figures and stop",
    "--out DIR": "folder of the figures; default: plots/NAME of the recording",
    "--format KINDS": ("svg, png, pdf, or several with commas between; default: svg", "svg"),
    "--legs 1,2,...": "legs that are shown; default: all",
    "--labels A,B,...": "names of the runs; default: those of their folders",
    "--width-mm MM": Number(
        "width of the figures, such as 85 or 175 for one or two columns of a paper; type keeps a "
        "legible size; default: 183",
        60,
        500,
        hint="85",
    ),
    "--dpi N": Number(
        "pixels per inch of png, and of pictures in pdf and svg; default: 150",
        30,
        1200,
        default=150,
        hint="300",
    ),
    "--no-title": "no title and subtitle, for use with a caption",
    "--force": "replace figures of these names",
    "--quiet": "print only errors",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.usage = "phasmid plot RECORDING... FIGURE... [--out DIR] [--format svg,png,pdf]"
    parser.add_argument(
        "things",
        nargs="*",
        metavar="RECORDING FIGURE",
        help="result folders or recordings, then names of figures, or all; several recordings are "
        "compared in one figure",
    )


def run(options: argparse.Namespace) -> int:
    """Draw figures, and return the exit status."""
    from phasmid.recording import load_recording
    from phasmid.recording.file import check_new_file
    from phasmid.reporting.catalogue import CATALOGUE, check_figure, draw_groups, find_figure
    from phasmid.reporting.run import gather
    from phasmid.reporting.style import NORMAL_WIDTH, Layout

    if options.list:
        print_table([(kind.name, kind.sentence) for kind in CATALOGUE.values()])
        return 0
    paths, names = _sort_out(options.things, CATALOGUE)
    kinds = _kinds(options.format)
    labels = options.labels.split(",") if options.labels else [run_name(path) for path in paths]
    folder = Path(options.out or Path("plots") / "_".join(run_name(path) for path in paths))
    with print_damage():
        recordings = [load_recording(path) for path in paths]
    runs = gather(recordings, labels)
    legs = leg_numbers(options.legs, runs[0].robot)
    chosen = _all_figures(runs) if "all" in names else [find_figure(name) for name in names]
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
            write_figure(figure, files, options.dpi)
            if not options.quiet:
                say("\n".join(plain(str(path)) for path in files))
    return 0


def _all_figures(runs: Sequence[Run]) -> list[FigureKind]:
    """Return all figures that can be drawn of each run."""
    from phasmid.reporting.catalogue import CATALOGUE, can_be_plotted

    fitting = [{kind.name for kind in can_be_plotted(one.recording)} for one in runs]
    return [
        kind
        for kind in CATALOGUE.values()
        if all(kind.name in found for found in fitting) and (kind.several or len(runs) == 1)
    ]


def _sort_out(things: Sequence[str], known: Collection[str]) -> tuple[list[Path], list[str]]:
    """Return which arguments are recordings, and which are names of figures.

    Args:
        things: Recordings first, or in any order.
        known: Names of figures.

    Raises:
        InvalidInput: There is no recording or no figure, or something is neither.
    """
    names = [thing for thing in things if thing in known or thing == "all"]
    paths = [Path(thing) for thing in things if thing not in names]
    for path in paths:
        if not os.path.exists(path):  # noqa: PTH110, a text may be no possible path
            guess = nearest(str(path), known)
            if len(path.parts) > 1 or path.suffix or not (guess or names or len(paths) > 1):
                raise InvalidInput(f"recording {path} does not exist.", hint="phasmid walk")
            hint = f'"{guess}"' if guess else "phasmid plot --list"
            raise InvalidInput(f'no figure "{path}".', hint=hint)
    if not paths:
        raise InvalidInput("no recording is named.", hint="phasmid plot results/paper gait-diagram")
    if not names:
        raise InvalidInput(
            "no figure is named.", hint=f"phasmid plot {paths[0]} all, or phasmid plot --list"
        )
    return paths, list(dict.fromkeys(names))


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
