"""Files of bench logs: CSV with units in the heading, and recordings."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from phasmid.csv_table import check_times, read_csv_table
from phasmid.errors import InvalidInput, located, nearest
from phasmid.identification.logs import BenchLog, Pendulum
from phasmid.identification.robot_log import (
    LONGEST,
    POSITION_CHANNELS,
    check_log_file,
    first_channel,
)
from phasmid.recording import load_recording
from phasmid.units import UNITS

COLUMNS = {"time": "time", "target": "angle", "position": "angle", "powered": ""}
"""Columns of a log and their dimensions; the last one may be absent."""


def load_bench_log(
    path: str | Path, pendulum: Pendulum, voltage: float, *, joint: str = ""
) -> BenchLog:
    """Read a log of a servo on a bench.

    Args:
        path: A ``.csv`` file with the columns ``time [s]``, ``target [deg]``, ``position [deg]``
            and maybe ``powered`` (1 or 0), in other units of time and angle too; or a recording.
        pendulum: Load of the servo.
        voltage: Its supply [V].
        joint: Of a recording, such as ``right_front.femur``.

    Raises:
        InvalidInput: The file is absent or not well formed, or its times do not increase.
    """
    path = Path(path)
    check_log_file(path)
    with located(path.name):
        if path.suffix == ".csv":
            columns = _read_csv(path)
        elif path.suffix in (".nc", ".mcap"):
            columns = _read_recording(path, joint)
        else:
            raise InvalidInput(f"{path} is no log that can be read.", hint="a .csv or .nc file")
        time = columns["time"]
        if len(time) < 2:
            raise InvalidInput(f"the log has {len(time)} rows; it must have 2 or more.")
        check_times(time)
        for name, values in columns.items():
            bad = np.flatnonzero(~np.isfinite(values))
            if len(bad):
                raise InvalidInput(f"{name} in row {bad[0] + 1} of the log is no number.")
        if time[-1] - time[0] > LONGEST:
            raise InvalidInput(
                f"the log lasts {time[-1] - time[0]:g} s; at most {LONGEST:g} s are read.",
                hint="the unit of the column time",
            )
    powered = columns["powered"] > 0.5
    return BenchLog(
        path.stem, time, columns["target"], columns["position"], powered, pendulum, voltage
    )


def _read_csv(path: Path) -> dict[str, np.ndarray]:
    """Return the columns of a table whose headings have units in brackets."""
    import pandas

    frame = read_csv_table(path, "log")
    found = {}
    for index, heading in enumerate(frame):
        name, _, unit = re.fullmatch(r"\s*(.*?)\s*(\[(.*)\])?\s*", str(heading)).groups()  # type: ignore[union-attr]
        if name in COLUMNS:
            column = pandas.to_numeric(frame.iloc[:, index], errors="coerce")
            found[name] = column.to_numpy(dtype=float) / _per_si(name, unit or "")
    for name in ("time", "target", "position"):
        if name not in found:
            guess = nearest(name, [str(heading) for heading in frame])
            raise InvalidInput(
                f'the log has no column "{name}".',
                hint=f'"{guess}"' if guess else "time [s],target [deg],position [deg]",
            )
    found.setdefault("powered", np.ones(len(frame)))
    return found


def _per_si(name: str, unit: str) -> float:
    """Return how many of a column's unit make the SI unit."""
    dimension = COLUMNS[name]
    if not dimension:
        return 1.0
    known = {key: one for key, one in UNITS.items() if one.dimension == dimension}
    for key, one in known.items():
        if unit in (key, one.symbol):
            return one.per_si
    raise InvalidInput(
        f'column "{name}" has the unit "{unit}"; it must be one of {", ".join(known)}.',
        hint=f"{name} [{'s' if dimension == 'time' else 'deg'}]",
    )


def _read_recording(path: Path, joint: str) -> dict[str, np.ndarray]:
    """Return the columns of one joint of a recording."""
    recording = load_recording(path)
    target = recording.get("joint_position_target")
    position = first_channel(recording, POSITION_CHANNELS)
    if target is None or position is None:
        raise InvalidInput("the recording has no joint angles with their targets.")
    leg, _, name = joint.partition(".")
    legs, joints = (list(map(str, target[axis].values)) for axis in ("leg_name", "joint"))
    if leg not in legs or name not in joints:
        raise InvalidInput(
            f'the recording has no joint "{joint}".', hint=f"--joint {legs[0]}.{joints[1]}"
        )
    column = legs.index(leg), joints.index(name)
    time = np.asarray(recording["time"].values, dtype=float)
    return {
        "time": time,
        "target": np.asarray(target.values[:, *column], dtype=float),
        "position": np.asarray(position.values[:, *column], dtype=float),
        "powered": np.ones(len(time)),
    }
