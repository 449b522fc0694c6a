"""Texts keep within their width, and the style ends where it should."""

import matplotlib
import numpy as np

from phasmid.reporting.run import finite_part
from phasmid.reporting.style import new_figure, shrink, styled, wrap


def test_parts_are_wrapped_and_a_text_is_shrunk_into_its_width():
    with styled():
        figure = new_figure(4.0, 1.0, 100)
        text = figure.text(0.0, 0.0, "", fontsize=9.0)
        parts = ["tripod gait", "servo AX-12A, prescribed drive", "a" * 120, "last"]
        lines = wrap(text, parts, 300.0)
        shown = text.get_text().split("\n")
        assert len(shown) == lines > 2
        assert text.get_window_extent().width <= 300.0
        # Between lines there is no dot.
        kept = str.maketrans("", "", " ·")
        assert "".join(shown).translate(kept) == "".join(parts).translate(kept)
        label = figure.text(0.0, 0.0, "front right " * 20, fontsize=9.0)
        shrink(label, 200.0, least=6.0)
        assert label.get_fontsize() == 6.0
        assert label.get_window_extent().width <= 200.0
        assert label.get_text().endswith("…")


def test_the_style_ends_with_its_context():
    before = dict(matplotlib.rcParams)
    with styled():
        assert matplotlib.rcParams["svg.hashsalt"] == "phasmid"
    assert dict(matplotlib.rcParams) == before


def test_a_recording_that_is_finite_is_kept_as_it_is(paper_walk):
    assert finite_part(paper_walk) is paper_walk
    broken = paper_walk.copy(deep=True)
    broken["joint_position"].values[700:, 2] = np.nan
    assert finite_part(broken).sizes["time"] == 700
    # The sum of what is finite need not be.
    large = paper_walk.copy(deep=True)
    large["joint_position"].values[:, 0] = 1e308
    assert finite_part(large) is large
