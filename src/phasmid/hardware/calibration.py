"""Calibration of a robot's servos: ids, drive modes, homing offsets and ranges, and its file.

Names are those of LeRobot's motor bus.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Annotated

from annotated_types import Ge, Le

from phasmid.arguments import checked
from phasmid.errors import InvalidInput, located, nearest
from phasmid.hardware.control_table import Model, model
from phasmid.recording.file import check_new_file, write_whole
from phasmid.robot import JOINTS, Robot, preset_names
from phasmid.tables import Count, Name, Table, in_file, validate
from phasmid.toml import LARGEST_FILE, parse_toml, read_text, toml_key, toml_value

POSITIONS = "max_position_limit"
"""Register whose limits are those of a position, in all models."""

FARTHEST = 1 << 20
"""Largest homing offset, that of several turns; larger numbers are refused."""


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

    def joint_angle(self, servo_angle: float) -> float:
        """Return the joint's angle [rad]."""
        return self.direction * (servo_angle - self.zero)

    @property
    def joint_range(self) -> tuple[float, float]:
        """Lowest and highest angle of the joint within the range [rad]."""
        to_si = model(self.model).register("goal_position").to_si
        low, high = sorted(self.joint_angle(to_si(n)) for n in (self.range_min, self.range_max))
        return low, high


@checked
def default_calibration(
    robot: Robot, servo_model: Model | str | None = None, ids: Sequence[int] | None = None
) -> list[ServoCalibration]:
    """Return a calibration with the servos' middle at the middle of the joints' limits.

    Args:
        robot: The robot, L legs.
        servo_model: Model of all servos, or its name; None: that of the robot's servo.
        ids: 3 L ids, leg by leg; None: 1 to 3 L.

    Raises:
        InvalidInput: The servo has no control table, or there are more or fewer ids.
    """
    if not isinstance(servo_model, Model):
        servo_model = model(servo_model or robot.servo.name)
    count = len(JOINTS) * len(robot.legs)
    if ids is not None and len(ids) != count:
        raise InvalidInput(f"{len(ids)} ids are given; the robot has {count} servos.")
    register, bounds = servo_model.register("goal_position"), servo_model.register(POSITIONS)
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
                    range_min=max(limits[0], bounds.low),
                    range_max=min(limits[1], bounds.high),
                )
            )
    return rows


# File ---------------------------------------------------------------------------------------------


class JointTable(Table):
    """``[joint.LEG.JOINT]``: the servo of a joint, as `ServoCalibration` has it."""

    id: Count
    model: str
    drive_mode: Annotated[Count, Ge(0), Le(1)]
    homing_offset: Annotated[Count, Ge(-FARTHEST), Le(FARTHEST)]
    range_min: Count
    range_max: Count


class CalibrationFile(Table):
    """A calibration file.

    Attributes:
        robot: Name of the robot.
        joint: Servos by leg and joint.
    """

    robot: Name
    joint: dict[str, dict[str, JointTable]]


def _json(path: Path, content: str, robot: Robot) -> InvalidInput:
    """Return the error of a calibration in JSON; LeRobot's has no position at joint angle 0."""
    name = robot.name if robot.name in preset_names() else "FILE"
    what = f"{path.name} is JSON; a calibration is a TOML file."
    if '"homing_offset"' in content:
        what = (
            f"{path.name} is a calibration of LeRobot, whose homing_offset shifts what the servo "
            "reports; phasmid needs the position at joint angle 0, which the file does not have."
        )
    return InvalidInput(what, hint=f"phasmid bus calibrate /dev/ttyUSB0 --robot {name}")


@checked
def load_calibration(path: str | Path, robot: Robot) -> list[ServoCalibration]:
    """Read the calibration of a robot.

    Args:
        path: A ``.toml`` file.
        robot: The robot, L legs.

    Returns:
        3 L servos, leg by leg in the order of the robot: coxa, femur, tibia.

    Raises:
        InvalidInput: The file is absent or not well formed, belongs to another robot, lacks a
            joint or has an unknown one, has an id twice, or has a value that the servo or the
            joint cannot take.
    """
    path = Path(path)
    content = read_text(path, LARGEST_FILE)
    if content.lstrip().startswith("{"):
        raise _json(path, content, robot)
    raw = parse_toml(content, path.name)
    locate = in_file(path, content)
    table = validate(CalibrationFile, raw, locate)
    if table.robot != robot.name:
        raise InvalidInput(
            f'the calibration is of the robot "{table.robot}"; this robot is "{robot.name}".',
            where=locate(("robot",))[1],
        )
    names = {f"{leg.name}.{joint}": (leg.name, joint) for leg in robot.legs for joint in JOINTS}
    for leg, joints in table.joint.items():
        for joint in joints:
            if (leg, joint) not in names.values():
                guess = nearest(f"{leg}.{joint}", names)
                raise InvalidInput(
                    f'the robot has no joint "{leg}.{joint}".',
                    where=locate(("joint", leg, joint))[1],
                    hint=f'"{guess}"' if guess else f"its joints are {', '.join(names)}",
                )
    rows: list[ServoCalibration] = []
    for name, (leg, joint) in names.items():
        if joint not in table.joint.get(leg, {}):
            raise InvalidInput(
                f"the joint {name} is missing.",
                where=path.name,
                hint=f"[joint.{toml_key(leg)}.{joint}]",
            )
        row = ServoCalibration(name, **table.joint[leg][joint].model_dump())
        twin = next((other.joint for other in rows if other.id == row.id), None)
        with located(locate(("joint", leg, joint, "id"))[1]):
            if twin:
                raise InvalidInput(f"{twin} and {name} both have the id {row.id}.")
        with located(locate(("joint", leg, joint))[1]):
            limits = robot.leg(leg).joint_limits[JOINTS.index(joint)]
            _check(row, (float(limits[0]), float(limits[1])))
        rows.append(row)
    return rows


def _check(row: ServoCalibration, limits: tuple[float, float]) -> None:
    """Refuse what the servo, or the joint with these limits [rad], cannot take."""
    servo = model(row.model)
    for name, key in (("id", "id"), ("range_min", POSITIONS), ("range_max", POSITIONS)):
        register, value = servo.register(key), getattr(row, name)
        if not register.low <= value <= register.high:
            raise InvalidInput(
                f"{name} of {row.joint} is {value}; the {row.model} takes {register.low} to "
                f"{register.high}."
            )
    if row.range_min >= row.range_max:
        raise InvalidInput(
            f"range_min of {row.joint} is {row.range_min}; it must be below range_max, "
            f"{row.range_max}."
        )
    low, high = row.joint_range
    if low > limits[1] or high < limits[0]:
        angles = [f"{math.degrees(angle):.4g}°" for angle in (low, high, *limits)]
        raise InvalidInput(
            f"homing_offset of {row.joint} is {row.homing_offset}: its range is {angles[0]} to "
            f"{angles[1]}, outside the robot's limits, {angles[2]} to {angles[3]}."
        )


HEAD = """\
# register = middle + homing_offset + angle / step; with drive_mode 1, - angle / step.
# middle and step: {steps}
"""


@checked
def save_calibration(
    path: str | Path,
    calibration: Sequence[ServoCalibration],
    robot_name: str,
    force: bool = False,
) -> None:
    """Write a calibration file.

    Args:
        path: The ``.toml`` file.
        calibration: The servos of all joints.
        robot_name: Name of the robot.
        force: Whether an older file is replaced.

    Raises:
        AlreadyExists: The file exists, and `force` is False.
        OutputError: It cannot be written.
    """
    path = Path(path)
    check_new_file(path, option="--out FILE", force=force)
    registers = {row.model: model(row.model).register("goal_position") for row in calibration}
    steps = [
        f"{name} {r.zero} and {math.degrees(r.scale):.4g} degrees" for name, r in registers.items()
    ]
    lines = [HEAD.format(steps=", ".join(steps)), f"robot = {toml_value(robot_name)}"]
    keys = [field.name for field in fields(ServoCalibration)][1:]
    for row in calibration:
        leg, _, joint = row.joint.rpartition(".")
        lines += ["", f"[joint.{toml_key(leg)}.{joint}]"]
        lines += [
            f"{key} = {toml_value(value)}"
            for key, value in zip(keys, astuple(row)[1:], strict=True)
        ]
    write_whole(path, ("\n".join(lines) + "\n").encode())
