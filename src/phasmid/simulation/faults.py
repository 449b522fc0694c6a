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
from phasmid.sensors.models import rotated

KINDS = ("dead", "stuck", "off")
"""``dead``: a sensor reads no number, a foot no contact; the joint of a servo is limp. ``stuck``:
the reading stays. ``off``: an amount is added to the true value."""


class Part(NamedTuple):
    """A part of a robot that can fail.

    Attributes:
        channels: Measured channels that it affects.
        place: Number of names of its place: leg and joint, the leg alone, or none.
        units: Units of an amount; the last one is SI.
        amounts: Numbers of an amount.
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

FORM = "right_middle.tibia dead at 5 s"
WORDS = re.compile(
    r"(?P<place>[\w.-]+)(?: (?P<part>encoder|foot|servo))? (?P<kind>[a-z]+)"
    r"(?: by (?P<amount>[-+.,\deE]+) ?(?P<unit>[a-zA-Z²/2]+))? at (?P<time>[-+.\deE]+) ?s"
)


@dataclass(frozen=True)
class Fault:
    """A fault that begins at a time and stays.

    Attributes:
        part: One of `PARTS`.
        kind: One of `KINDS`; a servo can only be dead, and the whole imu not off.
        time: When it begins [s].
        leg: Name of the leg, of servo, encoder and foot.
        joint: Name of its joint, of servo and encoder.
        amount: By how much it is off [rad, N, rad/s, m/s², rad]: three numbers in body axes of
            gyro, accelerometer and orientation, which is rotated about that vector.

    Raises:
        InvalidInput: There is no such part or kind, or a number is not finite or missing.
    """

    part: str
    kind: str
    time: float
    leg: str = ""
    joint: str = ""
    amount: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for name, value, known in (("part", self.part, PARTS), ("kind", self.kind, KINDS)):
            if value not in known:
                guess = nearest(str(value), known)
                raise InvalidInput(
                    f'a fault has no {name} "{value}"; it must be one of {", ".join(known)}.',
                    hint=f'"{guess}"' if guess else f'"{FORM}"',
                )
        if not (math.isfinite(self.time) and self.time >= 0):
            raise InvalidInput(f"a fault's time is {self.time:g} s; it must be finite, 0 or more.")
        if self.part == "servo" and self.kind != "dead":
            raise InvalidInput(
                f"a servo cannot be {self.kind}; it can only be dead.", hint=f'"{FORM}"'
            )
        if self.part == "imu" and self.kind == "off":
            raise InvalidInput(
                "imu cannot be off as a whole; one of its parts can.",
                hint='"gyro off by 0,0,5 deg/s at 2 s"',
            )
        needed = PARTS[self.part].amounts if self.kind == "off" else 0
        if len(self.amount) != needed:
            raise InvalidInput(
                f"a fault of kind {self.kind} of {self.part} has {len(self.amount)} amounts; it "
                f"must have {needed}."
            )
        for amount in self.amount:
            if not math.isfinite(amount):
                raise InvalidInput(f"a fault's amount is {amount:g}; it must be a finite number.")

    @classmethod
    def of(cls, text: str) -> Fault:
        """Parse a sentence.

        Args:
            text: Such as ``right_middle.tibia dead at 5 s`` (the servo),
                ``right_middle.tibia encoder stuck at 5 s``, ``left_front foot off by 2 N at 1 s``,
                ``gyro off by 0,0,5 deg/s at 2 s``, ``imu dead at 3 s``.

        Raises:
            InvalidInput: It is no fault.
        """
        found = WORDS.fullmatch(" ".join(text.split()))
        if found is None:
            raise InvalidInput(
                f'a fault is "{text[:80]}"; it must be what fails, how and when.',
                hint=f'"{FORM}"',
            )
        place, part, kind = found["place"], found["part"], found["kind"]
        leg, _, joint = place.partition(".")
        if part is None:
            part = "servo" if joint else place
        known = PARTS.get(part)
        if known and not known.place:
            leg = ""
        amount: tuple[float, ...] = ()
        if found["amount"] is not None:
            units = known.units if known else {}
            if found["unit"] not in units:
                raise InvalidInput(
                    f'"{text}": {part} is off by an amount in {" or ".join(units) or "nothing"}.'
                )
            scale = units[found["unit"]]
            amount = tuple(_number(word, text) * scale for word in found["amount"].split(","))
        return cls(part, kind, _number(found["time"], text), leg, joint, amount)

    def __str__(self) -> str:
        part = PARTS[self.part]
        place = ".".join([self.leg, self.joint][: part.place])
        words = [place, "" if self.part == "servo" else self.part, self.kind]
        if self.amount:
            unit = list(part.units)[-1]
            words.append(f"by {','.join(repr(float(value)) for value in self.amount)} {unit}")
        return f"{' '.join(filter(None, words))} at {float(self.time)!r} s"

    def index_in(self, robot: Robot) -> tuple[int, ...]:
        """Return the indices of leg and joint; of a foot the leg alone; of the imu nothing.

        Raises:
            InvalidInput: The robot has none of that name.
        """
        names: tuple[tuple[str, Sequence[str], str], ...] = (
            (self.leg, robot.leg_names, f'{robot.name} has no leg "{self.leg}"'),
            (self.joint, JOINTS, f'a leg has no joint "{self.joint}"'),
        )
        names = names[: PARTS[self.part].place]
        for name, known, what in names:
            if name not in known:
                guess = nearest(name, known)
                raise InvalidInput(
                    f'fault "{self}": {what}.',
                    hint=f'"{guess}"' if guess else f"one of {', '.join(known)}",
                )
        return tuple(known.index(name) for name, known, _ in names)


def _number(word: str, text: str) -> float:
    try:
        return float(word)
    except ValueError:
        raise InvalidInput(f'"{text}": "{word}" is no number.', hint=f'"{FORM}"') from None


class Faults:
    """Faults of one robot, and their effect on its sensor readings.

    Args:
        robot: The robot.
        faults: Each a `Fault`, or the sentence of one.
        threshold: Normal force from which a foot counts as touching [N].

    Attributes:
        faults: All of them.

    Raises:
        InvalidInput: One of them is none, or of a part that the robot lacks.
    """

    def __init__(self, robot: Robot, faults: Sequence[Fault | str], threshold: float) -> None:
        if isinstance(faults, str | Fault):
            faults = [faults]
        self.faults = tuple(f if isinstance(f, Fault) else Fault.of(f) for f in faults)
        self._indices = [fault.index_in(robot) for fault in self.faults]
        self._threshold = threshold
        self.of_sensors = any(fault.part != "servo" for fault in self.faults)

    def servos(self) -> list[tuple[float, int, int]]:
        """Return the times [s] at which servos fail, with indices of leg and joint."""
        return [
            (fault.time, *index)  # type: ignore[misc]
            for fault, index in zip(self.faults, self._indices, strict=True)
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
        for number, (fault, index) in enumerate(zip(self.faults, self._indices, strict=True)):
            rows = time >= fault.time - 1e-9
            if fault.part == "servo" or not rows.any():
                continue
            for name in faulty.keys() & PARTS[fault.part].channels:
                values = faulty[name]
                at: Any = (rows, *index)
                if fault.kind == "dead":
                    values[at] = False if values.dtype == np.bool_ else np.nan
                elif fault.kind == "stuck":
                    values[at] = frozen[number][name][index]
                elif name == "imu_orientation":
                    values[rows] = rotated(values[rows], np.array(fault.amount))
                elif name != "contact_measured":
                    values[at] += fault.amount
            if fault.part == "foot" and fault.kind == "off" and "contact_measured" in faulty:
                force = faulty["foot_normal_force_measured"][rows, index[0]]
                faulty["contact_measured"][rows, index[0]] = force >= self._threshold
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
