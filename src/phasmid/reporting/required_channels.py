"""The channels that a figure requires, and how to record an absent one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.recording import Recording
from phasmid.reporting.source import channel

Needs = tuple[tuple[str, ...], ...]
"""Groups of channels; a figure requires one of each."""


def missing_group(recording: Recording, needs: Needs) -> tuple[str, ...]:
    """Return the first group without a recorded channel; empty where there is none."""
    for group in needs:
        if not any(name in recording.data_vars for name in group):
            return group
    return ()


def check_needs(recording: Recording, needs: Needs, figure: str) -> None:
    """Raise InvalidInput where the recording lacks a channel of a figure."""
    group = missing_group(recording, needs)
    if group:
        raise _absent(group, f"the figure {figure}")


def first_channel(recording: Recording, names: Sequence[str]) -> tuple[str, np.ndarray]:
    """Return name and values of the first recorded channel.

    Raises:
        InvalidInput: None of them is recorded.
    """
    for name in names:
        values = channel(recording, name)
        if values is not None:
            return name, values
    raise _absent(names, "this figure")


def _absent(names: Sequence[str], what: str) -> InvalidInput:
    return InvalidInput(
        f"the recording has no {' or '.join(names)}; {what} needs it.", hint=how_to_get(names[0])
    )


def how_to_get(name: str) -> str:
    """Return the command that records a channel."""
    if name.startswith("servo_"):
        return "phasmid walk --drive servo records it"
    if name.endswith("_measured") or name.startswith("imu_"):
        return "phasmid walk --measured everything records it"
    if name.endswith("_model"):
        return "phasmid walk and phasmid.analyse record it"
    if name.endswith("_target") or name == "stance":
        return "phasmid walk records it, from its plan"
    return "phasmid walk and phasmid.simulate record it"
