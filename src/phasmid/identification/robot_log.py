"""Log of a real robot: its joint targets, measured joints, and whatever else was measured.

`phasmid.identification.compare` compares it with a replay.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.csv_table import check_size, check_times, read_csv_table
from phasmid.errors import InvalidInput, located, nearest
from phasmid.motion.trajectory import LARGEST_ANGLE, joint_names
from phasmid.recording import Recording
from phasmid.robot import Robot
from phasmid.toml import is_file
from phasmid.units import UNITS, split_unit

QUANTITIES = {
    "time": "time",
    "roll": "angle",
    "pitch": "angle",
    "roll_rate": "angular velocity",
    "pitch_rate": "angular velocity",
    "voltage": "voltage",
    "temperature": "temperature",
    "distance": "length",
}
"""Columns of a CSV log beside those of the joints, and their dimensions."""

POSITION_CHANNELS = ("joint_position_measured", "joint_position")
ORIENTATION_CHANNELS = ("imu_orientation", "body_orientation")
RATE_CHANNELS = ("imu_angular_velocity", "body_angular_velocity")
TEMPERATURE_CHANNELS = ("servo_temperature_measured", "servo_temperature")
"""Channels of a recording; the first that it holds is read."""

JOINT_CHANNELS = *TEMPERATURE_CHANNELS, "servo_voltage_measured", "joint_position_time"
"""Further channels of the joints that a CSV export holds."""

STANDS = 2.0
"""Value of the channel ``sequence`` while a robot stands or walks."""

SHORTEST = 1.5
"""Shortest log [s]."""

LONGEST = 3600.0
"""Longest log [s]: its replays in simulation would take most of a day."""


@dataclass(frozen=True, eq=False)
class RobotLog:
    """Log of a robot with L legs; quantities that it does not contain are absent.

    Attributes:
        name: Name of the log, for titles and messages.
        time: Times from the log's beginning [s], increasing, shape (N,).
        target: Joint targets [rad], shape (N, L, 3).
        position: Measured joint angles [rad], shape (N, L, 3); NaN where a joint was not read.
        measured: Further measurements by name, as in `QUANTITIES`, in SI, shape (N,) each.
        is_read: Whether the positions are readings of sensors, not a simulation's true angles.
        read_time: Times at which the positions were read [s], shape (N, L, 3); None: those of the
            rows.
        targets_hold: Whether each target holds until the next row, as on a servo bus; otherwise
            the joints pass it at its time.

    Raises:
        InvalidInput: Shapes are wrong, times do not increase, a target is not finite, angles are
            in degrees, or the log is too short or too long.
    """

    name: str
    time: Float[np.ndarray, " time"]
    target: Float[np.ndarray, "time legs 3"]
    position: Float[np.ndarray, "time legs 3"]
    measured: Mapping[str, Float[np.ndarray, " time"]]
    is_read: bool = True
    read_time: Float[np.ndarray, "time legs 3"] | None = None
    targets_hold: bool = False

    def __post_init__(self) -> None:
        time = self.time
        if self.target.shape != self.position.shape or len(time) != len(self.target):
            raise InvalidInput(
                f"log has times of shape {time.shape}, targets of shape {self.target.shape} and "
                f"positions of shape {self.position.shape}; they must be (N,) and twice (N, L, 3)."
            )
        check_times(time)
        length = float(time[-1] - time[0]) if len(time) else 0.0
        if length < SHORTEST:
            raise InvalidInput(
                f"log lasts {length:.3g} s; a comparison needs {SHORTEST:g} s or more."
            )
        if length > LONGEST:
            raise InvalidInput(
                f"log lasts {length:.3g} s; a comparison takes {LONGEST:g} s or less.",
                hint="the unit of the times",
            )
        if not np.isfinite(self.target).all():
            row = int(np.argmin(np.isfinite(self.target).reshape(len(time), -1).all(axis=1)))
            raise InvalidInput(f"log row {row + 1}: a joint target is not a finite number.")
        for name, angles in (("targets", self.target), ("positions", self.position)):
            finite = np.isfinite(angles)
            if not finite.any(axis=0).all():
                raise InvalidInput(f"log has a joint without {name}.")
            largest = float(np.abs(angles[finite]).max())
            if largest > LARGEST_ANGLE:
                raise InvalidInput(
                    f"log has joint {name} up to {largest:.3g} rad.",
                    hint="columns in degrees that end in _deg",
                )


def log_of_recording(recording: Recording, name: str, robot: Robot) -> RobotLog:
    """Return the log of a recording of phasmid, simulated or of a robot.

    Raises:
        InvalidInput: It has no joint targets or no joint angles, or another number of legs.
    """
    channels = {str(each): np.asarray(recording[each].values) for each in recording.data_vars}
    return _from_channels(name, np.asarray(recording["time"].values), channels, robot)


def read_csv_log(path: Path, robot: Robot) -> RobotLog:
    """Read a CSV log; see docs/recordings.md for its columns.

    Raises:
        InvalidInput: The file is absent, too large, not well formed, or lacks a column.
    """
    check_log_file(path)
    with located(path.name):
        frame = read_csv_table(path, "log")
        exported = "time [s]" in frame
        return (_exported if exported else _own)(path.stem, frame, robot)


def check_log_file(path: Path) -> None:
    """Refuse a log that is no file, or too large.

    Raises:
        InvalidInput: It is.
    """
    if not is_file(path):
        raise InvalidInput(f"log {path} does not exist or is not a file.")
    check_size(path, "log")


def first_channel(channels: Mapping[Any, Any], names: tuple[str, ...]) -> Any | None:
    """Return the first channel that a recording holds; None where it holds none of them."""
    return next((channels[each] for each in names if each in channels), None)


def _numbers(frame: Any, column: str) -> Float[np.ndarray, " time"]:
    """Return a column; empty cells are NaN.

    Raises:
        InvalidInput: A cell is no number.
    """
    import pandas

    cells = frame[column]
    values = pandas.to_numeric(cells, errors="coerce").to_numpy(dtype=float)
    wrong = np.isnan(values) & cells.notna().to_numpy()
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InvalidInput(f'log row {row + 1}, column {column}: "{cells[row]}" is not a number.')
    return values


def _own(name: str, frame: Any, robot: Robot) -> RobotLog:
    """Return the log of a table with columns such as ``right_front.coxa.target_deg``."""
    joints = joint_names(robot)
    kinds = {f"{joint}.{kind}": "angle" for kind in ("target", "measured") for joint in joints}
    known = {**QUANTITIES, **kinds}
    found: dict[str, np.ndarray] = {}
    for column in frame:
        key, ending = split_unit(column)
        if key not in known:
            guess = nearest(key, known)
            raise InvalidInput(
                f'log has a column "{column}" that is not known.',
                hint=f'"{guess}"' if guess else f"time, {joints[0]}.target, {joints[0]}.measured",
            )
        unit = UNITS[ending] if ending else None
        if unit is not None and unit.dimension != known[key]:
            raise InvalidInput(f'log has a column "{column}"; its unit is no {known[key]}.')
        if key in found:
            raise InvalidInput(f'log has the column "{key}" twice.')
        values = _numbers(frame, column)
        found[key] = values if unit is None else values / unit.per_si
    missing = [key for key in ("time", *kinds) if key not in found]
    if missing:
        raise InvalidInput(
            f"log lacks {len(missing)} columns: {', '.join(missing[:3])}"
            f"{', …' if missing[3:] else ''}."
        )
    shape = (len(frame), len(robot.legs), 3)
    target, position = (
        np.stack([found[f"{joint}.{kind}"] for joint in joints], axis=-1).reshape(shape)
        for kind in ("target", "measured")
    )
    measured = {
        key: found[key]
        for key in QUANTITIES
        if key != "time" and np.isfinite(found.get(key, np.nan)).any()
    }
    time = found["time"]
    return RobotLog(name, time - time[:1], target, position, measured)


def _exported(name: str, frame: Any, robot: Robot) -> RobotLog:
    """Return the log of a table that ``phasmid export`` wrote."""
    parts: dict[str, dict[str, str]] = {}
    for column in frame:
        match = re.fullmatch(r"'?(\w+)\.(\S+) \[.*\]", column)
        if match:
            parts.setdefault(match[1], {})[match[2]] = column
    orders = {
        **dict.fromkeys(("joint_position_target", *POSITION_CHANNELS), joint_names(robot)),
        **dict.fromkeys(ORIENTATION_CHANNELS, ("w", "x", "y", "z")),
        **dict.fromkeys((*RATE_CHANNELS, "body_position"), ("x", "y", "z")),
        **dict.fromkeys(JOINT_CHANNELS, joint_names(robot)),
    }
    channels: dict[str, np.ndarray] = {}
    for channel, order in orders.items():
        columns = parts.get(channel, {})
        if all(key in columns for key in order):
            values = np.stack([_numbers(frame, columns[key]) for key in order], axis=-1)
            is_joint = order == joint_names(robot)
            channels[channel] = values.reshape(len(frame), -1, 3) if is_joint else values
    return _from_channels(name, _numbers(frame, "time [s]"), channels, robot)


def _from_channels(
    name: str, time: np.ndarray, channels: Mapping[str, np.ndarray], robot: Robot
) -> RobotLog:
    """Return the log of a recording's channels."""
    target = channels.get("joint_position_target")
    position = first_channel(channels, POSITION_CHANNELS)
    if target is None or position is None:
        lacking = "joint targets" if target is None else "measured joint angles"
        raise InvalidInput(
            f"the log of {name} has no {lacking} of {robot.name}.",
            hint="joint_position_target, and joint_position_measured or joint_position",
        )
    if target.shape[1] != len(robot.legs):
        raise InvalidInput(
            f"the log of {name} has {target.shape[1]} legs; {robot.name} has {len(robot.legs)}.",
            hint="--robot with the robot of the log",
        )
    is_read, read_time = POSITION_CHANNELS[0] in channels, channels.get("joint_position_time")
    rows = _walking_rows(time, channels.get("sequence"))
    channels = {key: values[rows] for key, values in channels.items()}
    time, target, position = time[rows], target[rows], position[rows]
    if read_time is not None:
        # A servo bus reads some joints in each row; the others keep their last angle.
        read_time = read_time[rows]
        is_new = np.diff(read_time, axis=0, prepend=read_time[:1] - 1.0) > 0
        position = np.where(is_new, position, np.nan)
        read_time = read_time - time[0]
    return RobotLog(
        name,
        time - time[:1],
        target,
        position,
        body_measurements(channels),
        is_read,
        read_time,
        targets_hold=read_time is not None,
    )


def _walking_rows(time: np.ndarray, sequence: np.ndarray | None) -> slice:
    """Return the rows in which a robot stands or walks; all where no posture was recorded."""
    if sequence is None or not len(time):
        return slice(None)
    edges = np.flatnonzero(np.diff(sequence == STANDS, prepend=False, append=False)).reshape(-1, 2)
    if not len(edges):
        return slice(None)
    begin, end = max(edges.tolist(), key=lambda edge: edge[1] - edge[0])
    return slice(begin, end)


def body_measurements(channels: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return what `QUANTITIES` names of a recording's channels; what they lack is absent.

    The distance is that of the body from its first place, over ground.
    """
    found: dict[str, np.ndarray] = {}
    orientation = first_channel(channels, ORIENTATION_CHANNELS)
    rate = first_channel(channels, RATE_CHANNELS)
    if orientation is not None:
        w, x, y, z = orientation.T
        found["roll"] = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        found["pitch"] = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    elif rate is not None:
        found["roll_rate"], found["pitch_rate"] = rate[:, 0], rate[:, 1]
    temperature = first_channel(channels, TEMPERATURE_CHANNELS)
    if temperature is not None:
        found["temperature"] = temperature.max(axis=(1, 2))
    if "servo_voltage_measured" in channels:
        found["voltage"] = channels["servo_voltage_measured"].mean(axis=(1, 2))
    if "body_position" in channels:
        place = channels["body_position"][:, :2]
        found["distance"] = np.linalg.norm(place - place[0], axis=1)
    return found
