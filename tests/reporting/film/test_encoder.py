"""Files decode to the frames that went in, and appear whole or not at all."""

import numpy as np
import pytest
from PIL import Image

from phasmid.errors import OutputError
from phasmid.reporting.film.encoder import encode
from phasmid.reporting.style import LEG_COLOURS


def frames(count, size=(320, 240)):
    """A field whose brightness tells the frame's number, a bar that moves, and some colours."""
    for k in range(count):
        image = Image.new("RGB", size, (4 * k, 4 * k, 4 * k))
        image.paste("white", (7 * k, 80, 7 * k + 10, 120))
        for leg, colour in enumerate(LEG_COLOURS):
            image.paste(colour, (30 * leg + 5, 20, 30 * leg + 30, 60))
        yield np.asarray(image)


def test_an_mp4_decodes_to_its_frames(tmp_path):
    av = pytest.importorskip("av")

    path = tmp_path / "a.mp4"
    encode(frames(45), path, 30.0, 45)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert (stream.width, stream.height) == (320, 240)
        assert float(stream.average_rate) == 30.0
        assert float(stream.duration * stream.time_base) == pytest.approx(1.5)
        decoded = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(decoded) == 45
    levels = [float(frame[150:, :].mean()) for frame in decoded]
    # Lossy, but by far less than the 4 that lie between two frames.
    np.testing.assert_allclose(levels, 4.0 * np.arange(45), atol=2.0)


def test_a_gif_loops_and_lasts_as_long_as_its_frames(tmp_path):
    path = tmp_path / "a.gif"
    encode(frames(45), path, 15.0, 45)
    with Image.open(path) as stored:
        assert (stored.n_frames, stored.size, stored.info["loop"]) == (45, (320, 240), 0)
        durations = []
        for k in range(45):
            stored.seek(k)
            durations.append(stored.info["duration"])
    # A GIF counts hundredths of a second: 15 frames a second are 6 or 7 of them each.
    assert set(durations) == {60, 70}
    assert sum(durations) == 3000


@pytest.mark.parametrize("name", ["a.gif", "a.mp4"])
def test_a_video_that_breaks_off_leaves_nothing(tmp_path, name):
    if name.endswith("mp4"):
        pytest.importorskip("av")

    def breaking():
        yield from frames(30)
        raise OutputError("the video could not be drawn: out of memory.")

    with pytest.raises(OutputError, match="could not be drawn"):
        encode(breaking(), tmp_path / name, 30.0, 40)
    assert list(tmp_path.iterdir()) == []
