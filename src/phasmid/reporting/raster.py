"""A picture in pixels within a figure."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import UInt8
from matplotlib.axes import Axes
from matplotlib.image import AxesImage


class Raster(AxesImage):
    """A picture that fills its axes, from above to below and from left to right.

    Where each of its pixels is one of the file's it is shown as it is; matplotlib, which would
    sample it anew, does that at all other sizes.

    Args:
        axes: Which it fills, with a pixel of it as the unit.
        pixels: Red, green and blue.
    """

    def __init__(self, axes: Axes, pixels: UInt8[np.ndarray, "height width 3"]) -> None:
        height, width = pixels.shape[:2]
        super().__init__(axes, interpolation="none", extent=(0, width, height, 0), origin="upper")
        self.set_data(pixels)
        axes.set(xlim=(0, width), ylim=(height, 0))
        axes.add_image(self)
        self.set_clip_path(axes.patch)

    def make_image(
        self, renderer: Any, magnification: float = 1.0, unsampled: bool = False
    ) -> tuple[np.ndarray, float, float, Any]:
        """What is drawn where, as matplotlib asks for it: from below to above."""
        pixels, box = np.asarray(self.get_array()), self.axes.bbox
        height, width = pixels.shape[:2]
        asked, shown = (0, width, height, 0), (*self.axes.get_xlim(), *self.axes.get_ylim())
        whole = (*self.get_extent(), *shown, box.width, box.height)
        is_own = np.allclose(whole, (*asked, *asked, width, height), rtol=0, atol=1e-6)
        if not is_own or unsampled or magnification != 1 or self.get_alpha() is not None:
            return super().make_image(renderer, magnification, unsampled)
        image = np.full((height, width, 4), 255, dtype=np.uint8)
        image[..., :3] = pixels[::-1]
        return image, float(box.x0), float(box.y0), None
