"""The robot: body, legs, links and servos."""

from phasmid.robot.appearance import Appearance, Part
from phasmid.robot.file import load_robot, preset_names, robot_to_toml, with_values
from phasmid.robot.leg import JOINTS, Leg
from phasmid.robot.link import Link
from phasmid.robot.robot import HEXAPOD_LEGS, Body, LegArrays, Robot
from phasmid.robot.variants import (
    with_mass_model,
    with_mounts,
    with_neutral_foot,
    with_payload,
    with_servo,
)
from phasmid.servo import load_servo, servo_names
from phasmid.servo.friction import Friction
from phasmid.servo.motor import Motor
from phasmid.servo.rules import complete_servo
from phasmid.servo.servo import Servo

__all__ = [
    "HEXAPOD_LEGS",
    "JOINTS",
    "Appearance",
    "Body",
    "Friction",
    "Leg",
    "LegArrays",
    "Link",
    "Motor",
    "Part",
    "Robot",
    "Servo",
    "complete_servo",
    "load_robot",
    "load_servo",
    "preset_names",
    "robot_to_toml",
    "servo_names",
    "with_mass_model",
    "with_mounts",
    "with_neutral_foot",
    "with_payload",
    "with_servo",
    "with_values",
]
