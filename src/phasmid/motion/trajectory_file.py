"""Trajectory files: CSV, NumPy arrays and recordings."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from phasmid.arguments import checked
from phasmid.csv_table import MOST_ROWS, check_size, read_csv_table
from phasmid.errors import InvalidInput, located, nearest, own_words
from phasmid.motion.trajectory import JointTrajectory, joint_names
from phasmid.recording import load_recording
from phasmid.robot import Robot, load_robot
from phasmid.toml import is_file
from phasmid.units import UNITS, split_unit


@checked
def load_trajectory(
    path: str | Path, robot: Robot | str | Path, *, unit: Literal["rad", "deg"] = "rad"
) -> JointTrajectory:
    """Read joint angles over time.

    Args:
        path: A ``.csv`` file with a heading (``time``, and ``right_front.coxa`` and so on for each
            joint, in any order; a name may end in its unit, as ``right_front.coxa_deg``), a
            ``.csv`` file that ``phasmid export`` wrote, a ``.npy`` array with a row per time (time,
            then leg by leg coxa, femur, tibia), or a recording. Of exports and recordings the
            target angles are read, else the simulated or the measured ones.
        robot: The robot of the joints, or its name or file.
        unit: Unit of the angles in a ``.csv`` or ``.npy`` without units.

    Raises:
        InvalidInput: The file is absent, too large, not well formed, or lacks a joint; the numbers
            are no trajectory.
        InfeasibleWalk: A joint would pass its limits or be faster than its servo.
    """
    if isinstance(robot, str | Path):
        robot = load_robot(robot)
    path = Path(path)
    if unit not in ("rad", "deg"):
        raise InvalidInput(f'unit is "{unit}"; it must be "rad" or "deg".')
    if not is_file(path):
        raise InvalidInput(f"trajectory {path} does not exist or is not a file.")
    if path.suffix not in _READERS:
        raise InvalidInput(
            f"{path} is no trajectory that can be read.", hint="a .csv, .npy, .nc or .mcap file"
        )
    check_size(path, "trajectory")
    with located(path.name):
        time, q = _READERS[path.suffix](path, robot, 1 / UNITS[unit].per_si)
        return JointTrajectory(robot, time, q.reshape(len(time), len(robot.legs), 3))


Table: TypeAlias = tuple[np.ndarray, np.ndarray]
"""Times [s], shape (N,), and angles leg by leg, shape (N, 3 L)."""

JOINT_CHANNELS = ("joint_position_target", "joint_position", "joint_position_measured")
"""Channels of joint angles; the first that a recording holds is read."""


def _read_csv(path: Path, robot: Robot, scale: float) -> Table:
    # Lazy import: pandas takes 0.3 s.
    import pandas

    frame = read_csv_table(path, "trajectory")
    order, scales = _columns(_joint_columns(list(frame)), robot, scale)
    table = frame.iloc[:, order].apply(pandas.to_numeric, errors="coerce").to_numpy(dtype=float)
    return table[:, 0], table[:, 1:] * scales


def _joint_columns(heading: list[str]) -> list[str | None]:
    """Return the heading; of an exported recording only the time and the joint angles."""
    if "time [s]" not in heading:
        return list(heading)
    for channel in JOINT_CHANNELS:
        column = re.compile(rf"{channel}\.(.+) \[rad\]")
        matches = [column.fullmatch(name) for name in heading]
        if any(matches):
            break
    return [
        "time" if name == "time [s]" else f"{match[1]}_rad" if match else None
        for name, match in zip(heading, matches, strict=True)
    ]


def _columns(heading: list[str | None], robot: Robot, scale: float) -> tuple[list[int], np.ndarray]:
    """Return the columns of time and of each joint, and the factors of the joints to radians."""
    if "time" not in heading:
        raise InvalidInput(
            'trajectory has no column "time".', hint=f"time, {', '.join(joint_names(robot)[:2])}, …"
        )
    found: dict[str, tuple[int, float]] = {}
    for index, column in enumerate(heading):
        if column is None:
            continue
        name, ending = split_unit(column)
        if ending and UNITS[ending].dimension != "angle":
            name, ending = column, ""
        if name == "time" and not ending:
            continue
        if name not in joint_names(robot):
            guess = nearest(name, joint_names(robot))
            raise InvalidInput(
                f'trajectory has a column "{column}"; {robot.name} has no such joint.',
                hint=f'"{guess}"' if guess else f'"{joint_names(robot)[0]}"',
            )
        if name in found:
            raise InvalidInput(f'trajectory has the joint "{name}" twice.')
        found[name] = index, 1 / UNITS[ending].per_si if ending else scale
    missing = [name for name in joint_names(robot) if name not in found]
    if missing:
        raise InvalidInput(
            f"trajectory has {len(found)} joint columns; {len(joint_names(robot))} are needed. "
            f"Missing: {', '.join(missing[:3])}{', …' if missing[3:] else ''}."
        )
    places = [found[name] for name in joint_names(robot)]
    order = [heading.index("time"), *(index for index, _ in places)]
    return order, np.array([factor for _, factor in places])


def _read_npy(path: Path, robot: Robot, scale: float) -> Table:
    try:
        # Mapped: the size in the header is compared with the file's before memory is allocated.
        table = np.load(path, mmap_mode="r", allow_pickle=False)
    except Exception as error:
        # A damaged header can raise any exception.
        raise InvalidInput(
            f"{path.name} is not an array that can be read{own_words(error)}.",
            hint="an array of numbers that numpy.save wrote, copied whole",
        ) from None
    needed = 1 + len(joint_names(robot))
    if not isinstance(table, np.ndarray) or table.dtype.kind not in "fiu" or table.ndim != 2:
        raise InvalidInput(
            f"{path.name} is not a table of plain numbers.", hint=f"N rows of {needed} numbers"
        )
    if table.shape[1] != needed:
        raise InvalidInput(
            f"trajectory has {table.shape[1] - 1} joint columns; {needed - 1} are needed, after "
            "a first one for time."
        )
    if len(table) > MOST_ROWS:
        raise InvalidInput(f"trajectory has {len(table)} rows; {MOST_ROWS} at most are read.")
    numbers = np.asarray(table, dtype=float)
    return numbers[:, 0], numbers[:, 1:] * scale


def _read_recording(path: Path, robot: Robot, scale: float) -> Table:
    del scale
    recording = load_recording(path)
    for name in JOINT_CHANNELS:
        if name in recording.data_vars:
            q = np.asarray(recording[name].values)
            break
    else:
        raise InvalidInput("the recording has no joint angles.")
    if q.shape[1] != len(robot.legs):
        raise InvalidInput(
            f"the recording is of a robot with {q.shape[1]} legs; {robot.name} has "
            f"{len(robot.legs)}."
        )
    return np.asarray(recording["time"].values), q


_READERS = {
    ".csv": _read_csv,
    ".npy": _read_npy,
    ".nc": _read_recording,
    ".mcap": _read_recording,
}
