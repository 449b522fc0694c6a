"""Gait diagrams in text."""

from __future__ import annotations

import numpy as np

from phasmid.gait.gait import Gait

STANDS, LIFTED = "█", "·"
"""A foot on the ground, and in the air."""

COLUMNS = 48
"""Parts of a cycle: the fractions of all gaits of four, six and eight legs divide it."""


def gait_diagram(gait: Gait, columns: int = COLUMNS) -> tuple[str, ...]:
    """Return one line per leg, a cycle from left to right.

    Args:
        gait: The gait.
        columns: Characters of a line.
    """
    stance = gait.stance((np.arange(columns) + 0.5) / columns)
    return tuple("".join(STANDS if stands else LIFTED for stands in leg) for leg in stance.T)
