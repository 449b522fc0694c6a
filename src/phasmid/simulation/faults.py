"""Faults during a run: servos that fail, sensors that fail, get stuck or are off."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, nearest
from phasmid.robot import JOINTS, Robot
from phasmid.simulation.sensors.models import rotated


class Part(NamedTuple):
    """A part of a robot that can fail.

    Attributes:
        channels: Measured channels that it affects.
        place: Number of names of its place: leg and joint, the leg alone, or none.
        units: Units of an amount, in SI; none where it cannot be off.
        amounts: Numbers of an amount; three are along the body axes.
    """

    channels: tuple[str, ...]
    place: int
    units: dict[str, float]
    amounts: int = 1


DEGREES = {"deg": math.radians(1), "rad": 1.0}
PARTS = {
    "servo": Part((), 2, {}),
    "encoder": Part(("joint_position_measured",), 2, DEGREES),
    "foot": Part(("foot_normal_force_measured", "contact_measured"), 1, {"N": 1.0}),
    "gyro": Part(("imu_angular_velocity",), 0, {"deg/s": math.radians(1), "rad/s": 1.0}, 3),
    "accelerometer": Part(("imu_acceleration",), 0, {"m/s2": 1.0, "m/s²": 1.0}, 3),
    "orientation": Part(("imu_orientation",), 0, DEGREES, 3),
    "imu": Part(("imu_angular_velocity", "imu_acceleration", "imu_orientation"), 0, {}),
}
"""Parts by name; ``imu`` is gyro, accelerometer and orientation together."""

NUMBER = r"[-+]?[\d.]+(?:[eE][-+]?\d+)?"
SENTENCE = re.compile(
    r"(?P<place>[\w.-]+)(?: (?P<part>encoder|foot|servo))? (?P<kind>dead|stuck|off)"
    rf"(?: by (?P<amount>{NUMBER}(?:,{NUMBER})*) ?(?P<unit>[a-zA-Z²/2]+))?"
    rf" at (?P<time>\+?[\d.]+(?:[eE][-+]?\d+)?) ?s"
)


@dataclass(frozen=True, eq=False)
class Fault:
    """A fault that begins at a time and stays.

    Attributes:
        part: One of `PARTS`.
        kind: ``dead``: a sensor reads no number, a foot no contact, the joint of a servo is limp;
            ``stuck``: the reading stays; ``off``: an amount is added to the true value.
        time: When it begins [s].
        index: Leg and joint, of a foot the leg alone, of the imu nothing.
        amount: By how much it is off, in SI units; an orientation is rotated about that vector.
    """

    part: str
    kind: str
    time: float
    index: tuple[int, ...]
    amount: Float[np.ndarray, " amounts"]


def parse_fault(text: str, robot: Robot) -> Fault:
    """Parse a sentence.

    Args:
        text: Such as ``right_middle.tibia dead at 5 s`` (the servo),
            ``right_middle.tibia encoder stuck at 5 s``, ``left_front foot off by 2 N at 1 s``,
            ``gyro off by 0,0,5 deg/s at 2 s``, ``imu dead at 3 s``.
        robot: The robot that has the part.

    Raises:
        InvalidInput: It is no fault of this robot.
    """
    found = SENTENCE.fullmatch(" ".join(text.split()))
    place, name, kind, amount, unit, time = found.groups() if found else [""] * 6
    leg, _, joint = place.partition(".")
    name = name or ("servo" if joint else place)
    part = PARTS.get(name)
    if part is None or (name == "servo" and kind != "dead") or (kind == "off") != bool(amount):
        raise InvalidInput(
            f'a fault is "{text[:80]}"; it must be what fails, how (a servo dead; a sensor dead, '
            "stuck or off by an amount) and when.",
            hint='"right_middle.tibia dead at 5 s" or "gyro off by 0,0,5 deg/s at 2 s"',
        )
    index = []
    for word, known in [(leg, robot.leg_names), (joint, JOINTS)][: part.place]:
        if word not in known:
            guess = nearest(word, known)
            raise InvalidInput(
                f'fault "{text}": {robot.name} has no "{word}".',
                hint=f'"{guess}"' if guess else f"one of {', '.join(known)}",
            )
        index.append(known.index(word))
    try:
        values = [float(value) for value in (amount or "").split(",") if value]
        begin = float(time)
    except ValueError:
        raise InvalidInput(f'fault "{text}": an amount or time is no number.') from None
    if kind == "off" and (unit not in part.units or len(values) != part.amounts):
        size = f"{part.amounts} in {' or '.join(part.units)}" if part.units else "no amount"
        raise InvalidInput(
            f'fault "{text}": {name} is off by {len(values)} in {unit}; it must be {size}.'
        )
    return Fault(name, kind, begin, tuple(index), part.units.get(unit, 1.0) * np.array(values))


class Faults:
    """Faults of one robot, and their effect on its sensor readings.

    Args:
        robot: The robot.
        texts: Sentences, as of `parse_fault`.
        threshold: Normal force from which a foot counts as touching [N].

    Attributes:
        texts: All sentences.
        faults: All faults.

    Raises:
        InvalidInput: One of them is none, or of a part that the robot lacks.
    """

    def __init__(self, robot: Robot, texts: Sequence[str], threshold: float) -> None:
        self.texts = (texts,) if isinstance(texts, str) else tuple(texts)
        self.faults = [parse_fault(text, robot) for text in self.texts]
        self._threshold = threshold
        self.of_sensors = any(fault.part != "servo" for fault in self.faults)

    def servos(self) -> list[tuple[float, int, int]]:
        """Return the times [s] at which servos fail, with indices of leg and joint."""
        return [
            (fault.time, fault.index[0], fault.index[1])
            for fault in self.faults
            if fault.part == "servo"
        ]

    def apply(
        self,
        measured: Mapping[str, np.ndarray],
        time: Float[np.ndarray, " time"],
        frozen: Mapping[int, Mapping[str, np.ndarray]],
    ) -> dict[str, np.ndarray]:
        """Return measured channels with the faults of the sensors, a copy.

        Args:
            measured: Channels by name, shapes (N, ...).
            time: Of these samples [s], shape (N,).
            frozen: Readings of sensors that are stuck, by the fault's index.
        """
        faulty = {name: values.copy() for name, values in measured.items()}
        for number, fault in enumerate(self.faults):
            rows = time >= fault.time - 1e-9
            if not rows.any():
                continue
            at: Any = (rows, *fault.index)
            for name in faulty.keys() & PARTS[fault.part].channels:
                values = faulty[name]
                if fault.kind == "dead":
                    values[at] = False if values.dtype == np.bool_ else np.nan
                elif fault.kind == "stuck":
                    values[at] = frozen[number][name][fault.index]
                elif name == "imu_orientation":
                    values[rows] = rotated(values[rows], fault.amount)
                elif name != "contact_measured":
                    values[at] += fault.amount
            if fault.part == "foot" and fault.kind == "off" and "contact_measured" in faulty:
                force = faulty["foot_normal_force_measured"][at]
                faulty["contact_measured"][at] = force >= self._threshold
        return faulty

    def apply_to_recording(
        self, time: Float[np.ndarray, " time"], measured: Mapping[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        """Return the measured channels of a recording with the faults of the sensors."""
        frozen: dict[int, Mapping[str, Any]] = {}
        for number, fault in enumerate(self.faults):
            if fault.kind == "stuck" and time[-1] >= fault.time - 1e-9:
                row = max(int(np.searchsorted(time, fault.time + 1e-9, side="right")) - 1, 0)
                frozen[number] = {name: values[row] for name, values in measured.items()}
        return self.apply(measured, time, frozen)
