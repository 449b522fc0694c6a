"""Robot files in TOML."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from phasmid import toml
from phasmid.arguments import checked
from phasmid.errors import InvalidInput, InvalidRobot, located, nearest
from phasmid.robot.appearance import Appearance
from phasmid.robot.glb import read_glb
from phasmid.robot.leg import JOINTS, RATIOS, Leg
from phasmid.robot.link import Link, check_length, solid_box
from phasmid.robot.robot import HEXAPOD_LEGS, Body, Robot
from phasmid.robot.table import MOST_LEGS, LegTable, RobotTable
from phasmid.robot.unread import refuse_unread
from phasmid.servo.catalogue import servo_table
from phasmid.tables import Locator, dotted, validate
from phasmid.toml import find_file, line_of, read_toml, toml_key, toml_lines
from phasmid.units import STANDARD_GRAVITY, split_unit

OTHER_FORMATS = (".urdf", ".xml", ".mjcf", ".step", ".stp")
"""Endings of robot files that `phasmid.formats` reads."""

MOST_SHARED = 1000
"""Most values of ``[leg]``."""


def preset_names() -> tuple[str, ...]:
    """Return the names of the preset robots."""
    return toml.preset_names("phasmid.robot")


@checked
def load_robot(source: str | Path) -> Robot:
    """Load a robot from a preset or a file.

    Args:
        source: Name of a preset, such as ``phantomx-paper``, or path of a ``.toml`` file.

    Raises:
        InvalidInput: There is no such preset or file, or it is not well formed.
        InvalidRobot: No machine could have these numbers.
    """
    path = find_file(source, "phasmid.robot", "robot")
    if path.suffix.lower() in OTHER_FORMATS:
        raise InvalidInput(
            f"{path.name} is no TOML file; the robot must be loaded before it is used here.",
            hint=f'robot=phasmid.load_robot("{path}")',
        )
    refuse_unread(path)
    raw, content = read_toml(path)
    return robot_from_table(raw, path, content, path.parent)


def robot_from_table(
    raw: dict[str, Any], path: Path, content: str, folder: Path | None = None
) -> Robot:
    """Build a robot from the table of its file, whose name and text are for messages.

    Meshes may lie in the folder; those that come with phasmid are found without it.

    Raises:
        InvalidInput: The table is not well formed.
        InvalidRobot: No machine could have these numbers.
    """
    locate = _locator(path, content)
    with located(path.name):
        table = validate(RobotTable, _merged(raw), locate)
        names = _ordered_names(tuple(table.legs), table.leg_count)
        legs = []
        for name in names:
            with located(locate(("legs", name))[1]):
                legs.append(_leg(name, table.legs[name], locate))
        body = _body(table, sum(link.mass for leg in legs for link in leg.links))
        servo = table.servo.servo()
        return Robot(
            table.name,
            body,
            tuple(legs),
            servo,
            table.description,
            _appearance(table.appearance, folder),
            table.foot_radius,
        )


def with_values(robot: Robot, values: Mapping[str, Any]) -> Robot:
    """Return a robot with other values of its file.

    Args:
        robot: The robot.
        values: By place in the file, such as ``body.mass_g`` or ``legs.*.tibia_mm``; ``*`` stands
            for all keys of a level. A link's length changes neither its mass nor its inertia.

    Raises:
        InvalidInput: There is no such value, or it is refused.
        InvalidRobot: No machine could have these numbers.
    """
    table = toml.parse_toml(robot_to_toml(robot), "robot")
    for place, value in values.items():
        _set_value(table, place.split("."), value)
    return robot_from_table(table, Path("robot"), "")


def _set_value(table: dict[str, Any], path: list[str], value: Any) -> None:
    """Replace a value in a robot's table, whatever unit it has there; ``*`` is each key."""
    head, *rest = path
    if not rest:
        for key in [key for key in table if split_unit(key)[0] == split_unit(head)[0]]:
            del table[key]
        table[head] = copy.deepcopy(value)
        return
    for key in list(table) if head == "*" else [head]:
        if not isinstance(table.get(key), dict):
            guess = nearest(key, [name for name in table if isinstance(table[name], dict)])
            raise InvalidInput(
                f'the robot has no table "{key}".', hint=f'"{guess}"' if guess else ""
            )
        _set_value(table[key], rest, value)


def _appearance(name: str | None, folder: Path | None) -> Appearance | None:
    """Return the appearance in a file beside the robot's, or of a preset.

    A recording carries its robot as text alone: where the file is not at hand, the robot walks
    all the same.
    """
    if name is None:
        return None
    presets = Path(str(resources.files("phasmid.robot") / "presets"))
    for place in (folder, presets):
        if place and (place / name).is_file() and not (place / name).is_symlink():
            return Appearance(partial(read_glb, place / name), name)
    return None


def _locator(path: Path, content: str) -> Locator:
    """Return the place of a value: the table of its leg, or the shared table ``[leg]``."""

    def locate(loc: tuple[str | int, ...]) -> tuple[str, str]:
        line, depth = line_of(content, loc)
        if loc[:1] == ("legs",) and len(loc) > 2:
            shared = ("leg", *loc[2:])
            shared_line, shared_depth = line_of(content, shared)
            # Two keys lead to a leg's own table, one to the shared table.
            if shared_depth - 1 > depth - 2:
                line, loc = shared_line, shared
        return dotted(loc), f"{path.name}, line {line}" if line else path.name

    return locate


def _merged(raw: dict[str, Any]) -> dict[str, Any]:
    """Return the file's table with ``[leg]`` merged into every leg."""
    raw = dict(raw)
    shared, legs = raw.pop("leg", {}), raw.get("legs", {})
    if not isinstance(shared, Mapping) or not isinstance(legs, Mapping):
        raise InvalidInput("leg and legs must be tables.")
    if len(legs) > MOST_LEGS:
        raise InvalidInput(f"{len(legs)} legs are given; at most {MOST_LEGS} are possible.")
    # Each leg gets a copy, and each wrong value in it is an error of its own.
    if _count(shared) > MOST_SHARED:
        raise InvalidInput(f"leg has more than {MOST_SHARED} values; such files are refused.")
    spread = {}
    for name, own in legs.items():
        if not isinstance(own, Mapping):
            raise InvalidInput(f"legs.{name} must be a table.")
        spread[name] = _overlay(shared, own)
    if "legs" in raw:
        raw["legs"] = spread
    return raw


def _count(table: Mapping[str, Any]) -> int:
    """Return the number of keys in a table and in the tables inside it."""
    inner = (_count(value) for value in table.values() if isinstance(value, Mapping))
    return len(table) + sum(inner)


def _overlay(shared: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Merge two tables; a key replaces the shared one of any unit."""
    names = {split_unit(key)[0] for key in own}
    if names & {"neutral_foot", "home"}:
        # Either of the two places the foot.
        names |= {"neutral_foot", "home"}
    merged = {key: value for key, value in shared.items() if split_unit(key)[0] not in names}
    for key, value in own.items():
        under = shared.get(key)
        if isinstance(value, Mapping) and isinstance(under, Mapping):
            value = _overlay(under, value)
        merged[key] = value
    return merged


def _ordered_names(names: tuple[str, ...], count: int) -> tuple[str, ...]:
    if len(names) == count:
        return HEXAPOD_LEGS if set(names) == set(HEXAPOD_LEGS) else names
    missing = [n for n in HEXAPOD_LEGS if n not in names]
    if count == 6 and missing and set(names) <= set(HEXAPOD_LEGS):
        raise InvalidRobot(
            f"robot: {len(names)} legs given; a hexapod has 6. Missing: {', '.join(missing)}.",
            hint=f"leg_count = {len(names)}, if it is no hexapod" if len(names) >= 4 else "",
        )
    raise InvalidRobot(
        f"robot: {len(names)} legs given; leg_count is {count}.",
        hint=f"leg_count = {len(names)}",
    )


def _leg(name: str, table: LegTable, locate: Locator) -> Leg:
    def at(*path: str) -> str:
        return locate(("legs", name, *path))[1]

    links: dict[str, Any] = {}
    for joint in JOINTS:
        link, length = getattr(table.links, joint), getattr(table, joint)
        with located(at(joint)):
            # Before the link, whose message has no leg.
            check_length(length, f"leg {name}: {joint}", joint, may_be_zero=joint == "coxa")
        with located(at("links", joint)):
            com = [length / 2, 0.0, 0.0] if link.com is None else link.com
            box = solid_box((length, link.width, link.width), link.mass)
            inertia = box if link.inertia is None else np.array(link.inertia)
            offset = link.lateral_offset
            links[joint] = Link(joint, length, link.mass, np.array(com), inertia, offset)
    limits = np.array([getattr(table.joint_limits, joint) for joint in JOINTS])
    foot = table.neutral_foot
    if (foot is None) == (table.home is None):
        raise InvalidInput(f"legs.{name} must have either neutral_foot_mm or home_deg.")
    if table.home is not None:
        with located(at("home")):
            foot = _foot_at_home(name, table, limits)
    ratios: dict[str, Any] = {ratio: np.array(getattr(table, ratio)) for ratio in RATIOS}
    return Leg(
        name,
        **links,
        mount_position=np.array(table.mount),
        mount_yaw=table.yaw,
        neutral_foot=np.array(foot),
        joint_limits=limits,
        femur_bend=table.femur_bend,
        tibia_bend=table.tibia_bend,
        mount_pitch=table.pitch,
        mount_roll=table.roll,
        **ratios,
    )


def _foot_at_home(name: str, table: LegTable, limits: np.ndarray) -> list[float]:
    home = table.home or []
    for joint, angle, (lower, upper) in zip(JOINTS, home, limits, strict=True):
        if not lower <= angle <= upper:
            raise InvalidRobot(
                f"joint {name}.{joint}: home {math.degrees(angle):.4g}° is outside "
                f"[{math.degrees(lower):.4g}°, {math.degrees(upper):.4g}°]."
            )
    q1, q2, q3 = home
    r = table.coxa + table.femur * math.cos(q2) + table.tibia * math.cos(q2 + q3)
    z = table.femur * math.sin(q2) + table.tibia * math.sin(q2 + q3)
    left = sum(getattr(table.links, joint).lateral_offset for joint in JOINTS)
    c, s = math.cos(q1), math.sin(q1)
    return [c * r - s * left, s * r + c * left, z]


def _body(table: RobotTable, leg_mass: float) -> Body:
    body = table.body
    mass = body.mass
    if table.total_weight is not None:
        if mass is not None:
            raise InvalidInput("body.mass and total_weight are both given; one must go.")
        mass = table.total_weight / STANDARD_GRAVITY - leg_mass
        if mass <= 0:
            raise InvalidRobot(
                f"robot: total_weight is {table.total_weight:g} N; its legs alone weigh "
                f"{leg_mass * STANDARD_GRAVITY:.4g} N, so nothing is left for the body."
            )
    if mass is None:
        raise InvalidInput("body.mass is missing.", hint="mass_g = ..., or total_weight_n = ...")
    com = body.box_centre if body.com is None else body.com
    box = solid_box(tuple(body.size), mass)
    inertia = box if body.inertia is None else np.array(body.inertia)
    return Body(mass, np.array(com), inertia, np.array(body.size), np.array(body.box_centre))


def robot_to_toml(robot: Robot) -> str:
    """Return a robot as the text of a file that loads to exactly the same numbers.

    Keys carry no units: all numbers are SI and radians, so that none is rounded.
    """
    body, look = robot.body, robot.appearance
    box = ("size", "box_centre") if body.box_centre.any() else ("size",)
    lines = [
        "# Lengths in m, masses in kg, inertias in kg m^2, angles in rad, torques in N m,",
        "# temperatures in degrees Celsius.",
        *toml_lines({"name": robot.name, "description": robot.description}),
        *(toml_lines({"appearance": look.name}) if look and look.name else []),
        f"leg_count = {len(robot.legs)}",
        *(toml_lines({"foot_radius": robot.foot_radius}) if robot.foot_radius else []),
        "",
        *servo_table(robot.servo),
        "",
        "[body]",
        *toml_lines({key: getattr(body, key) for key in (*box, "mass", "com", "inertia")}),
    ]
    for leg in robot.legs:
        lines += ["", f"[legs.{toml_key(leg.name)}]"]
        values: dict[str, Any] = {link.name: link.length for link in leg.links} | {
            "mount": leg.mount_position,
            "yaw": leg.mount_yaw,
            "pitch": leg.mount_pitch,
            "roll": leg.mount_roll,
            "neutral_foot": leg.neutral_foot,
            "femur_bend": leg.femur_bend,
            "tibia_bend": leg.tibia_bend,
        }
        values |= {name: own for name in RATIOS if ((own := getattr(leg, name)) != 1).any()}
        for joint, limits in zip(JOINTS, leg.joint_limits, strict=True):
            values[f"joint_limits.{joint}"] = limits
        for link in leg.links:
            for key in ("mass", "com", "inertia"):
                values[f"links.{link.name}.{key}"] = getattr(link, key)
            if link.lateral_offset:
                values[f"links.{link.name}.lateral_offset"] = link.lateral_offset
        lines += toml_lines(values)
    return "\n".join(lines) + "\n"
