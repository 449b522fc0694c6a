"""The gallery has every figure, and its pictures are small."""

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from matplotlib import rc_context
from PIL import Image

from phasmid.reporting import CATALOGUE
from phasmid.reporting.style import leg_colour

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


def test_the_picture_of_the_gaits_is_in_the_house_style(tmp_path):
    # Leg i has its own colour in all pictures, whatever the user's settings are.
    path = DOCS / "gaits_page.py"
    page = module_from_spec(spec := spec_from_file_location("gaits_page", path))
    spec.loader.exec_module(page)
    with rc_context({"axes.facecolor": "black", "font.size": 30}):
        page.draw(tmp_path / "gaits.png")
    with Image.open(tmp_path / "gaits.png") as ours, Image.open(DOCS / "images/gaits.png") as shown:
        assert ours.size == shown.size
        colours = {colour for _, colour in ours.convert("RGB").getcolors(1 << 20)}
    assert {to_rgb255(leg_colour(leg)) for leg in range(6)} <= colours
    assert (0, 0, 0) not in colours


def to_rgb255(colour):
    return tuple(int(colour[k : k + 2], 16) for k in (1, 3, 5))
