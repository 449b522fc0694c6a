"""All pictures of a run's folder and of its page, each as its files."""

from __future__ import annotations

from typing import TypeAlias

from phasmid.recording import Recording
from phasmid.reporting.catalogue import listed
from phasmid.reporting.drawing import can_be_drawn, walk_picture
from phasmid.reporting.runs import gather
from phasmid.reporting.style import Figure, encoded_figure, styled
from phasmid.robot import Appearance

File: TypeAlias = tuple[str, str]
"""A picture's name and its file's ending, ``svg`` or ``png``."""

WALK: File = ("walk", "png")
"""The picture of the robot."""


class Gallery:
    """The pictures of a recording; which process draws one does not show in its bytes.

    Args:
        recording: What they show.
        appearance: The robot's meshes, where they do not come with phasmid.

    Attributes:
        kinds: Of each figure by the stem of its file, in the page's order.
        of_page: What the page shows, the picture of the robot last.
        of_folder: What the folder has besides.
    """

    def __init__(self, recording: Recording, appearance: Appearance | None = None) -> None:
        self.recording, self.appearance = recording, appearance
        self._runs = gather([recording])
        sheets = list(listed(self._runs[0]))
        self.kinds = {name: kind for name, kind, _ in sheets}
        self._legs = {name: legs for name, _, legs in sheets}
        self._figures: dict[str, Figure] = {}
        robot = [WALK] if can_be_drawn(recording) else []
        self.of_page: tuple[File, ...] = (*((name, "svg") for name in self.kinds), *robot)
        self.of_folder: tuple[File, ...] = tuple(
            (name, "png") for name, kind in self.kinds.items() if kind.in_folder
        )

    def drawn(self, file: File) -> bytes:
        """Draw a picture.

        Args:
            file: Of `of_page` or `of_folder`.
        """
        with styled():
            return self._drawn(file)

    def _drawn(self, file: File) -> bytes:
        name, ending = file
        if file == WALK:
            return encoded_figure(walk_picture(self.recording, self.appearance), ending)
        figure = self._figures.pop(name, None)
        if figure is None:
            kind = self.kinds[name]
            figure = kind.draw(self._runs, self._legs[name])
            if kind.in_folder:
                # The other of its two files is drawn later.
                self._figures[name] = figure
        return encoded_figure(figure, ending)
