"""Height maps from files and as text: what is read, and what is refused before it costs memory."""

import io
import os
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from phasmid.errors import InvalidInput
from phasmid.scenario import load_scenario, scenario_to_toml
from phasmid.terrain import height_text, heights_from_text, read_heights

PAPER = load_scenario("paper")
SMALL = np.array([[0.0, 0.01, 0.02], [0.005, 0.0, 0.01]])


def saved(folder, name, heights):
    path = folder / name
    if path.suffix == ".npy":
        np.save(path, heights)
    else:
        path.write_text("\n".join(",".join(map(str, row)) for row in heights))
    return path


@pytest.mark.parametrize("name", ["map.npy", "map.csv"])
def test_an_array_or_a_table_holds_metres(tmp_path, name):
    # Kept in single precision: half a unit in its last place is 6e-8 of the number.
    heights = read_heights(saved(tmp_path, name, SMALL), white=0.05)
    assert heights == pytest.approx(SMALL, rel=6e-8)


@pytest.mark.parametrize(("kind", "white"), [(np.uint8, 255), (np.uint16, 65535)])
def test_white_of_an_image_is_as_high_as_it_is_told(tmp_path, kind, white):
    # z = brightness/white * height, rounded to single precision.
    grey = np.array([[0, white // 3], [white, 0]], dtype=kind)
    Image.fromarray(grey).save(tmp_path / "map.png")
    heights = read_heights(tmp_path / "map.png", white=0.06)
    assert heights == pytest.approx(grey / white * 0.06, rel=6e-8)


@pytest.mark.parametrize("name", ["map.png", "map.npy", "map.csv"])
@pytest.mark.parametrize(("edge", "start"), [(0, 0.3), (1, 0.4)])
def test_a_map_of_any_file_lies_where_the_scenario_puts_it(tmp_path, name, edge, start):
    # The first row lies to the left, the first column at the start. By default that is 300 mm, and
    # 400 mm where the ramp to the first column's heights lies before it. Greys of 8 bits are
    # multiples of 1/255 of white.
    grey = np.array([[0, 20, 40], [edge, 0, 60], [0, 80, 90]], dtype=np.uint8)
    if name == "map.png":
        Image.fromarray(grey).save(tmp_path / name)
    else:
        saved(tmp_path, name, grey / 255 * 0.025)
    map_of_file = {"height_map": str(tmp_path / name), "map_cell_mm": 20, "map_height_mm": 25}
    for options, place in (({}, start), ({"terrain_start_mm": 200}, 0.2)):
        ground = PAPER.replace(terrain="height-map", **map_of_file, **options).load_terrain()
        x, y = np.meshgrid(place + 0.02 * np.arange(3), [0.02, 0.0, -0.02])
        assert ground.height(x, y) == pytest.approx(grey / 255 * 0.025, abs=1e-9)
        assert ground.height(np.array(place - 0.1), np.array(0.0)) == 0


def test_a_scenario_carries_its_map_when_the_file_is_gone(tmp_path):
    # The file lies beside the scenario; what is written of the scenario loads without it.
    saved(tmp_path, "hills.npy", SMALL)
    (tmp_path / "mine.toml").write_text(
        '[terrain]\nkind = "height-map"\nheight_map = "hills.npy"\nmap_cell_mm = 50\n'
    )
    first = load_scenario(tmp_path / "mine.toml")
    (tmp_path / "hills.npy").unlink()
    (tmp_path / "again.toml").write_text(scenario_to_toml(first, "phantomx-paper"))
    again = load_scenario(tmp_path / "again.toml").replace(name="walk")
    assert again.terrain == first.terrain
    x, y = np.random.default_rng(0).uniform(0, 1, (2, 50))
    assert (again.load_terrain().height(x, y) == first.load_terrain().height(x, y)).all()
    assert again.load_terrain().height(np.array(2.0), np.array(-1.0)) == np.float32(0.01)


def a_png(width, height):
    """A PNG of that size that holds no picture."""

    def chunk(kind, data):
        head = struct.pack(">I", len(data)) + kind + data
        return head + struct.pack(">I", zlib.crc32(kind + data))

    size = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", size) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")


def an_npy(shape, dtype="<f8"):
    """The head of a NumPy file without its numbers."""
    head = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}"
    head += " " * (-(len(head) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode()


def bytes_of(heights):
    file = io.BytesIO()
    np.save(file, heights, allow_pickle=True)
    return file.getvalue()


HOLES = np.zeros((5, 9))
HOLES[2, 7:], HOLES[3:, :6] = np.nan, np.inf
UNREAD = 'terrain file "{}" cannot be read'
NOT_FINITE = "height map is not finite in 1 places, first at row 2, column "


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("hills.png", None, 'terrain file "hills.png" does not exist in '),
        ("a.png", a_png(1, 1), "height map is 1 × 1; it needs at least 2 × 2 samples."),
        ("a.csv", b"1\n", "height map is 1 × 1; it needs at least 2 × 2 samples."),
        ("a.npy", bytes_of(HOLES), "height map is not finite in 14 places, first at row 3, column"),
        # A file of a hundred bytes: nothing but its head can have been read.
        ("a.png", a_png(100_000, 100_000), UNREAD),
        ("a.npy", an_npy((100_000, 100_000)), UNREAD),
        ("a.npy", bytes_of(np.array([[None, 1], [2, 3]])), UNREAD + "."),
        ("a.csv", b"1,2\n\n3\n", "height map has 1 numbers in row 2 and 2 in row 1; all rows "),
        ("a.csv", b"1,2\n3,4,5\n", "height map has 3 numbers in row 2 and 2 in row 1; all rows "),
        ("a.csv", b"1,2\nx,3\n", NOT_FINITE + "1."),
        ("a.csv", b'1,2\n"3\n",4\n', "height map has 1 numbers in row 2"),
        ("a.csv", b"", "height map is 0 × 0; it needs at least 2 × 2 samples."),
        # One row of a million numbers, and the same beside a second row or in columns.
        ("a.csv", b"0," * 1_000_000 + b"0", "height map is 1 × 1000001; the limit is 65536 rows"),
        ("a.csv", b"0,0\n" + b"0," * 70_000, "height map has 70001 numbers in row 2 and 2 in ro"),
        ("a.csv", b"0,0\n" * 65_537, "height map is 65537 × 2; the limit is 65536 rows or colu"),
        ("a.csv", (b"0," * 59_999 + b"0\n") * 280, "height map is 280 × 60000; the limit is 4096"),
        ("a.npy", an_npy((2, 70_000), "|u1") + bytes(140_000), "height map is 2 × 70000; the lim"),
        ("a.png", a_png(70_000, 2), "height map is 2 × 70000; the limit is 65536 rows or columns"),
        ("a.png", b"GIF89a", UNREAD),
        ("a.npy", b"not one", UNREAD),
        ("a.npy", an_npy((2, 2, 2)) + bytes(64), UNREAD + ": an array of float64"),
        ("a.npy", an_npy((2, 2), "<c16") + bytes(64), UNREAD + ": an array of complex128"),
    ],
)
def test_a_file_without_a_map_is_refused(tmp_path, name, content, what):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InvalidInput) as caught:
        PAPER.replace(terrain="height-map", height_map=str(tmp_path / name))
    assert caught.value.what.startswith(what.format(name))


def test_a_map_is_read_once_for_all_tables_of_a_run_and_again_when_its_file_changes(tmp_path):
    # Too large for a text, so that the scenario names the file.
    flat = np.zeros((1000, 1000), dtype=np.uint8)
    path = saved(tmp_path, "map.npy", flat)
    scenario = PAPER.replace(terrain="height-map", height_map=str(path))
    first = scenario.load_terrain().shape
    assert scenario.replace(friction=0.5).load_terrain().shape is first
    flat[:, 500:] = 1
    os.utime(saved(tmp_path, "map.npy", flat), ns=(0, 0))
    again = scenario.replace(map_cell=10.0).load_terrain()
    assert again.height(np.array(7000.0), np.array(0.0)) == pytest.approx(1.0, abs=1e-12)
    with pytest.raises(InvalidInput, match="height map has a slope of"):
        scenario.replace(friction=0.5)


def test_large_files_and_pipes_are_refused_unread(tmp_path):
    with (tmp_path / "map.csv").open("wb") as file:
        file.truncate(200_000_001)
    with pytest.raises(InvalidInput, match="holds 200000001 bytes"):
        read_heights(tmp_path / "map.csv", white=1.0)
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "a.csv")
        with pytest.raises(InvalidInput, match="does not exist"):
            read_heights(tmp_path / "a.csv", white=1.0)


def test_a_map_as_text_is_the_same_map_unless_it_is_too_long(tmp_path):
    # Bit by bit in single precision.
    heights = np.random.default_rng(0).normal(size=(13, 7)).astype(np.float32).astype(float)
    assert (heights_from_text(height_text(heights)) == heights).all()
    for text in ("map:", "map:1x1:", "map:2x2:!!!", "map:99999x99999:0", height_text(SMALL)[:-9]):
        with pytest.raises(InvalidInput):
            heights_from_text(text)
    # Noise does not pack: 500 × 500 numbers of 4 bytes stay above 750 kB of text.
    noise = np.random.default_rng(1).uniform(0, 0.001, (500, 500))
    path = str(saved(tmp_path, "hills.npy", noise))
    scenario = PAPER.replace(terrain="height-map", height_map=path)
    assert scenario.terrain.height_map == path
