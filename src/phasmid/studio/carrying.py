"""Settings that leave the page and come back: as links, scenario files, robots and height maps."""

from __future__ import annotations

import base64
import binascii
import json
import os
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from phasmid.arguments import described
from phasmid.errors import InvalidInput, PhasmidError, located, nearest
from phasmid.formats import load_robot
from phasmid.gait.file import is_gait_file
from phasmid.robot import preset_names, robot_to_toml
from phasmid.scenario import load_scenario, scenario_names, scenario_to_toml
from phasmid.studio.errors import TooMany
from phasmid.studio.fields import FIELDS, catalogue, field_of, values
from phasmid.studio.messages import Load
from phasmid.studio.setting import Setting, setting_of
from phasmid.studio.strict import read_json
from phasmid.terrain.height_text import BEGINNING
from phasmid.toml import read_toml

USUAL = "paper"
"""The scenario from which a link tells what differs, where its own is none that comes with us."""

MASSES = ("as-given", "geometry")
"""Values of ``robot_import.masses`` that name no robot."""

MOST_FILES = 32
"""Most files that are taken in: their robots stay in memory."""


def scenario_file(setting: Setting) -> dict[str, Any]:
    """The setting as a scenario's file, and its robot's where that is no preset as it comes.

    Args:
        setting: What is to be kept; what a scenario does not know, the body's pose, is not.

    Returns:
        ``name`` and ``text``, and by ``robot`` those of the file that belongs beside it.
    """
    scenario = setting.scenario
    name = f"{scenario.name}.toml"
    given = setting.machine.base_robot()
    if given is setting.base and isinstance(scenario.robot, str):
        return {"name": name, "text": scenario_to_toml(scenario, scenario.robot)}
    own = _kept_name(f"{given.name}-of-{scenario.name}.toml")
    file = {"name": own, "text": robot_to_toml(given)}
    return {"name": name, "text": scenario_to_toml(scenario, own), "robot": file}


def link_of(setting: Setting) -> str:
    """The part of an address that brings another person to the same setting.

    Args:
        setting: The setting.

    Raises:
        InvalidInput: It has a robot or a ground from a file, which no link carries.
    """
    for what, name in (("robot", setting.robot_name), ("terrain", setting.terrain_name)):
        if name in setting.robots or name in setting.grounds:
            raise InvalidInput(
                f"the {what} is from the file {name}, which no link can carry.",
                hint="save the scenario",
            )
    name = setting.scenario.name
    name = name if name in scenario_names() else USUAL
    usual = values(_beginning(name, setting))
    shown = {one["name"] for one in catalogue(setting)["fields"]}
    differs = {
        key: value
        for key, value in values(setting).items()
        if value != usual[key] and (key in shown or key in usual)
    }
    text = json.dumps({"scenario": name} | differs, separators=(",", ":"))
    return "#s=" + base64.urlsafe_b64encode(text.encode()).decode().rstrip("=")


def _beginning(name: str, setting: Setting) -> Setting:
    """A preset's setting, with the files that this one knows."""
    begun = setting_of(load_scenario(name))
    return replace(begun, robots=setting.robots, grounds=setting.grounds)


def from_link(text: str, setting: Setting) -> Setting:
    """The setting that a link tells.

    Args:
        text: As `link_of` gives it, or as JSON.
        setting: The present one, whose files stay known.

    Raises:
        InvalidInput: It is no such text, or a value is refused.
    """
    with located("the link"):
        told = _table(text.strip())
        name = told.pop("scenario", USUAL)
        if name not in scenario_names():
            known = ", ".join(scenario_names())
            raise InvalidInput(f"scenario is {name!r}; it must be one of {known}.")
        return with_values(_beginning(name, setting), told)


def with_values(setting: Setting, told: Mapping[str, object]) -> Setting:
    """A setting with other values of some fields, set in the catalogue's order.

    Args:
        setting: The present one.
        told: Values as people know them, by the fields' names.

    Raises:
        InvalidInput: There is no such field, or its value is refused.
    """
    for name in told:
        field_of(name)
    # The robot tells which gaits and loads there are.
    order = sorted(FIELDS, key=lambda one: one.name != "robot")
    for one in order:
        if one.name in told:
            setting = one.changed(setting, told[one.name])
    return setting


def _table(text: str) -> dict[str, Any]:
    """What a link carries."""
    if not text.startswith("{"):
        code = text.removeprefix("#").removeprefix("s=")
        try:
            raw = base64.urlsafe_b64decode(code + "=" * (-len(code) % 4))
            text = raw.decode()
        except (binascii.Error, ValueError):
            raise InvalidInput("it is no setting: not text in base64.") from None
    try:
        told = read_json(text, "link")
    except InvalidInput as error:
        raise InvalidInput(f"it is no setting: {error.what}") from None
    if not isinstance(told, dict):
        raise InvalidInput("it is no setting; it must be a table of fields.")
    return told


def with_file(setting: Setting, load: Load, folder: Path) -> Setting:
    """A setting with what a file tells.

    Args:
        setting: The present one.
        load: The file.
        folder: Where it is kept, so that other files can name it.

    Raises:
        InvalidInput: It is not well formed, or cannot be used.
        TooMany: So many files are known that no further one is taken.
    """
    if len(setting.robots) + len(setting.grounds) >= MOST_FILES:
        raise TooMany(
            f"{MOST_FILES} files were taken in, which are the most.", hint="start the studio anew"
        )
    path = folder / _kept_name(load.name)
    # It marks the model's folder, so that no package is looked for above it.
    (folder / "package.xml").touch()
    path.write_bytes(load.content)
    try:
        return _with_file(setting, load.what, path)
    except PhasmidError as error:
        # A person knows the files by their own names.
        for part in ("what", "where", "hint"):
            text = getattr(error, part)
            setattr(error, part, text.replace(f"{folder}{os.sep}", ""))
        raise


def _kept_name(name: str) -> str:
    """The name under which a file is kept: without folders, and of harmless letters."""
    last = re.split(r"[/\\]", name)[-1]
    return re.sub(r"[^A-Za-z0-9._-]", "_", last)[-64:].lstrip(".") or "file"


def _check_named_files(path: Path) -> None:
    """Refuse a scenario that names other files than presets and those uploaded before it.

    Raises:
        InvalidInput: It names another file or folder of this machine.
    """
    raw, _ = read_toml(path)
    tables = [raw.get(name) for name in ("terrain", "gait", "robot_import")]
    terrain, gait, reading = (table if isinstance(table, dict) else {} for table in tables)
    robot, masses = raw.get("robot"), reading.get("masses")
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
        "robot_import.masses": masses if masses not in (*MASSES, *preset_names()) else None,
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
        masses = path.parent / scenario.robot_import.masses
        if masses.is_file():
            scenario = scenario.replace(masses=str(masses))
        begun = setting_of(scenario)
        robots = {**setting.robots, **begun.robots}
        return replace(begun, walks=setting.walks, robots=robots, grounds=setting.grounds)
    if what == "robot":
        if path.name in preset_names():
            raise InvalidInput(f'"{path.name}" is the name of a preset; give the file another.')
        robot = load_robot(path)
        return replace(setting, robots={**setting.robots, path.name: robot}).with_robot(robot)
    with located(path.name):
        scenario = setting.scenario.replace(terrain="height-map", height_map=str(path))
    grounds = {**setting.grounds, path.name: scenario.terrain.height_map}
    return replace(setting, scenario=scenario, grounds=grounds)
