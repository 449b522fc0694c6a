"""The library of gaits: list and picture of docs/gaits.md.

Takes a few seconds. The text above the library stays as it is.
"""

import contextlib
import io
from pathlib import Path

import numpy as np

from phasmid.cli import main as phasmid
from phasmid.gait import GAITS
from phasmid.reporting.style import leg_colour, save_figure, styled

DOCS = Path(__file__).parents[2] / "docs"
ROBOT = "phantomx-paper"
HEADING = "## The library"
LEGS = ("RF", "RM", "RR", "LR", "LM", "LF")
PIXELS_PER_INCH = 110


def library():
    """Return the command that lists the gaits, with its output."""
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        assert phasmid(["gaits", "--robot", ROBOT]) == 0
    return f"```\n$ phasmid gaits --robot {ROBOT}\n{text.getvalue().strip()}\n```\n"


def draw(path):
    """Bars of standing feet over two cycles, the gaits of six legs."""
    from matplotlib.figure import Figure

    gaits = [gait for name, gait in GAITS[6].items() if not name.startswith("firmware")]
    with styled():
        figure = Figure(figsize=(9, 4.2), layout="constrained")
        figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1)
        panels = figure.subplots(2, 3, sharex=True, sharey=True)
        for axes, gait in zip(panels.flat, gaits, strict=True):
            for leg, offset in enumerate(gait.offsets):
                landing = (offset + gait.swing_fraction) % 1.0
                bars = [(landing + cycle, gait.duty_factor) for cycle in np.arange(-1.0, 2.0)]
                axes.broken_barh(bars, (leg - 0.38, 0.76), color=leg_colour(leg), linewidth=0)
            axes.set(title=f"{gait.name}, duty factor {gait.duty_factor:.3g}")
            axes.set(xlim=(0, 2), ylim=(5.6, -0.6))
            axes.set_yticks(range(6), [f"{leg} {name}" for leg, name in enumerate(LEGS, 1)])
            axes.tick_params(axis="y", length=0)
            axes.grid(visible=False, axis="y")
            axes.spines["left"].set_visible(False)
        for axes in panels[:, 0]:
            for leg, label in enumerate(axes.get_yticklabels()):
                label.set_color(leg_colour(leg))
        for axes in panels[-1]:
            axes.set_xlabel("time [cycles]   (bars: stance)")
        save_figure(figure, path, dpi=PIXELS_PER_INCH)


def main():
    """Write the page."""
    draw(DOCS / "images" / "gaits.png")
    page = DOCS / "gaits.md"
    top = page.read_text("utf-8").partition(f"\n{HEADING}")[0].rstrip("\n")
    words = (
        "Written by `make pages PAGE=gaits`, with margins for a step of 40 mm forward. `--diagram` "
        "draws each gait; `--robot octopod` and `--robot quadruped` list those of eight and four "
        "legs.\n"
    )
    text = "\n".join([f"{top}\n", f"{HEADING}\n", words, library()])
    page.write_text(text, "utf-8", newline="\n")
