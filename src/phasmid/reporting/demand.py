"""What a figure needs of a recording, and how one gets what is lacking."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.reporting.source import channel

Needs = tuple[tuple[str, ...], ...]
"""Of each group of channels a figure needs one."""


def lacking(recording: Recording, needs: Needs) -> tuple[str, ...]:
    """The first group of which the recording has no channel; empty where it has all it takes."""
    for group in needs:
        if not any(name in recording.data_vars for name in group):
            return group
    return ()


def check_needs(recording: Recording, needs: Needs, figure: str) -> None:
    """Refuse a recording that lacks what a figure shows.

    Args:
        recording: What was seen.
        needs: Of each group one channel.
        figure: Its name.

    Raises:
        InvalidInput: A channel is lacking.
    """
    group = lacking(recording, needs)
    if group:
        raise InvalidInput(
            f"the recording has no {' or '.join(group)}; the figure {figure} needs it.",
            hint=how_to_get(group[0]),
        )


def first_channel(recording: Recording, names: Sequence[str]) -> tuple[str, np.ndarray]:
    """Name and numbers of the first channel that the recording has.

    Raises:
        InvalidInput: It has none of them.
    """
    for name in names:
        values = channel(recording, name)
        if values is not None:
            return name, values
    raise InvalidInput(
        f"the recording has no {' or '.join(names)}; this figure needs it.",
        hint=how_to_get(names[0]),
    )


def how_to_get(name: str) -> str:
    """What to run so that a recording has a channel."""
    if name.startswith("servo_"):
        return "phasmid walk --drive servo records it"
    if name.endswith("_measured") or name.startswith("imu_"):
        return "phasmid walk --measured everything records it"
    if name.endswith("_model"):
        return "phasmid walk and phasmid.analyse record it"
    if name.endswith("_target") or name == "stance":
        return "phasmid walk records it, from its plan"
    return "phasmid walk and phasmid.simulate record it"
