"""Files of the page: scenarios to save; scenarios, robots and height maps to load."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

from phasmid.arguments import described
from phasmid.errors import InvalidInput, PhasmidError, located, nearest
from phasmid.formats import load_robot
from phasmid.gait.file import is_gait_file
from phasmid.robot import preset_names, robot_to_toml
from phasmid.scenario import load_scenario, scenario_to_toml
from phasmid.studio.messages import Load
from phasmid.studio.setting import Setting, setting_of
from phasmid.terrain.height_text import BEGINNING
from phasmid.toml import read_toml

MOST_FILES = 32
"""Most loaded files: their robots stay in memory."""


def scenario_file(setting: Setting) -> dict[str, Any]:
    """Return the setting as a scenario file; the body's pose is no part of a scenario.

    Returns:
        ``name`` and ``text`` of the file, and by ``robot`` those of the robot's file, unless the
        robot is an unchanged preset.
    """
    scenario = setting.scenario
    name = f"{scenario.name}.toml"
    robot = setting.machine.base_robot()
    if robot is setting.base and isinstance(scenario.robot, str):
        return {"name": name, "text": scenario_to_toml(scenario, scenario.robot)}
    robot_file = _kept_name(f"{robot.name}-of-{scenario.name}.toml")
    file = {"name": robot_file, "text": robot_to_toml(robot)}
    return {"name": name, "text": scenario_to_toml(scenario, robot_file), "robot": file}


def with_file(setting: Setting, load: Load, folder: Path) -> Setting:
    """Return the setting with a loaded file.

    Args:
        setting: Present setting.
        load: File.
        folder: Folder of loaded files, where later files find it by its name.

    Raises:
        InvalidInput: It is malformed, cannot be used, or is one too many.
    """
    if len(setting.robots) + len(setting.grounds) >= MOST_FILES:
        raise InvalidInput(
            f"{MOST_FILES} files were taken in, which are the most.", hint="start the studio anew"
        )
    path = folder / _kept_name(load.name)
    # Marks the folder of a package: packages above it are not searched.
    (folder / "package.xml").touch()
    path.write_bytes(load.content)
    try:
        return _with_file(setting, load.what, path)
    except PhasmidError as error:
        # People know the files by their own names.
        for part in ("what", "where", "hint"):
            text = getattr(error, part)
            setattr(error, part, text.replace(f"{folder}{os.sep}", ""))
        raise


def _kept_name(name: str) -> str:
    """Return the name of a stored file: without folders, of harmless letters."""
    last = re.split(r"[/\\]", name)[-1]
    return re.sub(r"[^A-Za-z0-9._-]", "_", last)[-64:].lstrip(".") or "file"


def _check_named_files(path: Path) -> None:
    """Refuse a scenario that names files of this machine other than those loaded before it."""
    raw, _ = read_toml(path)
    tables = [raw.get(name) for name in ("terrain", "gait", "robot_import")]
    terrain, gait, reading = (table if isinstance(table, dict) else {} for table in tables)
    robot = raw.get("robot")
    gait_name = None if "offsets" in gait else gait.get("name", tables[1])
    if reading.get("package"):
        raise InvalidInput(
            f"robot_import.package is {described(reading['package'])}, which names folders of "
            "this machine; a scenario that is loaded in the page must name none.",
            where=path.name,
            hint="phasmid studio SCENARIO",
        )
    named = {
        "robot": robot if robot not in preset_names() else None,
        "terrain.height_map": terrain.get("height_map"),
        "gait": gait_name if is_gait_file(gait_name) else None,
    }
    for what, name in named.items():
        if not isinstance(name, str) or not name or name.startswith(BEGINNING):
            continue
        if name == _kept_name(name) and (path.parent / name).is_file() and name != path.name:
            continue
        file, guess = _kept_name(name), nearest(name, preset_names())
        hint = file if file == name else f"name it {file}, without folders"
        raise InvalidInput(
            f"{what} is {described(name)}, a file that was not loaded; load that file first, and "
            "then the scenario again.",
            where=path.name,
            hint=f'"{guess}"' if guess and what == "robot" and "." not in name else hint,
        )


def _with_file(setting: Setting, what: str, path: Path) -> Setting:
    if what == "scenario":
        _check_named_files(path)
        scenario = load_scenario(path)
        initial = setting_of(scenario)
        robots = {**setting.robots, **initial.robots}
        return replace(initial, walks=setting.walks, robots=robots, grounds=setting.grounds)
    if what == "robot":
        if path.name in preset_names():
            raise InvalidInput(f'"{path.name}" is the name of a preset; give the file another.')
        robot = load_robot(path)
        return replace(setting, robots={**setting.robots, path.name: robot}).with_robot(robot)
    with located(path.name):
        scenario = setting.scenario.replace(terrain="height-map", height_map=str(path))
    grounds = {**setting.grounds, path.name: scenario.terrain.height_map}
    return replace(setting, scenario=scenario, grounds=grounds)
