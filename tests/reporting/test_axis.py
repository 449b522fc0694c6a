"""Panels whose axes are drawn in a few strokes look as matplotlib's own do."""

from io import BytesIO

import matplotlib.axes
import numpy as np
import pytest
from matplotlib.axis import Tick
from PIL import Image

from phasmid.reporting import axis as ours
from phasmid.reporting.sheet import sheet
from phasmid.reporting.style import encoded_figure, styled


def six_panels(**settings):
    """Panels that share their axes, with words outside and beside one another."""
    drawing = sheet("Six panels", [], [1.4] * 3, columns=2)
    for number, axis in enumerate(drawing.axes):
        axis.plot([0.0, 10.0], [0.0, number])
        axis.set_title(f"panel {number}")
    drawing.axes[0].set(**settings)
    for number in (0, 2, 4):
        drawing.axes[number].set_ylabel(f"height {number} [m]")
    drawing.axes[4].set_xlabel("time [s]")
    drawing.figure.align_ylabels(drawing.axes)
    return drawing


def own_axes(**settings):
    """Panels of which each has its own words, of its own width."""
    drawing = sheet("Own axes", [], [1.4] * 2, columns=2, space=0.3, share_x=False, share_y=False)
    for number, axis in enumerate(drawing.axes):
        axis.plot([-1.0, 1.0], [0.0, 10.0 ** (2 * number)])
        axis.set(xlabel="way [m]", ylabel="force [N]")
    drawing.axes[0].set(**settings)
    return drawing


def changed(how, **settings):
    """Own axes of which somebody changes something."""

    def draw():
        drawing = own_axes(**settings)
        how(drawing.axes[0])
        return drawing

    return draw


def lines_of_words(panel):
    panel.xaxis.set_major_formatter(lambda x, _: "half\nway" if x == 0 else "wide words")


def without_first(panel):
    panel.yaxis.set_major_formatter(lambda y, _: f"{y:g}" if y > 0 else "")


def title_above(panel):
    panel.xaxis.set_label_position("top")


CHANGED = {
    "no marks": lambda panel: panel.tick_params(axis="y", length=0),
    "wide grid": lambda panel: panel.tick_params(grid_linewidth=0.0),
    "set anew": lambda panel: panel.tick_params(reset=True),
    "other side": lambda panel: panel.tick_params(top=True, labelright=True),
    "no words": lambda panel: panel.tick_params(labelleft=False, labelbottom=False),
    "no grid": lambda panel: panel.grid(visible=False),
    "moved spine": lambda panel: panel.spines["left"].set_position(("outward", 12)),
    "spine at zero": lambda panel: panel.spines["bottom"].set_position(("data", 0.5)),
    "label above": title_above,
    "all spines": lambda panel: panel.spines[:].set_visible(True),
    "lines of words": lines_of_words,
    "some words": without_first,
    "minor ticks": lambda panel: panel.minorticks_on(),
    "no scale's own": lambda panel: (panel.set_yscale("log"), panel.minorticks_off()),
}


@pytest.mark.parametrize("name", CHANGED)
def test_what_somebody_changes_is_seen_as_in_matplotlibs(name, monkeypatch):
    draw = changed(CHANGED[name], xlim=(-1.0, 1.0), ylim=(0.01, 0.95))
    with styled():
        drawing = draw()
        seen, extent = pixels(drawing), drawing.axes[0].get_tightbbox().extents
        place = drawing.axes[0].xaxis.get_ticks_position()
        monkeypatch.setattr(ours, "Panel", matplotlib.axes.Axes)
        drawing = draw()
        expected = pixels(drawing)
    assert np.abs(seen - expected).max() <= 2
    np.testing.assert_allclose(extent, drawing.axes[0].get_tightbbox().extents, atol=1e-6)
    assert place == drawing.axes[0].xaxis.get_ticks_position()


def test_a_file_is_the_same_whatever_was_drawn_before():
    with styled():
        files = [encoded_figure(own_axes().figure, kind) for kind in ("svg", "pdf", "png")]
        ours.LAYOUTS.clear()
        again = [encoded_figure(own_axes().figure, kind) for kind in ("pdf", "png", "svg")]
    assert files == [again[2], again[0], again[1]]


def axes_of(panel):
    return panel.xaxis, panel.yaxis


def pixels(drawing):
    return np.asarray(Image.open(BytesIO(encoded_figure(drawing.figure, "png"))), dtype=int)


DRAWN = [
    (six_panels, {}),
    (six_panels, {"xlim": (1.3, 8.9), "ylim": (-0.7, 3.3)}),
    (six_panels, {"ylim": (4.0, -1.0)}),
    (six_panels, {"xticks": [], "yticks": [0.5, 2.0, 90.0]}),
    (own_axes, {}),
    (own_axes, {"ylim": (0.0, 3e7)}),
    (own_axes, {"yscale": "log", "ylim": (0.003, 20.0)}),
    (own_axes, {"yticks": [0.5], "yticklabels": ["half"]}),
]
KINDS = ["plain", "cut", "upside down", "chosen", "own", "powers", "logarithmic", "named"]


@pytest.mark.parametrize(("draw", "settings"), DRAWN, ids=KINDS)
def test_a_panel_looks_as_matplotlibs_axes_do(draw, settings, monkeypatch):
    with styled():
        seen = pixels(draw(**settings))
        monkeypatch.setattr(ours, "Panel", matplotlib.axes.Axes)
        expected = pixels(draw(**settings))
    # Where a line and a tick meet they blend in another order, each rounded to a level of 255.
    assert np.abs(seen - expected).max() <= 2


@pytest.mark.parametrize("draw", [six_panels, own_axes])
def test_its_extent_is_that_of_matplotlibs(draw, monkeypatch):
    with styled():
        drawing = draw()
        seen = [axis.get_tightbbox().extents for axis in drawing.axes]
        monkeypatch.setattr(ours, "Panel", matplotlib.axes.Axes)
        expected = [axis.get_tightbbox().extents for axis in draw().axes]
    np.testing.assert_allclose(seen, expected, atol=1e-6)


def test_it_makes_no_ticks_until_they_are_asked_for():
    with styled():
        drawing = six_panels()
        encoded_figure(drawing.figure, "svg")
        assert not any(axis.majorTicks for panel in drawing.axes for axis in axes_of(panel))
        words = [label.get_text() for label in drawing.axes[4].get_xticklabels()]
    assert [word for word in words if word]
    assert all(isinstance(tick, Tick) for tick in drawing.axes[4].xaxis.majorTicks)


def test_ticks_that_somebody_changed_are_shown_as_they_are():
    with styled():
        drawing = six_panels()
        before = pixels(drawing)
        for label in drawing.axes[4].get_xticklabels():
            label.set_color("red")
        after = pixels(drawing)
    red = (after[..., 0] > 200) & (after[..., 1] < 60) & (after[..., 2] < 60)
    assert red.any()
    assert np.any(before != after)
