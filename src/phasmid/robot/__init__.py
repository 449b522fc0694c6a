"""The robot: body, legs and links."""

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

__all__ = [
    "HEXAPOD_LEGS",
    "JOINTS",
    "Appearance",
    "Body",
    "Leg",
    "LegArrays",
    "Link",
    "Part",
    "Robot",
    "load_robot",
    "preset_names",
    "robot_to_toml",
    "with_mass_model",
    "with_mounts",
    "with_neutral_foot",
    "with_payload",
    "with_servo",
    "with_values",
]
