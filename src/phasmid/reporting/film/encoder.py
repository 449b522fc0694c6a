"""Frames as a file: MP4 by PyAV, GIF by Pillow; it appears whole or not at all."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from phasmid.errors import OutputError, plain
from phasmid.recording.file import whole_file

QUALITY = "21"
"""Constant quality of H.264: lower is better and larger."""

SAMPLED = 24
"""First frames of a GIF from which its colours are chosen."""


def encode(frames: Iterator[np.ndarray], path: Path, fps: float, count: int) -> None:
    """Write frames as a video.

    Args:
        frames: Frames of one size, an even one for MP4, each of shape (height, width, 3).
        path: File ending in ``.mp4`` or ``.gif``.
        fps: Frames per second.
        count: Number of frames.

    Raises:
        OutputError: The file cannot be written; nothing is left behind.
    """
    with whole_file(path) as file:
        if path.suffix.lower() == ".gif":
            _write_gif(frames, file, fps, count)
        else:
            _write_mp4(frames, file, fps)


def _write_mp4(frames: Iterator[np.ndarray], file: BinaryIO, fps: float) -> None:
    import av

    try:
        with av.open(file, "w", format="mp4") as container:
            rate = Fraction(fps).limit_denominator(1001)
            stream: Any = container.add_stream("h264", rate=rate)
            stream.pix_fmt = "yuv420p"
            stream.options = {"crf": QUALITY, "preset": "veryfast"}
            first = next(frames)
            stream.height, stream.width = first.shape[:2]
            for pixels in itertools.chain([first], frames):
                frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(pixels), format="rgb24")
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))
    except av.FFmpegError as error:
        if isinstance(error, OSError) and error.errno:
            raise
        raise OutputError(f"the video could not be encoded: {plain(str(error))[:200]}.") from None


def _write_gif(frames: Iterator[np.ndarray], file: BinaryIO, fps: float, count: int) -> None:
    from PIL import Image

    # One palette for all frames, chosen from some of the first: others would flicker.
    first = list(itertools.islice(frames, SAMPLED))
    montage = Image.fromarray(np.concatenate(first[:: max(len(first) // 6, 1)]))
    palette = montage.quantize(256, method=Image.Quantize.FASTOCTREE)
    drawn = (
        Image.fromarray(np.ascontiguousarray(pixels)).quantize(
            palette=palette, dither=Image.Dither.NONE
        )
        for pixels in itertools.chain(first, frames)
    )
    # A GIF counts hundredths of a second.
    ends = np.round(100 / fps * np.arange(count + 1)).astype(int)
    next(drawn).save(
        file,
        "GIF",
        save_all=True,
        append_images=drawn,
        duration=[10 * int(lasts) for lasts in np.diff(ends)],
        loop=0,
        disposal=1,
    )
