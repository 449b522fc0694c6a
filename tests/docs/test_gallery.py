"""The gallery has every figure, and its pictures are small."""

from pathlib import Path

from phasmid.reporting import CATALOGUE

DOCS = Path(__file__).parents[2] / "docs"


def test_the_gallery_shows_every_figure_in_a_small_picture():
    text = (DOCS / "gallery.md").read_text("utf-8")
    for kind in CATALOGUE.values():
        assert f"| **{kind.name}**<br>{kind.sentence}" in text
        assert f"](gallery/{kind.name}.png)" in text
        assert (DOCS / f"gallery/{kind.name}.png").stat().st_size < 100_000
    assert {path.stem.removesuffix("-compared") for path in DOCS.glob("gallery/*.png")} == set(
        CATALOGUE
    )
