"""Measured over true values of the last cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from phasmid.errors import InvalidInput
from phasmid.kinematics import quaternion_rotation
from phasmid.reporting.figure_layout import panel_figure, time_axis
from phasmid.reporting.runs import Run, shared_caption
from phasmid.reporting.style import JOINT_COLOURS, Figure, darker, styled, thin

SENSOR_CHANNELS = (
    "joint_position_measured",
    "joint_load_measured",
    "foot_normal_force_measured",
    "imu_angular_velocity",
    "imu_acceleration",
)
"""Measured channels that are drawn; one suffices."""

TRUE_LINE: dict[str, Any] = {"color": "#b9bec7", "linewidth": 2.4}
MEASURED_LINE: dict[str, Any] = {"color": darker(JOINT_COLOURS[1]), "linewidth": 1.0}

LEG, FEMUR, Y, Z = 0, 1, 1, 2


def sensor_figure(runs: Sequence[Run], legs: tuple[int, ...]) -> Figure:
    """Draw measured over true values of leg 1 and the body in the last cycle.

    Args:
        runs: One.
        legs: Ignored.

    Raises:
        InvalidInput: Nothing measured is recorded.
    """
    del legs
    run = runs[0]
    first = run.time[-1] - run.source.scenario.stride.period - 1e-9
    run = replace(run, recording=run.recording.sel(time=slice(first, None)))
    pairs = [
        (label, measured, true) for label, measured, true in _pairs(run) if measured is not None
    ]
    if not pairs:
        raise InvalidInput(
            "the recording holds nothing that sensors measured.", hint="--measured everything"
        )
    with styled():
        drawing = panel_figure(
            "Measured and true values, last cycle, leg 1 and body",
            shared_caption([run]),
            [1.1] * len(pairs),
            share_y=False,
            left=0.13,
            right=0.965,
            gap=0.2,
        )
        for axis, (label, measured, true) in zip(drawing.axes, pairs, strict=True):
            if true is not None:
                axis.plot(*thin(run.time, true), **TRUE_LINE)
            # A reading stands until the next one arrives.
            axis.step(run.time, measured, where="post", **MEASURED_LINE)
            axis.set_ylabel(label)
        time_axis(drawing.axes[-1], run.time)
        drawing.figure.align_ylabels(drawing.axes)
        drawing.add_legend([("true", TRUE_LINE), ("measured", MEASURED_LINE)])
    return drawing.figure


def _pairs(run: Run) -> list[tuple[str, np.ndarray | None, np.ndarray | None]]:
    """Return label, measured values and true values of each panel; None where not recorded."""
    spin, orientation = run.channel("body_angular_velocity"), run.channel("body_orientation")
    if spin is not None and orientation is not None:
        spin = np.einsum("tji,tj->ti", quaternion_rotation(orientation), spin)

    def of(values: Any, *index: int, scale: float = 1.0) -> np.ndarray | None:
        return None if values is None else scale * values[:, *index]

    def joint(name: str, scale: float = 1.0) -> np.ndarray | None:
        return of(run.channel(name), LEG, FEMUR, scale=scale)

    def foot(name: str) -> np.ndarray | None:
        return of(run.channel(name), LEG)

    deg = float(np.degrees(1.0))
    gyro = of(run.channel("imu_angular_velocity"), Y, scale=deg)
    return [
        ("femur [°]", joint("joint_position_measured", deg), joint("joint_position", deg)),
        ("femur load [1]", joint("joint_load_measured"), joint("servo_duty")),
        ("foot [N]", foot("foot_normal_force_measured"), foot("foot_normal_force")),
        ("gyro y [°/s]", gyro, of(spin, Y, scale=deg)),
        ("acc. z [m/s²]", of(run.channel("imu_acceleration"), Z), None),
    ]
