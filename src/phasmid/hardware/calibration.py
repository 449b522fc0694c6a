"""Calibration of a robot's servos: ids, drive modes, homing offsets and ranges.

Names are those of LeRobot's motor bus.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from phasmid.hardware.control_table import Model, model
from phasmid.robot import JOINTS, Robot


@dataclass(frozen=True)
class ServoCalibration:
    """Relation of a joint's angle to its servo's register values.

    register = middle + homing_offset ± angle / scale, with the servo's middle and scale; − where
    drive_mode is 1.

    Attributes:
        joint: Leg and joint, such as ``right_front.coxa``.
        id: Id on the bus.
        model: Name of the servo's model.
        drive_mode: 0, or 1 where the servo turns against the joint.
        homing_offset: Register value, from the servo's middle, at joint angle 0.
        range_min: Lowest register value.
        range_max: Highest register value.
    """

    joint: str
    id: int
    model: str
    drive_mode: int
    homing_offset: int
    range_min: int
    range_max: int

    @property
    def direction(self) -> int:
        """Sign of the servo's direction against the joint's."""
        return -1 if self.drive_mode else 1

    @property
    def zero(self) -> float:
        """Angle of the servo from its middle at joint angle 0 [rad]."""
        return self.homing_offset * model(self.model).register("goal_position").scale

    def servo_angle(self, joint_angle: float) -> float:
        """Return the servo's angle from its middle [rad]."""
        return self.zero + self.direction * joint_angle

    def joint_angle(self, servo_angle: float) -> float:
        """Return the joint's angle [rad]."""
        return self.direction * (servo_angle - self.zero)


def default_calibration(
    robot: Robot, servo_model: Model, ids: Sequence[int] | None = None
) -> list[ServoCalibration]:
    """Return a calibration with the servos' middle at the middle of the joints' limits.

    Args:
        robot: The robot, L legs.
        servo_model: Model of all servos.
        ids: Ids leg by leg; None: 1 to 3 L.
    """
    register = servo_model.register("goal_position")
    rows = []
    for k, leg in enumerate(robot.legs):
        for j, (low, high) in enumerate(leg.joint_limits):
            offset = -round((low + high) / 2 / register.scale)
            limits = [register.zero + offset + round(q / register.scale) for q in (low, high)]
            rows.append(
                ServoCalibration(
                    joint=f"{leg.name}.{JOINTS[j]}",
                    id=3 * k + j + 1 if ids is None else ids[3 * k + j],
                    model=servo_model.name,
                    drive_mode=0,
                    homing_offset=offset,
                    range_min=max(limits[0], register.low),
                    range_max=min(limits[1], register.high),
                )
            )
    return rows
