"""The sidecar of a STEP file: a TOML file with links, joints and masses."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
from annotated_types import Gt, Le, Len

from phasmid.cad import Assembly
from phasmid.cad.step import part_paths
from phasmid.errors import InvalidInput
from phasmid.kinematics import joint_angles
from phasmid.robot import JOINTS, Body, Link, Robot, servo_names
from phasmid.robot.file import servo_table
from phasmid.robot.table import Limits, Name, ServoTable, Tensor, Vector
from phasmid.tables import Angle, Density, Mass, Number, Table, in_file, validate
from phasmid.toml import read_toml, toml_key, toml_string

LONGEST_PATTERN = 400
"""Patterns of more characters than this are refused."""

LONGEST_LINK = 200
"""Links and joints of longer names are refused; such names hold that of a leg and more."""

MOST_LINKS = 400
"""More links or joints than this are refused."""

Direction = Annotated[list[Number], Len(3, 3)]
LinkName = Annotated[str, Len(1, LONGEST_LINK)]
Pattern = Annotated[str, Len(1, LONGEST_PATTERN)]


class FrameTable(Table):
    """``[frame]``: the robot in the drawing; without it the drawing has x forward and z up."""

    origin: Vector = [0.0, 0.0, 0.0]
    forward: Direction = [1.0, 0.0, 0.0]
    up: Direction = [0.0, 0.0, 1.0]


class PartTable(Table):
    """``[parts."PATTERN"]``: mass or density of each of these parts."""

    mass: Annotated[Mass, Gt(0)] | None = None
    density: Annotated[Density, Gt(0), Le(30_000)] | None = None


class StepLinkTable(Table):
    """``[links.NAME]``: the parts that move as one, and their total mass.

    Where a centre of mass and an inertia about it are known too, they stand in the drawing's frame.
    """

    parts: Annotated[list[Pattern], Len(1)]
    mass: Annotated[Mass, Gt(0)] | None = None
    com: Vector | None = None
    inertia: Tensor | None = None


class StepJointTable(Table):
    """``[joints.NAME]``: a hinge. Its axis is that of a part's round face, or given."""

    parent: str
    child: str
    axis_of: Pattern | None = None
    point: Vector | None = None
    direction: Direction | None = None
    drawn_at: Angle = 0.0
    limits: Limits = [-math.inf, math.inf]


class FootTable(Table):
    """``[feet.NAME]``: a foot, at a point of the drawing."""

    link: str
    point: Vector


class Sidecar(Table):
    """``NAME.step.toml``."""

    name: Name
    servo: ServoTable | None = None
    density: Annotated[Density, Gt(0), Le(30_000)] | None = None
    frame: FrameTable = FrameTable()
    parts: dict[Pattern, PartTable] = {}
    links: Annotated[dict[LinkName, StepLinkTable], Len(1, MOST_LINKS)]
    joints: Annotated[dict[LinkName, StepJointTable], Len(0, MOST_LINKS)] = {}
    feet: Annotated[dict[LinkName, FootTable], Len(0, MOST_LINKS)] = {}


def sidecar_of(path: Path) -> Path:
    """Return the path of a STEP file's sidecar."""
    return path.with_name(f"{path.name}.toml")


def read_sidecar(path: Path) -> tuple[Sidecar, str]:
    """Return the sidecar of a STEP file, and its text.

    Args:
        path: The STEP file.

    Raises:
        InvalidInput: It is absent, or not well formed.
    """
    file = sidecar_of(path)
    if not file.exists():
        raise InvalidInput(
            f"{path.name} has no {file.name} beside it, which assigns the parts to links.",
            hint=f"phasmid check {path.name} --write-sidecar writes a first guess of it",
        )
    raw, content = read_toml(file)
    return validate(Sidecar, raw, in_file(file, content)), content


def sidecar_text(robot: Robot, assembly: Assembly, *, masses: str = "solids") -> str:
    """Return the sidecar of a robot's own assembly, as `phasmid.cad.write_step` writes it.

    Links and joints are called as in `phasmid.formats.tree_of`; angles are those of Table 1.

    Args:
        robot: The robot.
        assembly: Its solids.
        masses: ``solids`` to have them computed, or ``file`` to keep those of the robot.
    """
    lines = [
        f"# What {_plain(robot.name)} is made of: which part of the drawing belongs to which link,",
        "# what parts weigh, and where the joints' axes are.",
        f"name = {toml_string(robot.name)}",
    ]
    known_servo = robot.servo.name in servo_names()
    lines += (
        [f"servo = {toml_string(robot.servo.name)}"] if known_servo else servo_table(robot.servo)
    )
    keep = masses == "file"
    known = _given(robot.body, assembly.poses["body"]) if keep else []
    paths = part_paths(assembly)
    lines += ["", *_weights(assembly), *_link("base_link", paths["body"], known)]
    for leg in robot.legs:
        for joint, link in zip(JOINTS, leg.links, strict=True):
            known = _given(link, assembly.poses[f"{leg.name}.{joint}"]) if keep else []
            own = paths[f"{leg.name}.{joint}"]
            lines += _link(f"{leg.name}_{joint}_link", own, known)
    for leg in robot.legs:
        q = joint_angles(leg, leg.neutral_foot)
        parent = "base_link"
        for number, joint in enumerate(JOINTS):
            X_drawing_child = assembly.poses[f"{leg.name}.{joint}"]
            child = f"{leg.name}_{joint}_link"
            lines += [
                f"[joints.{toml_key(f'{leg.name}_{joint}')}]",
                f"parent = {toml_string(parent)}",
                f"child = {toml_string(child)}",
                f"axis_of = {toml_string(literal(_axle(assembly, paths, leg.name, joint)))}",
                f"direction = {_row(X_drawing_child[:3, 2])}",
                f"drawn_at_rad = {float(q[number])!r}",
                f"limits_rad = {_row(leg.joint_limits[number])}",
                "",
            ]
            parent = child
        foot = assembly.poses[f"{leg.name}.tibia"] @ np.array([leg.tibia.length, 0, 0, 1])
        lines += [
            f"[feet.{toml_key(f'{leg.name}_foot')}]",
            f"link = {toml_string(parent)}",
            f"point_m = {_row(foot[:3])}",
            "",
        ]
    return "\n".join(lines)


def literal(name: str) -> str:
    """Return a pattern that matches this name only."""
    return re.sub(r"([*?[])", r"[\1]", name)


def _plain(name: str) -> str:
    return "".join(c if c.isprintable() else " " for c in name)


def _row(values: np.ndarray) -> str:
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


def _link(name: str, paths: tuple[str, ...], known: list[str]) -> list[str]:
    """Return a link of all parts of one assembly."""
    pattern = f"{literal(paths[0].rpartition('/')[0])}/*"
    return [f"[links.{toml_key(name)}]", f"parts = [{toml_string(pattern)}]", *known, ""]


def _given(link: Body | Link, X_drawing_link: np.ndarray) -> list[str]:
    """Return the numbers of a robot's file, in the drawing's frame."""
    R = X_drawing_link[:3, :3]
    inertia = ", ".join(_row(row) for row in R @ link.inertia @ R.T)
    return [
        "# As the robot's file has it; without these three lines the solids are weighed.",
        f"mass_kg = {float(link.mass)!r}",
        f"com_m = {_row(R @ link.com + X_drawing_link[:3, 3])}",
        f"inertia_kg_m2 = [{inertia}]",
    ]


def _weights(assembly: Assembly) -> list[str]:
    """Masses and densities by the parts' own names, each once."""
    entries: dict[str, str] = {}
    for parts in assembly.links.values():
        for placed in parts:
            solid = placed.solid
            if solid.mass is None:
                entries[solid.name] = (
                    f"density_kg_m3 = {solid.material.density!r}  # {solid.material.name}"
                )
            else:
                entries[solid.name] = f"mass_kg = {solid.mass!r}"
    return [
        line
        for name, what in entries.items()
        for line in (f"[parts.{toml_key(literal(name))}]", what, "")
    ]


def _axle(assembly: Assembly, paths: Mapping[str, tuple[str, ...]], leg: str, joint: str) -> str:
    """Return the servo on whose horn the joint turns, as a path of the drawing."""
    sought = {
        "coxa": ("body", f"{leg}_servo"),
        "femur": (f"{leg}.femur", "femur_servo"),
        "tibia": (f"{leg}.femur", "knee_servo"),
    }
    link, name = sought[joint]
    for owner in (link, f"{leg}.tibia"):
        for placed, path in zip(assembly.links[owner], paths[owner], strict=True):
            if placed.name == name:
                return path
    raise AssertionError(name)
