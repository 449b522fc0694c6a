"""Texts keep within their room, and pictures in pixels stay what they are."""

from io import BytesIO

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from phasmid.reporting import style
from phasmid.reporting.raster import Raster
from phasmid.reporting.source import finite_part
from phasmid.reporting.style import encoded_figure, shrunk, styled, text_width, wrapped

# Letters that meet closely or widely, what is not set letter by letter, and what is usual.
WORDS = [
    "AVAVAVAV",
    "Y.Y.Y.Y.",
    "-_-_-_-_",
    "JJJJJJJJ",
    "ffiffiffi",
    "سلام سلام",
    "六足",
    "0.5 N·m",
]


@pytest.fixture
def figure():
    with styled():
        made = Figure(figsize=(4.0, 1.0), dpi=100)
        FigureCanvasAgg(made)
        yield made


@pytest.mark.parametrize("words", WORDS)
@pytest.mark.parametrize("look", [{"fontsize": 5.0}, {"fontsize": 11.5, "fontweight": "bold"}])
def test_what_fits_is_told_as_if_it_were_set(words, look, figure):
    text = figure.text(0.0, 0.0, "", **look)
    true = text_width(text, words)
    for share in (0.3, 0.6, 0.9, 0.999, 1.001, 1.1, 1.5, 3.0):
        assert style._fits(text, words, share * true) == (share > 1)


def test_most_words_are_not_set_to_learn_that_they_fit(figure, monkeypatch):
    text = figure.text(0.0, 0.0, "", fontsize=8.5)
    monkeypatch.setattr(style, "text_width", None)
    assert style._fits(text, "tripod gait", 400.0)
    assert not style._fits(text, "tripod gait" * 20, 400.0)


def test_parts_are_wrapped_and_a_text_is_shrunk_into_its_width(figure):
    text = figure.text(0.0, 0.0, "", fontsize=9.0)
    parts = ["tripod gait", "servo AX-12A, prescribed drive", "a" * 120, "last"]
    lines = wrapped(text, parts, 300.0)
    shown = text.get_text().split("\n")
    assert len(shown) == lines > 2
    assert all(text_width(text, line) <= 300.0 for line in shown)
    # Between lines there is no dot.
    kept = str.maketrans("", "", " ·")
    assert "".join(shown).translate(kept) == "".join(parts).translate(kept)
    label = figure.text(0.0, 0.0, "front right " * 20, fontsize=9.0)
    shrunk(label, 200.0, least=6.0)
    assert label.get_fontsize() == 6.0
    assert text_width(label, label.get_text()) <= 200.0
    assert label.get_text().endswith("…")


def test_the_style_holds_within_itself_and_ends_with_it():
    before = dict(matplotlib.rcParams)
    with styled():
        own = matplotlib.rcParams["axes.titlesize"]
        with styled():
            assert matplotlib.rcParams["axes.titlesize"] == own
            matplotlib.rcParams["axes.titlesize"] = 30.0
            with styled():
                assert matplotlib.rcParams["axes.titlesize"] == own
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize("dpi", [100, 50], ids=["its own size", "half the size"])
def test_a_picture_in_a_figure_is_shown_pixel_by_pixel(dpi, figure):
    pixels = np.random.default_rng(1).integers(0, 255, (100, 400, 3), dtype=np.uint8)
    # Squares of four pixels, so that half as many can show them.
    pixels = pixels[::2, ::2].repeat(2, axis=0).repeat(2, axis=1)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    Raster(axes, pixels)
    shown = np.asarray(Image.open(BytesIO(encoded_figure(figure, "png", dpi=dpi))))
    step = 100 // dpi
    np.testing.assert_array_equal(shown, pixels[::step, ::step])


def test_a_part_of_a_picture_is_shown_as_matplotlib_does(figure):
    pixels = np.random.default_rng(1).integers(0, 255, (100, 400, 3), dtype=np.uint8)
    seen = []
    for draw in (Raster, lambda axes, image: axes.imshow(image, "gray", aspect="auto")):
        figure.clear()
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        shown = draw(axes, pixels)
        shown.set(interpolation="none", extent=(0, 400, 100, 0))
        axes.set(xlim=(100, 200), ylim=(75, 50))
        seen.append(np.asarray(Image.open(BytesIO(encoded_figure(figure, "png")))))
    np.testing.assert_array_equal(*seen)
    assert np.abs(seen[0][::4, ::4].astype(int) - pixels[50:75, 100:200]).max() == 0


def test_a_recording_that_is_finite_is_kept_as_it_is(paper_walk):
    assert finite_part(paper_walk) is paper_walk
    broken = paper_walk.copy(deep=True)
    broken["joint_position"].values[700:, 2] = np.nan
    assert finite_part(broken).sizes["time"] == 700
    # The sum of what is finite need not be.
    large = paper_walk.copy(deep=True)
    large["joint_position"].values[:, 0] = 1e308
    assert finite_part(large) is large
