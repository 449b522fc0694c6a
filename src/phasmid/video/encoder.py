"""Frames as a file: MP4 by PyAV, GIF by Pillow; it appears whole or not at all."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from PIL import Image

from phasmid.errors import OutputError, plain
from phasmid.recording.file import whole_file
from phasmid.reporting.shapes import rgb
from phasmid.reporting.style import LEG_COLOURS
from phasmid.video.probe import h264_encoder

QUALITY = "21"
"""Constant quality of H.264: lower is better and larger."""

COLOURS, SAMPLED = 144, 24
"""Colours of a GIF, and how many of its first frames they are chosen from."""

SHADES, PALE = (1.0, 0.76, 0.52), 0.38
"""Brightnesses of the legs' colours that a GIF keeps, and the strength of their pale ones."""


def encode(frames: Iterator[Image.Image], path: Path, fps: float) -> None:
    """Write frames as a video.

    Args:
        frames: All of one size; of an even one for MP4.
        path: ``.mp4`` or ``.gif``.
        fps: Frames per second.

    Raises:
        OutputError: The file cannot be written; nothing is left behind.
    """
    write = _write_gif if path.suffix.lower() == ".gif" else _write_mp4
    with whole_file(path) as file:
        write(frames, file, fps)


def _write_mp4(frames: Iterator[Image.Image], file: BinaryIO, fps: float) -> None:
    import av

    rate = Fraction(fps).limit_denominator(1001)
    try:
        with av.open(file, "w", format="mp4") as container:
            stream: Any = None
            for image in frames:
                if stream is None:
                    stream = container.add_stream(h264_encoder() or "", rate=rate)
                    stream.width, stream.height = image.size
                    stream.pix_fmt = "yuv420p"
                    stream.options = {"crf": QUALITY, "preset": "veryfast"}
                frame = av.VideoFrame.from_ndarray(np.asarray(image), format="rgb24")
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))
    except av.FFmpegError as error:
        if isinstance(error, OSError) and error.errno:
            raise
        raise OutputError(f"the video could not be encoded: {plain(str(error))[:200]}.") from None


def _write_gif(frames: Iterator[Image.Image], file: BinaryIO, fps: float) -> None:
    first = list(itertools.islice(frames, SAMPLED))
    palette = _palette(first)
    drawn = (
        image.quantize(palette=palette, dither=Image.Dither.NONE)
        for image in itertools.chain(first, frames)
    )
    opening = next(drawn)
    opening.save(
        file,
        "GIF",
        save_all=True,
        append_images=drawn,
        duration=_Durations(fps),
        loop=0,
        disposal=1,
    )


class _Durations(list[int]):
    """How long each frame is shown [ms]; a GIF knows hundredths of a second, so they take turns."""

    def __init__(self, fps: float) -> None:
        super().__init__([0])
        self._fps = fps

    def __getitem__(self, frame: Any) -> Any:
        return 10 * (round(100 * (frame + 1) / self._fps) - round(100 * frame / self._fps))


def _palette(frames: list[Image.Image]) -> Image.Image:
    """Colours of all frames; those of the legs, in light and in shadow, are never given up."""
    legs = [rgb(colour) for colour in LEG_COLOURS]
    shades = [shade * leg for leg in legs for shade in SHADES] + [
        1 - PALE * (1 - leg) for leg in legs
    ]
    own = [round(255 * float(part)) for colour in shades for part in colour]
    width, height = frames[0].size
    chosen = frames[:: max(len(frames) // 6, 1)]
    montage = Image.new("RGB", (width, height * len(chosen)))
    for k, image in enumerate(chosen):
        montage.paste(image, (0, k * height))
    count = COLOURS - len(shades)
    found = montage.quantize(count, method=Image.Quantize.MEDIANCUT, kmeans=1).getpalette() or []
    colours = found[: 3 * count] + own
    palette = Image.new("P", (1, 1))
    palette.putpalette(colours + colours[-3:] * (256 - len(colours) // 3))
    return palette
