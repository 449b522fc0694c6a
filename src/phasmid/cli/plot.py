"""``phasmid plot``: draw figures of one run, or compare several."""

from __future__ import annotations

import argparse
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from phasmid.cli.number_option import number_within
from phasmid.cli.report import print_damage
from phasmid.cli.walk import leg_numbers
from phasmid.errors import InvalidInput, nearest, plain

if TYPE_CHECKING:
    from phasmid.reporting.catalogue import FigureKind
    from phasmid.reporting.run import Run
    from phasmid.reporting.style import Figure

KINDS = ("svg", "png", "pdf")

RESOLUTION = 150.0
"""Default resolution of pictures [pixels per inch]."""

COARSEST, FINEST = 30, 1200
"""Resolutions of pictures [pixels per inch]."""


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
    parser.add_argument("--list", action="store_true", help="list the figures and stop")
    parser.add_argument(
        "--out", metavar="DIR", help="folder of the figures; default: plots/NAME of the recording"
    )
    parser.add_argument(
        "--format",
        default="svg",
        metavar="KINDS",
        help="svg, png, pdf, or several with commas between; default: svg",
    )
    parser.add_argument("--legs", metavar="1,2,...", help="legs that are shown; default: all")
    parser.add_argument(
        "--labels", metavar="A,B,...", help="names of the runs; default: those of their folders"
    )
    parser.add_argument(
        "--width-mm",
        metavar="MM",
        help="width of the figures, such as 85 or 175 for one or two columns of a paper; type "
        "keeps a legible size; default: 183",
    )
    parser.add_argument(
        "--dpi",
        metavar="N",
        help=f"pixels per inch of png, and of pictures in pdf and svg; default: {RESOLUTION:g}",
    )
    parser.add_argument(
        "--no-title", action="store_true", help="no title and subtitle, for use with a caption"
    )
    parser.add_argument("--force", action="store_true", help="replace figures of these names")
    parser.add_argument("--quiet", action="store_true", help="print only errors")


def run(options: argparse.Namespace) -> int:
    """Draw figures, and return the exit status."""
    from phasmid.recording import load_recording
    from phasmid.recording.file import check_new_file
    from phasmid.reporting.catalogue import CATALOGUE, check_figure, draw_groups, find_figure
    from phasmid.reporting.run import gather
    from phasmid.reporting.style import NARROWEST, NORMAL_WIDTH, WIDEST, Layout

    if options.list:
        width = max(map(len, CATALOGUE))
        for kind in CATALOGUE.values():
            print(f"{kind.name:{width}}  {kind.sentence}")
        return 0
    paths, names = sort_out(options.things, CATALOGUE)
    kinds = _kinds(options.format)
    dpi = number_within("--dpi", options.dpi, COARSEST, FINEST, hint="--dpi 300") or RESOLUTION
    narrowest, widest = 1000 * NARROWEST, 1000 * WIDEST
    wide = number_within("--width-mm", options.width_mm, narrowest, widest, hint="--width-mm 85")
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
    layout = Layout(NORMAL_WIDTH if wide is None else wide / 1000, title=not options.no_title)
    for kind in chosen:
        figures = draw_groups(runs, kind, legs, layout)
        for figure, files in zip(figures, targets[kind.name], strict=True):
            _write(figure, files, dpi)
            if not options.quiet:
                print("\n".join(plain(str(path)) for path in files))
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


def sort_out(things: Sequence[str], known: Collection[str]) -> tuple[list[Path], list[str]]:
    """Return which arguments are recordings, and which are names of figures.

    Args:
        things: Recordings first, or in any order.
        known: Names of figures.

    Raises:
        InvalidInput: There is no recording or no figure, or something is neither.
    """
    paths: list[Path] = []
    names: list[str] = []
    for thing in things:
        if thing in known or thing == "all":
            names.append(thing)
        elif _exists(thing):
            paths.append(Path(thing))
        else:
            guess = nearest(thing, known)
            looks = "/" in thing or "\\" in thing or Path(thing).suffix in (".nc", ".mcap")
            if looks or (not paths and not guess):
                raise InvalidInput(f"recording {thing} does not exist.", hint="phasmid walk")
            raise InvalidInput(f'no figure "{thing}".', hint=guess or "phasmid plot --list")
    if not paths:
        raise InvalidInput("no recording is named.", hint="phasmid plot results/paper gait-diagram")
    if not names:
        raise InvalidInput(
            "no figure is named.", hint=f"phasmid plot {paths[0]} all, or phasmid plot --list"
        )
    return paths, list(dict.fromkeys(names))


def _exists(name: str) -> bool:
    """Return whether a file or folder exists; a text may be no possible name."""
    try:
        return Path(name).exists()
    except (OSError, ValueError):
        return False


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
            raise InvalidInput(f'no format "{kind}".', hint=guess or f"one of {', '.join(KINDS)}")
    return list(dict.fromkeys(kinds))


def _files(folder: Path, name: str, count: int, kinds: Sequence[str]) -> list[list[Path]]:
    from phasmid.reporting.catalogue import suffix_of

    return [[folder / f"{name}{suffix_of(k)}.{kind}" for kind in kinds] for k in range(count)]


def _write(figure: Figure, files: Sequence[Path], dpi: float) -> None:
    from phasmid.recording.file import cannot_write, write_whole
    from phasmid.reporting.style import encoded_figure

    for path in files:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(path, error) from None
        write_whole(path, encoded_figure(figure, path.suffix[1:], dpi=dpi))
