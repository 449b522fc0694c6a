"""Panels without words look as matplotlib's own axes do."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from phasmid.reporting.grid import Grid
from phasmid.reporting.sheet import sheet
from phasmid.reporting.style import encoded_figure, styled


def drawn(*, own, limits):
    """Six panels that share their axes, the inner ones with our grid or with matplotlib's axes."""
    with styled():
        drawing = sheet("Six panels", [], [1.4] * 3, columns=2)
        for number, axis in enumerate(drawing.axes):
            axis.plot([0.0, 10.0], [0.0, number])
        drawing.axes[0].set(**limits)
        if not own:
            for grid in drawing.figure.findobj(Grid):
                grid.axes.xaxis.set_visible(True)
                grid.axes.yaxis.set_visible(True)
            for axis in drawing.axes:
                axis.label_outer()
    return np.asarray(Image.open(BytesIO(encoded_figure(drawing.figure, "png"))), dtype=int)


@pytest.mark.parametrize(
    "limits",
    [
        {},
        {"xlim": (1.3, 8.9), "ylim": (-0.7, 3.3)},
        {"ylim": (4.0, -1.0)},
        {"xticks": [], "yticks": [0.5, 2.0, 90.0]},
    ],
    ids=["as they come", "cut", "upside down", "ticks of one's own"],
)
def test_a_grid_is_the_same_as_that_of_an_axis(limits):
    ours, theirs = drawn(own=True, limits=limits), drawn(own=False, limits=limits)
    # Where a line and a tick meet they blend in another order, each rounded to a level of 255.
    assert np.abs(ours - theirs).max() <= 2


def test_an_axis_that_is_shown_again_draws_its_own_grid():
    with styled():
        drawing = sheet("Two panels", [], [1.4] * 2)
        above, below = drawing.axes
        grids = drawing.figure.findobj(Grid)
        assert [grid.axes for grid in grids] == [above]
        before = encoded_figure(drawing.figure, "png")
        above.xaxis.set_visible(True)
        after = encoded_figure(drawing.figure, "png")
    assert before != after
    words = [label.get_text() for label in above.get_xticklabels()]
    assert words == [label.get_text() for label in below.get_xticklabels()]
    assert np.any([bool(word) for word in words])
