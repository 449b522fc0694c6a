"""Robot files: TOML in and out."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge, Len
from pydantic import ConfigDict

from phasmid import tables
from phasmid.errors import InvalidInput, InvalidRobot, located, nearest
from phasmid.robot.leg import JOINTS, Leg
from phasmid.robot.link import Link, check_length
from phasmid.robot.robot import HEXAPOD_LEGS, Body, Robot
from phasmid.robot.servo import Servo
from phasmid.tables import (
    Angle,
    Inertia,
    Length,
    Mass,
    Quantity,
    Rate,
    Table,
    find_file,
    in_file,
    read_toml,
    validate,
)
from phasmid.units import STANDARD_GRAVITY, split_unit

Vector = Annotated[list[Length], Len(3, 3)]
Tensor = dict[str, Inertia] | Annotated[list[Annotated[list[Inertia], Len(3, 3)]], Len(3, 3)]


class RobotPart(Table):
    """A table of a robot file; numbers that are not finite are left to the robot's own words."""

    model_config = ConfigDict(allow_inf_nan=True)


class LinkTable(RobotPart):
    """``[leg.links.coxa]``: what the link weighs and how it resists turning."""

    mass: Mass
    com: Vector
    inertia: Tensor


class LimitsTable(RobotPart):
    """``[leg.joint_limits]``: lowest and highest angle of each joint."""

    coxa: Annotated[list[Angle], Len(2, 2)] = [-math.pi, math.pi]
    femur: Annotated[list[Angle], Len(2, 2)] = [-math.pi, math.pi]
    tibia: Annotated[list[Angle], Len(2, 2)] = [-math.pi, math.pi]


class LinksTable(RobotPart):
    """``[leg.links]``: the three links."""

    coxa: LinkTable
    femur: LinkTable
    tibia: LinkTable


class LegTable(RobotPart):
    """``[legs.NAME]`` merged over ``[leg]``, which holds what all legs share."""

    coxa: Length
    femur: Length
    tibia: Length
    mount: Vector
    yaw: Angle
    neutral_foot: Vector | None = None
    home: Annotated[list[Angle], Len(3, 3)] | None = None
    femur_bend: Angle = 0.0
    tibia_bend: Angle = 0.0
    joint_limits: LimitsTable = LimitsTable()
    links: LinksTable


class BodyTable(RobotPart):
    """``[body]``: the trunk; without an inertia it is a solid box of its size."""

    size: Vector
    mass: Mass | None = None
    com: Vector = [0.0, 0.0, 0.0]
    inertia: Tensor | None = None


class ServoTable(RobotPart):
    """``[servo]``: data-sheet numbers, in SI unless the key says otherwise."""

    name: str
    stall_torque: float
    no_load_speed: Rate
    stiffness: float
    damping: float = 0.0
    armature: float = 0.0
    friction: float = 0.0


class RobotTable(RobotPart):
    """A robot file."""

    name: str
    description: str = ""
    leg_count: Annotated[int, Ge(4)] = 6
    total_weight: Annotated[float, Quantity("n")] | None = None
    servo: str | ServoTable
    body: BodyTable
    legs: dict[str, LegTable]


def preset_names() -> tuple[str, ...]:
    """Names of the robots that come with phasmid."""
    return tables.preset_names("phasmid.robot")


def servo_names() -> tuple[str, ...]:
    """Names of the servos that a robot file can name."""
    return tuple(_servos())


def _servos() -> dict[str, Any]:
    path = Path(str(resources.files("phasmid.robot") / "servos.toml"))
    return read_toml(path)[0]


def load_robot(source: str | Path) -> Robot:
    """Load a robot from a preset or a file.

    Args:
        source: Name of a preset, such as ``phantomx-paper``, or path of a ``.toml`` file.

    Raises:
        InvalidInput: There is no such preset or file, or it is not well formed.
        InvalidRobot: No machine could have these numbers.
    """
    path = find_file(source, "phasmid.robot", "robot")
    raw, content = read_toml(path)
    return robot_from_table(raw, path, content)


def robot_from_table(raw: dict[str, Any], path: Path, content: str) -> Robot:
    """Build a robot from the table of its file.

    Args:
        raw: The table.
        path: Its file, for messages.
        content: The file's text, for line numbers.

    Raises:
        InvalidInput: The table is not well formed.
        InvalidRobot: No machine could have these numbers.
    """
    locate = in_file(path, content)
    table = validate(RobotTable, _merged(raw, path), locate)
    names = _ordered_names(tuple(table.legs), table.leg_count, path)
    with located(path.name):
        servo = _servo(table.servo, locate)
        legs = []
        for name in names:
            with located(locate(("legs", name))[1]):
                legs.append(_leg(name, table.legs[name]))
        body = _body(table, sum(link.mass for leg in legs for link in leg.links))
        return Robot(table.name, body, tuple(legs), servo, table.description)


def _merged(raw: dict[str, Any], path: Path) -> dict[str, Any]:
    """The file's table with ``[leg]`` spread over every leg."""
    raw = dict(raw)
    shared = raw.pop("leg", {})
    legs = raw.get("legs", {})
    if not isinstance(shared, Mapping) or not isinstance(legs, Mapping):
        raise InvalidInput("leg and legs must be tables.", where=path.name)
    own_or_shared = {}
    for name, own in legs.items():
        if not isinstance(own, Mapping):
            raise InvalidInput(f"legs.{name} must be a table.", where=path.name)
        own_or_shared[name] = _overlay(shared, own)
    raw["legs"] = own_or_shared
    return raw


def _overlay(shared: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """One table over another; a key replaces the shared one of any unit."""
    merged = {k: v for k, v in shared.items() if _bare(k) not in {_bare(o) for o in own}}
    for key, value in own.items():
        under = shared.get(key)
        if isinstance(value, Mapping) and isinstance(under, Mapping):
            value = _overlay(under, value)
        merged[key] = value
    if {_bare(k) for k in own} & {"neutral_foot", "home"}:
        drop = {"neutral_foot", "home"} - {_bare(k) for k in own}
        merged = {k: v for k, v in merged.items() if _bare(k) not in drop}
    return merged


def _bare(key: str) -> str:
    return split_unit(key)[0]


def _ordered_names(names: tuple[str, ...], count: int, path: Path) -> tuple[str, ...]:
    if len(names) == count:
        if set(names) == set(HEXAPOD_LEGS):
            return HEXAPOD_LEGS
        return names
    missing = [n for n in HEXAPOD_LEGS if n not in names]
    if count == 6 and missing and set(names) <= set(HEXAPOD_LEGS):
        raise InvalidRobot(
            f"robot: {len(names)} legs given; a hexapod has 6. Missing: {', '.join(missing)}.",
            where=path.name,
            hint=f"leg_count = {len(names)}, if it is no hexapod" if len(names) >= 4 else "",
        )
    raise InvalidRobot(
        f"robot: {len(names)} legs given; leg_count says {count}.",
        where=path.name,
        hint=f"leg_count = {len(names)}",
    )


def _servo(servo: str | ServoTable, locate: Any) -> Servo:
    if isinstance(servo, str):
        known = _servos()
        if servo not in known:
            guess = nearest(servo, known)
            raise InvalidInput(
                f'no servo called "{servo}".',
                where=locate(("servo",))[1],
                hint=f'"{guess}"' if guess else f"one of {', '.join(known)}",
            )
        servo = ServoTable.model_validate({"name": servo} | known[servo])
    return Servo(**servo.model_dump())


def _tensor(tensor: dict[str, float] | list[list[float]], what: str) -> np.ndarray:
    if isinstance(tensor, list):
        return np.array(tensor)
    needed = {"xx", "yy", "zz"}
    known = {*needed, "xy", "xz", "yz"}
    for key in tensor:
        if key not in known:
            raise InvalidInput(f'unknown key "{key}" in {what}.inertia.', hint=", ".join(known))
    if not needed <= set(tensor):
        raise InvalidInput(f"{what}.inertia must have xx, yy and zz; xy, xz and yz may follow.")
    xy, xz, yz = (tensor.get(k, 0.0) for k in ("xy", "xz", "yz"))
    return np.array(
        [[tensor["xx"], xy, xz], [xy, tensor["yy"], yz], [xz, yz, tensor["zz"]]],
    )


def _leg(name: str, table: LegTable) -> Leg:
    links = {}
    for joint in JOINTS:
        link: LinkTable = getattr(table.links, joint)
        length = getattr(table, joint)
        # Before the link, which would not name its leg.
        check_length(length, f"leg {name}: {joint}", joint)
        inertia = _tensor(link.inertia, f"links.{joint}")
        links[joint] = Link(joint, length, link.mass, np.array(link.com), inertia)
    limits = np.array([getattr(table.joint_limits, joint) for joint in JOINTS])
    foot = table.neutral_foot
    if (foot is None) == (table.home is None):
        raise InvalidInput(f"legs.{name} must have either neutral_foot_mm or home_deg.")
    if table.home is not None:
        foot = _foot_at_home(name, table, limits)
    return Leg(
        name,
        **links,
        mount_position=np.array(table.mount),
        mount_yaw=table.yaw,
        neutral_foot=np.array(foot),
        joint_limits=limits,
        femur_bend=table.femur_bend,
        tibia_bend=table.tibia_bend,
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
    return [r * math.cos(q1), r * math.sin(q1), z]


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
    if body.inertia is None:
        a, b, c = (s * s for s in body.size)
        inertia = np.diag([b + c, a + c, a + b]) * mass / 12
    else:
        inertia = _tensor(body.inertia, "body")
    return Body(mass, np.array(body.com), inertia, np.array(body.size))


def robot_to_toml(robot: Robot) -> str:
    """A robot as the text of a file that loads to exactly the same numbers.

    Keys carry no units: all numbers are SI and radians, so that none is rounded.
    """
    s = robot.servo
    lines = [
        "# Lengths in m, masses in kg, inertias in kg m^2, angles in rad, torques in N m.",
        f"name = {_quoted(robot.name)}",
        f"description = {_quoted(robot.description)}",
        f"leg_count = {len(robot.legs)}",
        "",
        "[servo]",
        f"name = {_quoted(s.name)}",
    ]
    numbers = ("stall_torque", "no_load_speed", "stiffness", "damping", "armature", "friction")
    lines += [f"{key} = {float(getattr(s, key))!r}" for key in numbers]
    body = robot.body
    lines += ["", "[body]", f"size = {_row(body.size)}", f"mass = {float(body.mass)!r}"]
    lines += [f"com = {_row(body.com)}", f"inertia = [{', '.join(map(_row, body.inertia))}]"]
    for leg in robot.legs:
        lines += ["", f"[legs.{_key(leg.name)}]"]
        lines += [f"{link.name} = {float(link.length)!r}" for link in leg.links]
        lines += [
            f"mount = {_row(leg.mount_position)}",
            f"yaw = {float(leg.mount_yaw)!r}",
            f"neutral_foot = {_row(leg.neutral_foot)}",
            f"femur_bend = {float(leg.femur_bend)!r}",
            f"tibia_bend = {float(leg.tibia_bend)!r}",
        ]
        for joint, limits in zip(JOINTS, leg.joint_limits, strict=True):
            lines.append(f"joint_limits.{joint} = {_row(limits)}")
        for link in leg.links:
            lines += [
                f"links.{link.name}.mass = {float(link.mass)!r}",
                f"links.{link.name}.com = {_row(link.com)}",
                f"links.{link.name}.inertia = [{', '.join(map(_row, link.inertia))}]",
            ]
    return "\n".join(lines) + "\n"


def _row(values: np.ndarray) -> str:
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


def _quoted(text: str) -> str:
    # JSON's escapes are a subset of those of TOML's basic strings.
    return json.dumps(text)


def _key(name: str) -> str:
    return name if name.replace("_", "").replace("-", "").isalnum() else _quoted(name)
