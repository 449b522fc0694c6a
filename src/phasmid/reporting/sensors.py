"""What sensors told beside what was true."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.kinematics import quaternion_rotation
from phasmid.recording import Recording
from phasmid.reporting.sheet import caption, legend, sheet
from phasmid.reporting.source import channel, read_source
from phasmid.reporting.style import JOINT_COLOURS, Figure, darker, styled, thin

SENSOR_CHANNELS = (
    "joint_position_measured",
    "joint_load_measured",
    "foot_normal_force_measured",
    "imu_angular_velocity",
    "imu_acceleration",
)
"""What is drawn of what sensors told; one of these makes a figure."""

TRUE_COLOUR = "#b9bec7"
LEG, FEMUR, UP = 0, 1, 2
"""Of the many channels those are drawn that say most: leg 1, its femur, and the upright axis."""


@dataclass(frozen=True, eq=False)
class _Pair:
    """A quantity as it was and as it was told; what was true may not be known."""

    label: str
    told: np.ndarray
    true: np.ndarray | None


def sensor_figure(recording: Recording) -> Figure:
    """What sensors told in the last cycle, over what was true.

    Raises:
        InvalidInput: The recording holds nothing that sensors told.
    """
    source = read_source(recording)
    time = np.asarray(recording["time"].values)
    period = source.scenario.stride.period
    recording = recording.isel(
        time=slice(int(np.searchsorted(time, time[-1] - period - 1e-9)), None)
    )
    found = [pair for pair in _pairs(recording) if pair is not None]
    if not found:
        raise InvalidInput(
            "the recording holds nothing that sensors told.", hint="--measured everything"
        )
    time = np.asarray(recording["time"].values)
    with styled():
        drawing = sheet(
            "What sensors tell, last cycle, leg 1 and body",
            caption(recording, source),
            [1.1] * len(found),
            share_y=False,
            left=0.13,
            right=0.965,
            gap=0.2,
        )
        grid = drawing.axes
        for axis, pair in zip(grid, found, strict=True):
            if pair.true is not None:
                axis.plot(*thin(time, pair.true), color=TRUE_COLOUR, linewidth=2.4)
            # A reading stands until the next one arrives.
            colour = darker(JOINT_COLOURS[1])
            axis.step(time, pair.told, where="post", color=colour, linewidth=1.0)
            axis.set_ylabel(pair.label)
        grid[-1].set_xlabel("time [s]")
        grid[-1].set_xlim(time[0], time[-1])
        drawing.figure.align_ylabels(grid)
        legend(drawing, [("true", TRUE_COLOUR, "-"), ("measured", darker(JOINT_COLOURS[1]), "-")])
    return drawing.figure


def _pairs(recording: Recording) -> list[_Pair | None]:
    degrees, at = np.degrees(1.0), (slice(None), LEG, FEMUR)
    up = (slice(None), UP)
    spin = channel(recording, "body_angular_velocity")
    orientation = channel(recording, "body_orientation")
    if spin is not None and orientation is not None:
        spin = np.einsum("tji,tj->ti", quaternion_rotation(orientation), spin)
    return [
        _pair(recording, "femur [°]", "joint_position", "joint_position_measured", at, degrees),
        _pair(recording, "femur load [1]", "servo_duty", "joint_load_measured", at),
        _pair(recording, "foot [N]", "foot_normal_force", "foot_normal_force_measured", at[:2]),
        _pair(recording, "gyro y [°/s]", spin, "imu_angular_velocity", (slice(None), 1), degrees),
        _pair(recording, "acc. z [m/s²]", None, "imu_acceleration", up),
    ]


def _pair(
    recording: Recording,
    label: str,
    true: str | np.ndarray | None,
    told: str,
    of: tuple[Any, ...],
    scale: float = 1.0,
) -> _Pair | None:
    values = channel(recording, told)
    if values is None:
        return None
    known = channel(recording, true) if isinstance(true, str) else true
    return _Pair(label, scale * values[of], None if known is None else scale * known[of])
