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
