"""Height maps from files: images, arrays and tables of numbers."""

from __future__ import annotations

import math
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, PhasmidError, WrongContent, own_words
from phasmid.terrain.height_map import check_finite, check_most_samples, check_samples
from phasmid.toml import is_file

IMAGES = ("PNG", "JPEG", "TIFF", "PPM", "BMP")
"""Formats of images that are read; others of pillow's would start foreign programs."""

LARGEST_FILE = 200_000_000
"""Files above this many bytes are refused before they are read."""


def read_heights(path: Path, *, white: float) -> Float[np.ndarray, "rows columns"]:
    """Read heights from a file.

    Args:
        path: A grey image (``.png``, ``.jpg``, ``.tif``, ``.pgm``, ``.bmp``; colours count as
            their grey), an array (``.npy``, in metres) or a table (``.csv``, in metres).
        white: Height of white in an image [m]; black is 0.

    Returns:
        Heights [m], rounded to single precision, so that a short text holds them exactly.

    Raises:
        InvalidInput: There is no such file, or it holds no height map.
    """
    name = f'terrain file "{path.name}"'
    if not is_file(path):
        raise InvalidInput(f"{name} does not exist in {path.absolute().parent}.")
    size = path.stat().st_size
    if size > LARGEST_FILE:
        raise InvalidInput(f"{name} holds {size} bytes; the limit is {LARGEST_FILE}.")
    kind = path.suffix.lower()
    try:
        # What warnings announce, huge images and overflow, is refused below.
        with warnings.catch_warnings(action="ignore"), np.errstate(over="ignore"):
            if kind == ".npy":
                heights = _array(path)
            elif kind == ".csv":
                heights = _table(path)
            else:
                heights = white * _image(path)
            heights = heights.astype(np.float32).astype(np.float64)
    except PhasmidError:
        raise
    except Exception as error:
        # A damaged file can raise any exception in its reader.
        raise InvalidInput(
            f"{name} cannot be read{own_words(error)}.",
            hint="a grey .png, a .npy or a .csv",
        ) from None
    check_finite(heights)
    return heights


def _image(path: Path) -> np.ndarray:
    """Return the brightness from 0 to 1."""
    from PIL import Image

    with Image.open(path, formats=IMAGES) as image:
        check_samples(image.height, image.width)
        if image.mode.startswith("I"):
            return np.asarray(image, dtype=float) / 65535
        if image.mode == "F":
            raise WrongContent("an image must be grey, with 8 or 16 bits")
        return np.asarray(image.convert("L"), dtype=float) / 255


def _array(path: Path) -> np.ndarray:
    """Read heights from a NumPy file, without Python objects."""
    # Mapped: the size in the header is compared with the file's before memory is allocated.
    heights = np.load(path, mmap_mode="r", allow_pickle=False)
    if heights.ndim != 2 or heights.dtype.kind not in "fiu":
        raise WrongContent(
            f"an array of {heights.dtype} of shape {heights.shape} is no table of numbers"
        )
    check_samples(*heights.shape)
    return np.asarray(heights, dtype=float)


def _table(path: Path) -> np.ndarray:
    """Read heights from comma-separated values; NaN for text."""
    columns = rows = 0
    with path.open(encoding="utf-8-sig") as file:
        for line in filter(str.strip, file):
            rows, cells = rows + 1, line.count(",") + 1
            columns = columns or cells
            check_most_samples(rows, columns)
            if cells != columns:
                raise InvalidInput(
                    f"height map has {cells} numbers in row {rows} and {columns} in row 1; "
                    "all rows must have the same."
                )
    check_samples(rows, columns)
    reading: dict[str, Any] = {"delimiter": ",", "comments": None, "quotechar": '"'}
    # Ten times slower with a converter, whose NaN shows the place of text.
    for settings in (reading, {**reading, "converters": _number}):
        with path.open(encoding="utf-8-sig") as file, suppress(ValueError):
            # NumPy counts a line of blanks as a row.
            return np.loadtxt(filter(str.strip, file), **settings, ndmin=2)
    raise WrongContent("it is no table of numbers")


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
