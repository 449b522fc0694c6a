"""Measurement of a calibration on a robot whose joints are turned by hand."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from jaxtyping import Float, Int

from phasmid.errors import InvalidInput
from phasmid.hardware.bus import Bus, BusError
from phasmid.hardware.calibration import POSITIONS, ServoCalibration
from phasmid.hardware.control_table import Model
from phasmid.kinematics import joint_angles
from phasmid.motion.trajectory import joint_names
from phasmid.robot import JOINTS, Robot

READINGS = 9
"""Readings of a pose, of which the median counts."""

LEAST_TURN = math.radians(10)
"""Least turn of a joint that shows its direction or a range [rad]."""

MOST_RETURN = 0.5
"""Largest turn the other way, as a share of the turn, with which a direction is clear."""

SLACK = math.radians(2)
"""Distance to a limit of the robot within which a joint counts as turned to the limit [rad]."""

POSES = ("zero", "square", "neutral")
"""Poses of a calibration: all angles 0; the same with the tibiae at a right angle, down; neutral
feet."""


def pose_angles(robot: Robot, pose: str) -> Float[np.ndarray, "legs 3"]:
    """Return the joint angles of one of `POSES` [rad].

    Raises:
        Unreachable: A leg does not reach its neutral foot.
    """
    if pose == "neutral":
        return np.array([joint_angles(leg, leg.neutral_foot) for leg in robot.legs])
    return np.tile([0.0, 0.0, -math.pi / 2 if pose == "square" else 0.0], (len(robot.legs), 1))


def check_pose(robot: Robot, pose: str) -> None:
    """Refuse a pose outside the robot's joint limits.

    Raises:
        InvalidInput: The angle of a joint is outside its limits.
    """
    outside = _outside(robot, pose)
    if outside:
        raise InvalidInput(outside, hint=f'pose = "{first_pose(robot)}"')


def _outside(robot: Robot, pose: str) -> str:
    """Return which joint of a pose is outside its limits; empty if none is."""
    for leg, angles in zip(robot.legs, pose_angles(robot, pose), strict=True):
        for joint, angle, (low, high) in zip(JOINTS, angles, leg.joint_limits, strict=True):
            if not low <= angle <= high:
                return (
                    f"in the {pose} pose {leg.name}.{joint} is at {math.degrees(angle):.4g}°, "
                    f"outside its limits, {math.degrees(low):.4g}° to {math.degrees(high):.4g}°."
                )
    return ""


def first_pose(robot: Robot) -> str:
    """Return the first of `POSES` within the robot's joint limits; the last one if none is."""
    return next((pose for pose in POSES[:-1] if not _outside(robot, pose)), POSES[-1])


class Sweep:
    """Register values of S joints while they are turned.

    Args:
        start: Values at the start, shape (S,).

    Attributes:
        start: Values at the start.
        low: Lowest values since then.
        high: Highest values since then.
    """

    def __init__(self, start: Int[np.ndarray, " joints"]) -> None:
        self.start, self.low, self.high = start, start, start

    def extend(self, values: Int[np.ndarray, " joints"]) -> None:
        """Add register values, shape (S,)."""
        self.low, self.high = np.minimum(self.low, values), np.maximum(self.high, values)


class Calibrator:
    """Homing offsets, directions and ranges of a robot's servos, from positions that are read.

    Only ``torque_enable`` is written.

    Args:
        bus: The bus.
        robot: The robot, L legs.
        ids: Ids leg by leg; None: 1 to 3 L.

    Attributes:
        joints: Names of the joints, such as ``right_front.coxa``, shape (3 L,).
        model: Model of all servos.

    Raises:
        BusError: A servo does not answer.
        InvalidInput: The servos are of several models, or of an unknown one.
    """

    def __init__(self, bus: Bus, robot: Robot, ids: Sequence[int] | None = None) -> None:
        self.bus, self.robot = bus, robot
        self.joints = list(joint_names(robot))
        self.ids = list(range(1, len(self.joints) + 1) if ids is None else ids)
        self.model = self._common_model()
        self._register = self.model.register("present_position")
        self._scale = self._register.scale
        self._pose = self._at_pose = np.zeros(len(self.joints))
        self._directions = np.ones(len(self.joints), dtype=int)
        self._limits = robot.arrays.joint_limits.reshape(-1, 2)

    def _common_model(self) -> Model:
        found = self.bus.scan(self.ids)
        named = dict(zip(self.ids, self.joints, strict=True))
        missing = [f"{joint} (id {id_})" for id_, joint in named.items() if id_ not in found]
        if missing:
            raise BusError(
                f"no servo answers for {', '.join(missing)} on {self.bus.path} at "
                f"{self.bus.baud} baud, protocol {self.bus.protocol}.0.",
                hint=f"phasmid bus scan {self.bus.path}",
            )
        joints: dict[str, list[str]] = {}
        for id_, joint in named.items():
            one = found[id_]
            name = f"unknown model {one}" if isinstance(one, int) else one.name
            joints.setdefault(name, []).append(joint)
        common = found[self.ids[0]]
        if isinstance(common, int) or len(joints) > 1:
            texts = [f"{name} ({', '.join(parts)})" for name, parts in joints.items()]
            raise InvalidInput(f"the servos must be of one known model; found: {'; '.join(texts)}.")
        return common

    def release(self) -> None:
        """Switch the torque of all servos off, and verify it.

        Raises:
            BusError: A servo does not answer, or its torque stays on.
        """
        register = self.model.register("torque_enable")
        for id_, joint in zip(self.ids, self.joints, strict=True):
            self.bus.write_raw(id_, register, 0)
            if self.bus.read_raw(id_, register):
                raise BusError(f"the torque of {joint} (id {id_}) stays on.")

    def positions(self) -> Int[np.ndarray, " joints"]:
        """Return the register values of all positions, shape (3 L,).

        Raises:
            BusError: A servo does not answer.
        """
        register, name = self._register, self._register.name
        readings = self.bus.read_all(self.ids, [name])
        return np.array(
            [
                register.from_si(reading.values[name])
                if reading and reading.values
                else self.bus.read_raw(id_, register)
                for id_, reading in readings.items()
            ]
        )

    def measure_pose(self, angles: Float[np.ndarray, "legs 3"]) -> None:
        """Read the positions in a pose.

        Args:
            angles: Joint angles of the pose [rad].
        """
        self._pose = angles.ravel()
        self._at_pose = np.median([self.positions() for _ in range(READINGS)], axis=0)

    def set_directions(self, sweep: Sweep, joints: Iterable[int]) -> list[int]:
        """Set the directions of joints that were turned towards larger angles.

        Args:
            sweep: Their motion.
            joints: Indices of the joints.

        Returns:
            The joints among them that were turned by less than `LEAST_TURN`, or both ways.
        """
        unclear = []
        for k in joints:
            up, down = sweep.high[k] - sweep.start[k], sweep.start[k] - sweep.low[k]
            turn, back = max(up, down), min(up, down)
            if turn * self._scale < LEAST_TURN or back > MOST_RETURN * turn:
                unclear.append(k)
            self._directions[k] = 1 if up > down else -1
        return unclear

    def still(self, sweep: Sweep) -> list[int]:
        """Return the joints that were turned by less than `LEAST_TURN`."""
        return list(np.flatnonzero((sweep.high - sweep.low) * self._scale < LEAST_TURN))

    def turns(self, sweep: Sweep) -> Float[np.ndarray, "joints 2"]:
        """Return the lowest and highest turn of the servos since the start [rad]."""
        return np.stack([sweep.low - sweep.start, sweep.high - sweep.start], axis=1) * self._scale

    def angles(self, sweep: Sweep) -> Float[np.ndarray, "joints 2"]:
        """Return the lowest and highest joint angle [rad]."""
        ends = np.stack([sweep.low, sweep.high], axis=1) - self._at_pose[:, None]
        turned = self._directions[:, None] * ends * self._scale
        return np.sort(self._pose[:, None] + turned, axis=1)

    def calibration(self, sweep: Sweep) -> list[ServoCalibration]:
        """Return the calibration, with the measured ranges within the robot's joint limits.

        Args:
            sweep: Motion of all joints through their ranges.

        Raises:
            InvalidInput: A measured range is outside the limits.
        """
        bounds = self.model.register(POSITIONS)
        zeros = (self._at_pose - self._directions * self._pose / self._scale).round().astype(int)
        limits = self._limits / self._scale
        rows = []
        for k, joint in enumerate(self.joints):
            ends = np.sort(zeros[k] + self._directions[k] * limits[k])
            row = ServoCalibration(
                joint=joint,
                id=self.ids[k],
                model=self.model.name,
                drive_mode=int(self._directions[k] < 0),
                homing_offset=int(zeros[k]) - self._register.zero,
                range_min=max(int(sweep.low[k]), math.ceil(ends[0]), bounds.low),
                range_max=min(int(sweep.high[k]), math.floor(ends[1]), bounds.high),
            )
            if row.range_min >= row.range_max:
                angles = np.degrees([*self.angles(sweep)[k], *self._limits[k]])
                texts = [f"{angle:.0f}°" for angle in angles]
                raise InvalidInput(
                    f"{joint} was turned from {texts[0]} to {texts[1]}; that is outside the "
                    f"robot's limits, {texts[2]} to {texts[3]}.",
                    hint="the calibration again, with this joint as in the pose",
                )
            rows.append(row)
        return rows

    def narrow(self, rows: Sequence[ServoCalibration]) -> list[int]:
        """Return the joints whose range is smaller than the robot's limits by over `SLACK`."""
        return [
            k
            for k, (row, (low, high)) in enumerate(zip(rows, self._limits, strict=True))
            if row.joint_range[0] > low + SLACK or row.joint_range[1] < high - SLACK
        ]
