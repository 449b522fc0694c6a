"""Height maps as text, for scenarios that contain one."""

from __future__ import annotations

import base64
import re
import zlib

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.terrain.height_map import check_samples

BEGINNING = "map:"
"""How the text of a height map begins; no file is called so."""

LONGEST = 750_000
"""Longest text that a scenario carries, which leaves it a file that is read again."""


def height_text(heights: Float[np.ndarray, "rows columns"]) -> str:
    """Return a height map as text: its size, then its numbers in single precision, packed.

    Args:
        heights: In metres, rounded to single precision.
    """
    rows, columns = heights.shape
    # Bytes of equal weight side by side pack better.
    planes = heights.astype("<f4").reshape(-1, 1).view(np.uint8).T
    packed = base64.b85encode(zlib.compress(planes.tobytes(), 9)).decode("ascii")
    return f"{BEGINNING}{rows}x{columns}:{packed}"


def heights_from_text(text: str) -> Float[np.ndarray, "rows columns"]:
    """Return the heights [m] of a text.

    Raises:
        InvalidInput: It is not one.
    """
    found = re.fullmatch(rf"{BEGINNING}(\d{{1,9}})x(\d{{1,9}}):(.*)", text)
    if not found:
        raise InvalidInput("the height map's text has no size.")
    rows, columns = int(found.group(1)), int(found.group(2))
    check_samples(rows, columns)
    size = 4 * rows * columns
    try:
        unpacking = zlib.decompressobj()
        planes = unpacking.decompress(base64.b85decode(found.group(3)), size + 1)
    except (ValueError, zlib.error):
        planes = b""
    if len(planes) != size:
        raise InvalidInput(
            f"the height map's text is damaged: it does not hold {rows} × {columns} samples."
        )
    numbers = np.frombuffer(planes, np.uint8).reshape(4, -1).T.copy().view("<f4")
    return numbers.reshape(rows, columns).astype(np.float64)
