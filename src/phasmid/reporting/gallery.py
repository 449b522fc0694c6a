"""All pictures of a run's folder and of its page, each as its files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

from phasmid.recording import Recording
from phasmid.reporting.catalogue import listed
from phasmid.reporting.drawing import can_be_drawn, walk_picture
from phasmid.reporting.runs import gather
from phasmid.reporting.style import encoded_figure
from phasmid.robot import Appearance

Files: TypeAlias = Mapping[str, bytes]
"""A picture by the endings of its files, ``svg`` and ``png``."""

WALK = "walk"
"""Name of the picture of the robot."""


class Gallery:
    """The pictures of a recording; which process draws one does not show in its bytes.

    Args:
        recording: What they show.
        appearance: The robot's meshes, where they do not come with phasmid.

    Attributes:
        kinds: Of each figure by the stem of its file, in the page's order.
        names: Of all pictures, that of the robot last.
    """

    def __init__(self, recording: Recording, appearance: Appearance | None = None) -> None:
        self.recording, self.appearance = recording, appearance
        self._runs = gather([recording])
        sheets = list(listed(self._runs[0]))
        self.kinds = {name: kind for name, kind, _ in sheets}
        self._legs = {name: legs for name, _, legs in sheets}
        self.names = (*self.kinds, *([WALK] if can_be_drawn(recording) else []))

    def drawn(self, name: str) -> Files:
        """Draw a picture.

        Args:
            name: One of `names`.
        """
        if name == WALK:
            picture = walk_picture(self.recording, self.appearance)
            return {"png": encoded_figure(picture, "png")}
        kind = self.kinds[name]
        figure = kind.draw(self._runs, self._legs[name])
        files = {"svg": encoded_figure(figure, "svg")}
        if kind.in_folder:
            files["png"] = encoded_figure(figure, "png")
        return files
