"""``phasmid bus calibrate``: the dialogue of a calibration."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from phasmid.cli.output import print_table, say
from phasmid.errors import InvalidInput, plain
from phasmid.hardware import Bus, ServoCalibration
from phasmid.robot import JOINTS, Robot

if TYPE_CHECKING:
    from phasmid.hardware.calibrator import Calibrator, Sweep

POSES = {
    "zero": "Hold every leg straight out from the body: femur axis, tibia axis and foot tip on one "
    "horizontal line.",
    "square": "Hold every leg straight out from the body: femur axis and tibia axis at one height, "
    "the foot tip right below the tibia axis.",
    "neutral": "Hold every foot tip at its neutral position, which counts from the coxa axis at "
    "the height of the femur axis:",
}
"""Appearance of the poses of a calibration."""

WAYS = (("forward", "backward"), ("to the left", "to the right"), ("up", "down"))
"""Directions along the axes of the body and against them."""

POLL = 0.05
"""Time between two looks for Enter where nothing else is done [s]."""


def calibrate(
    bus: Bus, robot: Robot, ids: Sequence[int] | None, pose: str | None
) -> list[ServoCalibration]:
    """Guide the user through a calibration, and print the result.

    Args:
        bus: The bus.
        robot: The robot, L legs.
        ids: Ids leg by leg; None: 1 to 3 L.
        pose: Name of the pose; None: the first one within the robot's joint limits.
    """
    from phasmid.hardware.calibrator import Calibrator, Sweep, check_pose, first_pose, pose_angles

    pose = pose or first_pose(robot)
    check_pose(robot, pose)
    calibrator = Calibrator(bus, robot, ids)
    calibrator.release()
    say(
        f"{len(calibrator.joints)} servos {calibrator.model.name} answer; their torque is off. "
        "Ctrl-C ends without a file."
    )
    say(f"\n1. The {pose} pose. {POSES[pose]}")
    if pose == "neutral":
        _print_feet(robot)
    say("Then press Enter.")
    _await_enter()
    calibrator.measure_pose(pose_angles(robot, pose))

    for number, joint in enumerate(JOINTS):
        pending = list(range(number, len(calibrator.joints), len(JOINTS)))
        say(f"\n2. Direction of each {joint}. Let the legs rest, away from their stops.")
        while pending:
            say("Then press Enter.")
            _await_enter()
            sweep = Sweep(calibrator.positions())
            say(f"{turn_words(robot, joint)}, by 10° or more, leg by leg. Then press Enter.")
            _follow(calibrator, sweep, calibrator.turns)
            pending = calibrator.set_directions(sweep, pending)
            if pending:
                say(f"Turned too little, or both ways: {_named(calibrator, pending)}.")
                say("Let these legs rest, away from their stops.")

    say("\n3. Ranges. Turn every joint to both ends of its range. Then press Enter.")
    sweep = Sweep(calibrator.positions())
    _follow(calibrator, sweep, calibrator.angles)
    while pending := calibrator.still(sweep):
        say(f"Not turned: {_named(calibrator, pending)}. Turn them. Then press Enter.")
        _follow(calibrator, sweep, calibrator.angles)
    rows = calibrator.calibration(sweep)
    _print(calibrator, rows)
    return rows


def _named(calibrator: Calibrator, joints: Sequence[int]) -> str:
    return plain(", ".join(calibrator.joints[k] for k in joints))


def _print_feet(robot: Robot) -> None:
    """Print the neutral foot of each leg, in its hip frame."""
    rows = [["leg", "outwards", "to its left", "below"]]
    for leg in robot.legs:
        x, y, z = leg.neutral_foot
        rows.append([plain(leg.name), *(f"{1000 * value:.0f} mm" for value in (x, y, -z))])
    print_table(rows, right=(1, 2, 3))


def turn_words(robot: Robot, joint: str) -> str:
    """Return how to turn a joint of all legs towards larger angles."""
    if joint == "tibia":
        return "Swing each foot tip outwards and up about its tibia axis"
    # The foot moves along y of the hip where the coxa turns, and along z where the femur does.
    legs: dict[str, list[str]] = {}
    for leg in robot.legs:
        way = leg.X_body_hip[:3, 1 if joint == "coxa" else 2]
        # Forward and backward are clear for the legs at the corners, too.
        axis = int(np.argmax(np.abs(way) * [2, 1, 1]))
        legs.setdefault(WAYS[axis][int(way[axis] < 0)], []).append(leg.name)
    part = "leg" if joint == "coxa" else "knee"
    if len(legs) == 1:
        return f"Swing each {part} {next(iter(legs))}"
    words = (f"{way} ({', '.join(names)})" for way, names in legs.items())
    return plain(f"Swing each {part} {', or '.join(words)}")


def _follow(
    calibrator: Calibrator, sweep: Sweep, measure: Callable[[Sweep], Float[np.ndarray, "joints 2"]]
) -> None:
    """Extend a sweep until Enter, and show it in a terminal.

    Args:
        calibrator: Reads the positions.
        sweep: The motion.
        measure: Returns what is shown of it, the lowest and highest angle [rad].
    """
    is_over, height = _enter(), 0
    while not is_over():
        sweep.extend(calibrator.positions())
        # After Enter the cursor is no longer below the table.
        if not sys.stdout.isatty() or is_over():
            continue
        degrees = np.degrees(measure(sweep)).round().astype(int)
        cells = [f"{low}° to {high}°".ljust(14) for low, high in degrees]
        rows = [["leg", *JOINTS]]
        rows += [
            [plain(name), *cells[3 * k : 3 * k + 3]]
            for k, name in enumerate(calibrator.robot.leg_names)
        ]
        if height:
            # Up to the head of the table, and clear what is below.
            print(f"\x1b[{height}A\x1b[J", end="")
        print_table(rows)
        height = len(rows)
    sweep.extend(calibrator.positions())


def _await_enter() -> None:
    """Wait for a line of the input."""
    is_over = _enter()
    while not is_over():
        time.sleep(POLL)


def _enter() -> Callable[[], bool]:
    """Begin to wait for a line of the input.

    Returns:
        Whether it has come; raises InvalidInput where the input has ended instead.
    """
    file, found = sys.stdin.fileno() if sys.stdin else -1, b""

    def read() -> None:
        # No stream of Python: its lock would be held when an error ends the process.
        nonlocal found
        with suppress(OSError):
            while (found := os.read(file, 1)) not in (b"", b"\n"):
                pass

    def is_over() -> bool:
        if reader.is_alive():
            return False
        if not found:
            raise InvalidInput("the input ended before the calibration; nothing was written.")
        return True

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    return is_over


def _print(calibrator: Calibrator, rows: Sequence[ServoCalibration]) -> None:
    """Print a calibration, and where it is narrower than the robot's limits."""
    limits = calibrator.robot.arrays.joint_limits.reshape(-1, 2)
    narrow = calibrator.narrow(rows)
    table = [["joint", "id", "offset", "direction", "range", "note"]]
    for k, row in enumerate(rows):
        angles = np.degrees([*row.joint_range, *limits[k]]).round().astype(int)
        table.append(
            [
                plain(row.joint),
                str(row.id),
                f"{np.degrees(row.zero):.1f}°",
                "reversed" if row.drive_mode else "normal",
                f"{angles[0]}° to {angles[1]}°",
                f"limits {angles[2]}° to {angles[3]}°" if k in narrow else "",
            ]
        )
    say()
    print_table(table, right=(1, 2))
    if narrow:
        say("Noted: the measured range is smaller than the limits in the robot file.")
