"""Height maps from files: images, arrays and tables of numbers."""

from __future__ import annotations

import hashlib
import re
import warnings
from array import array
from pathlib import Path

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, PhasmidError
from phasmid.terrain.height_map import MOST_SAMPLES, check_count, check_finite, check_samples
from phasmid.toml import is_file

IMAGES = ("PNG", "JPEG", "TIFF", "PPM", "BMP")
"""Formats of images that are read; others of pillow's would start foreign programs."""

LARGEST_FILE = 200_000_000
"""Files above this many bytes are refused before they are read."""

LONGEST_LINE = 32 * 65536
"""Longest line of a table that is read [bytes]."""


def read_heights(path: Path, *, white: float) -> Float[np.ndarray, "rows columns"]:
    """Read heights from a file.

    Args:
        path: A grey image (``.png``, ``.jpg``, ``.tif``, ``.pgm``, ``.bmp``; colours count as
            their grey), an array (``.npy``, in metres) or a table (``.csv``, in metres).
        white: Height of white in an image [m]; black is 0.

    Returns:
        Heights [m], in single precision, so that they can be kept exactly in little room.

    Raises:
        InvalidInput: There is no such file, or it holds no height map.
    """
    if not is_file(path):
        raise InvalidInput(
            f'terrain file "{path.name}" does not exist in {path.absolute().parent}.'
        )
    size = path.stat().st_size
    if size > LARGEST_FILE:
        raise InvalidInput(
            f'terrain file "{path.name}" holds {size} bytes; a height map holds at most '
            f"{LARGEST_FILE}."
        )
    kind = path.suffix.lower()
    try:
        if kind == ".npy":
            heights = _array(path)
        elif kind == ".csv":
            heights = _table(path)
        else:
            heights = white * _image(path)
        # Beyond single precision is infinite, which is refused below.
        with np.errstate(over="ignore"):
            heights = heights.astype(np.float32).astype(np.float64)
    except PhasmidError:
        raise
    except Exception as error:
        # A damaged file can raise any exception in its reader.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InvalidInput(
            f'terrain file "{path.name}" cannot be read: {reason[:120]}.',
            hint="a grey .png, a .npy or a .csv",
        ) from None
    check_finite(heights)
    return heights


def file_hash(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal.

    Args:
        path: A file that `read_heights` has read.
    """
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _image(path: Path) -> np.ndarray:
    """Return the brightness from 0 to 1."""
    from PIL import Image

    with warnings.catch_warnings():
        # The size is refused by our own limit, which is the lower one.
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        try:
            opened = Image.open(path, formats=IMAGES)
        except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
            found = re.search(r"\d+", str(error))
            check_count(int(found.group()) if found else MOST_SAMPLES + 1)
            raise
    with opened as image:
        check_samples(image.height, image.width)
        if image.mode.startswith("I"):
            return np.asarray(image, dtype=float) / 65535
        if image.mode == "F":
            raise InvalidInput(
                f'terrain file "{path.name}" holds numbers of 32 bits; an image must be grey, with '
                "8 or 16 bits.",
                hint="a .npy of heights in metres",
            )
        return np.asarray(image.convert("L"), dtype=float) / 255


def _array(path: Path) -> np.ndarray:
    """Read heights from a NumPy file, without Python objects."""
    with path.open("rb") as file:
        version = np.lib.format.read_magic(file)
        read = {(1, 0): np.lib.format.read_array_header_1_0}
        head = read.get(version, np.lib.format.read_array_header_2_0)(file)
    shape, dtype = head[0], head[2]
    if dtype.hasobject:
        raise InvalidInput(
            f"{path.name} stores Python objects, which are never loaded.", hint="plain numbers"
        )
    if len(shape) != 2 or dtype.kind not in "fiu":
        raise InvalidInput(
            f'terrain file "{path.name}" holds an array of {dtype} of shape {shape}; a height map '
            "is a table of numbers, rows by columns."
        )
    check_samples(*shape)
    return np.asarray(np.load(path, allow_pickle=False), dtype=float)


def _table(path: Path) -> np.ndarray:
    """Read heights from comma-separated values."""
    # Eight bytes a sample: a list of rows takes a hundred more for each row.
    heights, rows, columns = array("d"), 0, 0
    with path.open("rb") as file:
        for number, line in enumerate(iter(lambda: file.readline(LONGEST_LINE + 1), b""), 1):
            if len(line) > LONGEST_LINE:
                raise InvalidInput(
                    f'terrain file "{path.name}" line {number} is longer than {LONGEST_LINE} bytes.'
                )
            if not line.strip():
                continue
            try:
                heights.extend(map(float, line.split(b",")))
            except ValueError:
                raise InvalidInput(
                    f'terrain file "{path.name}" line {number} does not hold numbers with commas '
                    "between them."
                ) from None
            found = len(heights) - rows * columns
            if rows and found != columns:
                raise InvalidInput(
                    f'terrain file "{path.name}" line {number} has {found} numbers; the lines '
                    f"before it have {columns}."
                )
            if rows and found < 2:
                raise InvalidInput("height map has 1 column; it needs at least 2 × 2 samples.")
            check_count(len(heights))
            rows, columns = rows + 1, found
    check_samples(rows, columns)
    return np.frombuffer(heights).reshape(rows, columns)
