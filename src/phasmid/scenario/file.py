"""Scenario files, and the scenario and robot of a recording: TOML in and out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from phasmid import formats
from phasmid.arguments import checked
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.gait import is_gait_file
from phasmid.robot.file import OTHER_FORMATS, robot_from_table
from phasmid.robot.unread import refuse_unread
from phasmid.scenario.scenario import Scenario
from phasmid.scenario.terrain import beside
from phasmid.tables import Table, in_file, key_of, validate
from phasmid.toml import find_file, parse_toml, preset_names, read_toml, toml_value
from phasmid.units import UNITS, split_unit


def scenario_names() -> tuple[str, ...]:
    """Return the names of the scenarios that come with phasmid."""
    return preset_names("phasmid.scenario")


@checked
def load_scenario(source: str | Path = "paper", *, read_robot: bool = True) -> Scenario:
    """Load a scenario from a preset or a file, with its robot where that is no TOML file.

    Args:
        source: Name of a preset, such as ``paper``, or path of a ``.toml`` file. A robot file,
            gait file or height map that it names is looked for beside it.
        read_robot: Whether a robot in URDF, MJCF or STEP is read.

    Raises:
        InvalidInput: There is no such preset or file, or it is not well formed.
        InvalidRobot: No machine could have the robot's numbers, or the model does not cover it.
    """
    path = find_file(source, "phasmid.scenario", "scenario")
    if path.suffix.lower() in OTHER_FORMATS:
        raise InvalidInput(f"{path} is a robot file, no scenario.", hint=f"--robot {path}")
    refuse_unread(path)
    raw, content = read_toml(path)
    terrain = raw.get("terrain")
    if isinstance(terrain, dict) and isinstance(terrain.get("height_map"), str):
        terrain["height_map"] = beside(path, terrain["height_map"])
    gait = raw.get("gait")
    if isinstance(gait, str) and is_gait_file(gait):
        raw["gait"] = str(path.parent / gait)
    elif isinstance(gait, dict) and is_gait_file(gait.get("name")) and "offsets" not in gait:
        gait["name"] = str(path.parent / gait["name"])
    try:
        scenario = validate(Scenario, raw, in_file(path, content))
    except PhasmidError as error:
        if path.name not in error.where:
            # A table that is refused as a whole tells its own name alone.
            error.where = ", ".join(filter(None, (path.name, error.where)))
        raise
    if isinstance(scenario.robot, str) and Path(scenario.robot).suffix:
        scenario = scenario.model_copy(update={"robot": str(path.parent / scenario.robot)})
    return with_robot(scenario) if read_robot else scenario


def with_robot(scenario: Scenario) -> Scenario:
    """Read the robot of a scenario where its file is URDF, MJCF or STEP.

    Raises:
        InvalidInput: The file is absent, or not well formed.
        InvalidRobot: No machine could have these numbers, or the model does not cover it.
    """
    if not isinstance(scenario.robot, str) or not formats.is_foreign(scenario.robot):
        return scenario
    return scenario.replace(robot=formats.load_robot(scenario.robot, scenario.robot_import))


def scenario_to_toml(scenario: Scenario, robot: str) -> str:
    """Write a scenario as TOML with all fields, which loads to the same numbers.

    Args:
        scenario: The scenario.
        robot: Name of the robot in the file: a preset, or a file beside it.
    """
    lines, tables = [], []
    for name, field in Scenario.model_fields.items():
        value = robot if name == "robot" else getattr(scenario, name)
        if isinstance(value, Table):
            tables += ["", f"[{name}]"]
            for inner_name, inner in type(value).model_fields.items():
                inner_value = getattr(value, inner_name)
                if inner_value is not None:
                    tables.append(_entry(key_of(inner_name, inner), inner_name, inner_value))
        else:
            lines.append(_entry(key_of(name, field), name, value))
    return "\n".join(lines + tables) + "\n"


def _entry(key: str, name: str, value: Any) -> str:
    ending = split_unit(key)[1] if key != name else ""
    if ending and not isinstance(value, tuple):
        unit = UNITS[ending]
        shown = float(f"{unit.from_si(value):.15g}")
        # People read millimetres, but a number that would be rounded stays in SI.
        if unit.to_si(shown) == value:
            return f"{key} = {shown:.15g}"
    return f"{name} = {toml_value(value)}"


def recorded_scenario(attributes: Mapping[Any, Any], folder: Path | None = None) -> Scenario:
    """Read the scenario, with its robot, from a recording's attributes.

    Args:
        attributes: Those of the recording.
        folder: Where the robot's meshes may lie, which no text carries.

    Returns:
        The scenario with the robot as its file gives it, with the servo that the run had.

    Raises:
        InvalidInput: There are none, or they are not well formed.
    """
    robot_raw, robot_text = _table(attributes, "robot")
    scenario_raw, scenario_text = _table(attributes, "scenario")
    robot = robot_from_table(robot_raw, Path("robot.toml"), robot_text, folder)
    locate = in_file(Path("scenario.toml"), scenario_text)
    scenario = validate(Scenario, scenario_raw, locate)
    # The recorded robot has the numbers of the servo, which a later catalogue may not repeat.
    servo = scenario.servo.model_copy(update={"servo": None})
    return scenario.model_copy(update={"robot": robot, "servo": servo})


def _table(attributes: Mapping[Any, Any], name: str) -> tuple[dict[str, Any], str]:
    text = attributes.get(name)
    if not isinstance(text, str) or not text:
        raise InvalidInput(f"the recording has no {name}; a report needs it.")
    return parse_toml(text, f"the recording's {name}"), text
