"""Files of the page: scenarios to save; scenarios and height maps to load."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

from phasmid.arguments import described
from phasmid.errors import InvalidInput, PhasmidError, located, nearest
from phasmid.gait.file import is_gait_file
from phasmid.robot import preset_names, robot_to_toml
from phasmid.scenario import load_scenario, scenario_to_toml
from phasmid.studio.messages import Load
from phasmid.studio.setting import Setting, setting_of
from phasmid.terrain.height_text import BEGINNING
from phasmid.toml import read_toml

MOST_FILES = 32
"""Most loaded files: they stay in memory."""


def scenario_file(setting: Setting) -> dict[str, Any]:
    """Return the setting as a scenario file; the body's pose is no part of a scenario.

    Returns:
        ``name`` and ``text`` of the file, and by ``robot`` those of the robot's file, unless the
        robot is a preset.
    """
    scenario = setting.scenario
    name = f"{scenario.name}.toml"
    robot = scenario.robot
    if isinstance(robot, str):
        return {"name": name, "text": scenario_to_toml(scenario, robot)}
    robot_file = _kept_name(f"{robot.name}-of-{scenario.name}.toml")
    file = {"name": robot_file, "text": robot_to_toml(robot)}
    return {"name": name, "text": scenario_to_toml(scenario, robot_file), "robot": file}


def with_file(setting: Setting, load: Load, folder: Path) -> Setting:
    """Return the setting with a loaded file.

    Args:
        setting: Present setting.
        load: File.
        folder: Folder of loaded files, where a scenario finds a height map by its name.

    Raises:
        InvalidInput: It is malformed, cannot be used, or is one too many.
    """
    if len(setting.grounds) >= MOST_FILES:
        raise InvalidInput(
            f"{MOST_FILES} files were taken in, which are the most.", hint="start the studio anew"
        )
    path = folder / _kept_name(load.name)
    # Only a height map that is used stays. An older file of that name may be one; no file that is
    # loaded is called so.
    older, stays = folder / ".older", False
    if path.exists():
        path.replace(older)
    try:
        path.write_bytes(load.content)
        if load.what == "scenario":
            _check_named_files(path, setting)
            initial = setting_of(load_scenario(path, read_robot=False))
            return replace(
                initial, walks=setting.walks, robots=setting.robots, grounds=setting.grounds
            )
        with located(path.name):
            scenario = setting.scenario.replace(terrain="height-map", height_map=str(path))
        grounds = {**setting.grounds, path.name: scenario.terrain.height_map}
        changed = replace(setting, scenario=scenario, grounds=grounds)
        stays = True
        return changed
    except PhasmidError as error:
        # People know the files by their own names.
        for part in ("what", "where", "hint"):
            text = getattr(error, part)
            setattr(error, part, text.replace(f"{folder}{os.sep}", ""))
        raise
    finally:
        if not stays:
            path.unlink(missing_ok=True)
        if older.exists():
            older.unlink() if stays else older.replace(path)


def _kept_name(name: str) -> str:
    """Return the name of a stored file: without folders, of harmless letters."""
    last = re.split(r"[/\\]", name)[-1]
    return re.sub(r"[^A-Za-z0-9._-]", "_", last)[-64:].lstrip(".") or "file"


def _has_values(table: dict[str, Any]) -> bool:
    return any(_has_values(v) if isinstance(v, dict) else v != [] for v in table.values())


def _check_named_files(path: Path, setting: Setting) -> None:
    """Refuse a scenario that names files of this machine, other than loaded height maps."""
    raw, _ = read_toml(path)
    if not _has_values(raw):
        raise InvalidInput("the file has no values; a scenario has at least one.", where=path.name)
    terrain, gait = (
        table if isinstance(table, dict) else {"name": table}
        for table in (raw.get("terrain"), raw.get("gait"))
    )
    robot, height_map = raw.get("robot", ""), terrain.get("height_map", "")
    where = path.name
    if robot and robot not in preset_names():
        guess = nearest(str(robot), preset_names())
        raise InvalidInput(
            f"robot is {described(robot)}; a scenario that is loaded in the page must have the "
            "robot of a preset.",
            where=where,
            hint=f'"{guess}"' if guess and "." not in str(robot) else "phasmid studio FILE",
        )
    reading = raw.get("robot_import")
    if isinstance(reading, dict) and reading.get("package"):
        raise InvalidInput(
            "robot_import.package names a folder of this machine; a scenario that is loaded in the "
            "page must name none.",
            where=where,
        )
    if "offsets" not in gait and is_gait_file(gait.get("name")):
        raise InvalidInput(
            f"gait is {described(gait['name'])}, a file; a scenario that is loaded in the page "
            "must contain its gait.",
            where=where,
            hint="a table [gait] with its offsets",
        )
    is_file = isinstance(height_map, str) and not height_map.startswith(BEGINNING)
    if is_file and height_map not in {"", *setting.grounds}:
        raise InvalidInput(
            f"terrain.height_map is {described(height_map)}, a file that was not loaded; load that "
            "file first, and then the scenario again.",
            where=where,
            hint=f"name it {_kept_name(str(height_map))}, without folders",
        )
