"""Scenario and robot of a recording."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from phasmid.errors import InvalidInput
from phasmid.robot import Robot
from phasmid.robot.file import robot_from_table
from phasmid.scenario.scenario import Scenario
from phasmid.tables import in_file, validate
from phasmid.toml import parse_toml


def recorded_scenario(
    attributes: Mapping[Any, Any], folder: Path | None = None
) -> tuple[Scenario, Robot]:
    """Read the scenario and the robot from a recording's attributes.

    Args:
        attributes: Those of the recording.
        folder: Where the robot's meshes may lie, which no text carries.

    Returns:
        The scenario, whose robot is only a file's name, and the robot as its file gives it.

    Raises:
        InvalidInput: There are none, or they are not well formed.
    """
    robot_raw, robot_text = _table(attributes, "robot")
    scenario_raw, scenario_text = _table(attributes, "scenario")
    robot = robot_from_table(robot_raw, Path("robot.toml"), robot_text, folder)
    locate = in_file(Path("scenario.toml"), scenario_text)
    return validate(Scenario, scenario_raw, locate), robot


def _table(attributes: Mapping[Any, Any], name: str) -> tuple[dict[str, Any], str]:
    text = attributes.get(name)
    if not isinstance(text, str) or not text:
        raise InvalidInput(f"the recording has no {name}; a report needs it.")
    return parse_toml(text, f"the recording's {name}"), text
