"""Words in a picture, in the letters of our figures."""

from __future__ import annotations

from functools import cache
from typing import TypeAlias

from PIL import ImageFont

Font: TypeAlias = ImageFont.FreeTypeFont


@cache
def font(size: int, *, bold: bool = False) -> Font:
    """Letters of a height in pixels."""
    from matplotlib.font_manager import FontProperties, findfont

    kind = FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal")
    return ImageFont.truetype(findfont(kind), size)


def fitted(words: str, letters: Font, width: float) -> str:
    """Words that are cut off where they are wider than some pixels."""
    if letters.getlength(words) <= width:
        return words
    kept = len(words)
    while kept and letters.getlength(f"{words[:kept].rstrip()} …") > width:
        kept = min(kept - 1, int(0.95 * kept))
    return f"{words[:kept].rstrip()} …"
