"""The strip shows the recorded forces at their places, and the arrows their directions."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from phasmid.reporting.shapes import rgb
from phasmid.reporting.style import leg_colour
from phasmid.video.arrows import draw_arrows
from phasmid.video.film import film_camera
from phasmid.video.sheet import Sheet, picture_size
from phasmid.video.strip import PAST, Strip, newtons

SIZE = (1280, 187)


def constant(film, *, length=0.4, low=2.0, high=12.0):
    """Forces that do not change, each leg's its own, for some seconds."""
    legs = len(film.source.robot.legs)
    time = np.linspace(0.0, length, 200)
    forces = np.linspace(low, high, legs)
    return replace(film, normal=np.tile(forces, (200, 1)), normal_time=time), forces


def nearest_to(image, colour):
    """Rows of pixels that have a colour, within the loss of a blurred edge."""
    off = np.abs(np.asarray(image, dtype=float) - 255 * rgb(colour)).max(axis=-1)
    return np.nonzero(off < 12)


@pytest.mark.parametrize("size", [SIZE, (640, 94)])
def test_each_legs_curve_runs_at_its_force_in_its_colour(film, size):
    still, forces = constant(film)
    strip = Strip(still, size)
    image = strip.at(0.35)
    across = strip.cursor(0.35)[1]
    left = np.asarray(image)[:, : round(across) - 10]
    for leg, force in enumerate(forces):
        rows, _ = nearest_to(left, leg_colour(leg))
        assert len(rows) > 50
        # A line is two pixels wide and its middle lies between pixels.
        assert abs(np.median(rows) + 0.5 - strip.height_of(force)) < 1.6


def test_what_is_to_come_is_pale(film):
    still, _ = constant(film)
    strip = Strip(still, SIZE)
    image = np.asarray(strip.at(0.2))
    ahead = image[:, round(strip.cursor(0.2)[1]) + 12 : round(strip.cursor(0.4)[1]) - 2]
    assert all(len(nearest_to(ahead, leg_colour(leg))[0]) == 0 for leg in range(6))


def test_a_short_run_is_shown_whole_and_the_cursor_crosses_it(film):
    still, _ = constant(film)
    strip = Strip(still, SIZE)
    assert strip.window == pytest.approx(0.4)
    starts, places = zip(*(strip.cursor(t) for t in (0.0, 0.2, 0.4)), strict=True)
    assert starts == (0.0, 0.0, 0.0)
    assert places[1] == pytest.approx((places[0] + places[2]) / 2)


def test_a_long_run_passes_under_the_cursor(film):
    still, _ = constant(film, length=60.0)
    strip = Strip(still, SIZE)
    assert strip.window == pytest.approx(10.0)  # five cycles of 2 s
    begin, _ = strip.cursor(0.0)
    middle, place = strip.cursor(30.0)
    end, last = strip.cursor(60.0)
    assert begin == 0.0
    assert middle == pytest.approx(30.0 - PAST * 10.0)
    assert end == pytest.approx(50.0)
    assert place < last
    # It moves by whole pixels from frame to frame, over the seams between its parts too.
    for time in (12.8, 17.2, 27.2, 44.0):
        rows, columns = nearest_to(np.asarray(strip.at(time))[:, :800], leg_colour(2))
        assert len(np.unique(columns)) > 600
        assert np.ptp(rows) < 12


def test_newtons_have_a_tenth_and_no_negative_nothing():
    assert [newtons(f) for f in (-0.01, 0.04, 7.86, 10.0)] == ["0.0 N", "0.0 N", "7.9 N", "10.0 N"]


def test_arrows_point_where_the_force_does_in_the_legs_colour(film):
    camera = film_camera(film, (1280, 533))
    force = np.zeros_like(film.force)
    force[:, 1, 2] = film.source.weight
    image = Image.new("RGB", (1280, 533), "white")
    draw_arrows(image, replace(film, force=force), camera, 0)
    rows, columns = nearest_to(image, leg_colour(1))
    # The whole weight is an arrow of 1.2 spans of the hips, straight up from the foot.
    hips = film.source.robot.arrays.p_body_hip[:, :2]
    foot = film.feet[0, 1]
    tip = foot + np.array([0.0, 0.0, 1.2 * np.ptp(hips, axis=0).max()])
    (x, y), (to_x, to_y) = camera.at(0).project(np.stack([foot, tip]))[:, :2]
    assert abs(rows.min() - to_y) < 4
    assert abs(columns[rows.argmin()] - to_x) < 4
    low = rows > (y + to_y) / 2
    assert np.abs(np.median(columns[low]) - x) < abs(to_x - x)
    # The dot at the foot is about 6 pixels in radius.
    assert abs(rows.max() - y) < 9
    others = [len(nearest_to(image, leg_colour(leg))[0]) for leg in (0, 2, 3, 4, 5)]
    assert others == [0] * 5


def test_a_frame_holds_picture_and_strip(recording, film):
    size = (640, 360)
    inner = picture_size(film, size)
    sheet = Sheet(recording, film, film_camera(film, inner), size, 1.0)
    grey = np.full((inner[1], inner[0], 3), 200, dtype=np.uint8)
    frame = sheet.frame(1, grey)
    assert frame.size == size
    pixels = np.asarray(frame)
    assert (pixels[inner[1] // 2, 5] == 200).all()
    assert (pixels[-3, -3] == 255).all()
    # The title and the time are dark letters in the upper corners.
    assert pixels[: inner[1] // 8, : size[0] // 2].min() < 90
    assert pixels[: inner[1] // 8, -100:].min() < 90


def test_without_forces_the_picture_takes_the_whole_frame(recording, film):
    bare = replace(film, normal=None, force=None)
    assert picture_size(bare, (640, 360)) == (640, 360)
    sheet = Sheet(recording, bare, film_camera(bare, (640, 360)), (640, 360), 0.5)
    frame = sheet.frame(0, np.full((360, 640, 3), 200, dtype=np.uint8))
    assert frame.size == (640, 360)
