"""Frames show the picture, and the recorded forces at their places; videos have their frames."""

from dataclasses import replace

import numpy as np
import pytest
import xarray
from PIL import Image

import phasmid
from phasmid.errors import InvalidInput
from phasmid.reporting.film.film import camera_of
from phasmid.reporting.film.frame import FrameFigure, newtons, picture_size
from phasmid.reporting.style import leg_colour, rgb, styled

SIZE = (640, 360)


def constant(run, length):
    """A run of forces that do not change, each leg's its own."""
    time, forces = np.linspace(0.0, length, 200), np.linspace(2.0, 12.0, 6)
    normal = {"foot_normal_force": (("time", "leg"), np.tile(forces, (200, 1)))}
    force = {"foot_force": (("time", "leg", "axis"), np.zeros((200, 6, 3)))}
    return replace(run, recording=xarray.Dataset(normal | force, coords={"time": time}))


def drawn(run, frames, number=1, size=SIZE):
    """A frame around a grey picture, and its figure."""
    width, height = picture_size(run, size)
    view, displacement = camera_of(frames, (width, height))
    grey = np.full((height, width, 3), 200, dtype=np.uint8)
    with styled():
        figure = FrameFigure(run, frames, size, 1.0)
        pixels = figure.frame(number, grey, view.moved(displacement[number]))
    return pixels, figure, view


def without(run, *names):
    """The run without some channels."""
    return replace(run, recording=run.recording.drop_vars(names, errors="ignore"))


FORCES = ("foot_force", "foot_force_model", "foot_normal_force", "foot_normal_force_model")


def near(pixels, colour):
    """Rows and columns of pixels of a colour, within the loss of a blurred edge."""
    off = np.abs(pixels.astype(float) - 255 * rgb(colour)).max(axis=-1)
    return np.nonzero(off < 12)


def test_a_frame_holds_picture_words_and_forces(run, frames):
    pixels, _, _ = drawn(run, frames)
    assert pixels.shape == (360, 640, 3)
    height = picture_size(run, SIZE)[1]
    assert (pixels[height // 2, 5] == 200).all()
    assert (pixels[-3, -3] == 255).all()
    # The title and the time are dark letters in the upper corners.
    assert pixels[: height // 8, :320].min() < 90
    assert pixels[: height // 8, -100:].min() < 90
    # Without forces the picture takes the whole frame.
    pixels, _, _ = drawn(without(run, *FORCES), without(frames, *FORCES))
    assert (pixels[-3, -3] == 200).all()


def test_each_legs_line_is_its_force_in_its_colour(run, frames):
    _, figure, _ = drawn(constant(run, 0.4), frames)
    lines = figure.strip.axis.lines[:6]
    for leg, line in enumerate(lines):
        assert line.get_color() == leg_colour(leg)
        np.testing.assert_allclose(line.get_ydata(), 2.0 + 2.0 * leg)
    words = [" ".join(text.get_text().split()) for text in figure.strip.axis.texts]
    assert words[:2] == ["leg 1 2.0 N", "leg 2 4.0 N"]
    assert words[-1] == "sum 42.0 N"
    assert newtons(-0.01).strip() == "0.0 N"


def test_arrows_point_where_the_force_does_in_the_legs_colour(run, frames):
    force = np.zeros_like(frames.foot_force)
    force[:, 1, 2] = frames.weight
    size = (1280, 533)
    recording = frames.recording.assign(foot_force=(("time", "leg", "axis"), force))
    still = replace(frames, recording=recording)
    pixels, _, view = drawn(without(run, *FORCES), still, number=0, size=size)
    rows, columns = near(pixels, leg_colour(1))
    # The whole weight is an arrow of 1.2 spans of the hips, straight up from the foot.
    hips = frames.robot.arrays.p_body_hip[:, :2]
    foot = frames.channel("foot_position")[0, 1]
    tip = foot + np.array([0.0, 0.0, 1.2 * np.ptp(hips, axis=0).max()])
    (x, y), (to_x, to_y) = view.project(np.stack([foot, tip]))
    assert abs(rows.min() - to_y) < 4
    assert abs(columns[rows.argmin()] - to_x) < 4
    # The dot at the foot has a radius of 6 pixels.
    assert abs(rows.max() - y) < 9
    assert abs(np.median(columns[rows > (y + to_y) / 2]) - x) < abs(to_x - x) + 1


@pytest.mark.usefixtures("opengl")
def test_a_video_has_its_frames_and_reports_progress(recording, tmp_path):
    told = []
    path = phasmid.save_video(
        recording,
        tmp_path / "new" / "a.gif",
        size=(320, 240),
        fps=10,
        progress=lambda done, count: told.append((done, count)),
    )
    with Image.open(path) as stored:
        assert stored.size == (320, 240)
        assert stored.n_frames == 4
        frames = []
        for k in range(4):
            stored.seek(k)
            frames.append(np.asarray(stored.convert("RGB"), dtype=float))
    assert told == [(k, 4) for k in range(1, 5)]
    assert np.abs(frames[3] - frames[0]).mean() > 0.5
    with pytest.raises(InvalidInput, match=r"a\.gif exists; nothing was written\."):
        phasmid.save_video(recording, path)
