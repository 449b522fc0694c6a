"""STEP files out: a robot's solids with their sidecar; `cad_files` adds meshes."""

from __future__ import annotations

import copy
import re
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.errors import plain
from phasmid.formats.solids import Assembly, build, meshes
from phasmid.formats.solids.assembly import build123d, location, unique
from phasmid.formats.step_in import sidecar_of
from phasmid.kinematics import joint_angles
from phasmid.robot import JOINTS, Body, Link, Robot
from phasmid.robot.glb import glb
from phasmid.servo import servo_names
from phasmid.servo.catalogue import servo_table
from phasmid.toml import toml_key, toml_string


def cad_files(robot: Robot, folder: Path) -> dict[Path, tuple[str, bytes]]:
    """Draw a robot; return its STEP file, sidecar and meshes.

    Returns:
        By the path of the file in the folder, its description in a few words and its content.

    Raises:
        PhasmidError: build123d is not installed.
    """
    name = "".join(c if c.isalnum() or c in "-_." else "_" for c in robot.name).strip(".")
    name = name or "robot"
    step = folder / f"{name}.step"
    assembly = build(robot)
    return {
        step: ("assembly of named, coloured solids", step_text(assembly)),
        sidecar_of(step): (
            "which part belongs to which link, axes, densities",
            sidecar_text(robot, assembly).encode(),
        ),
        folder / f"{name}.glb": (
            "meshes of all links; name it as appearance in the robot's file",
            glb(meshes(assembly)),
        ),
    }


def step_files(robot: Robot, name: str) -> dict[str, bytes]:
    """Return a STEP file and its sidecar, which keeps the robot's own masses, by their names."""
    assembly = build(robot)
    text = sidecar_text(robot, assembly, masses="file")
    return {name: step_text(assembly), sidecar_of(Path(name)).name: text.encode()}


def step_text(assembly: Assembly) -> bytes:
    """Write an assembly as STEP: the robot, its ``body`` and legs, their links, and their parts.

    Each distinct part is written once and placed as often as it is needed.
    """
    b = build123d()
    groups: dict[str, list[Any]] = {}
    for link, path in group_paths(assembly).items():
        parts = []
        for placed in assembly.links[link]:
            # A shallow copy shares the solid.
            part = copy.copy(placed.solid.shape)
            part.label, part.color = placed.solid.name, b.Color(*placed.solid.material.color)
            parts.append(part.move(location(placed.X_link_part)))
        leg, _, joint = path.rpartition("/")
        group = b.Compound(label=joint, children=parts).move(location(assembly.poses[link]))
        groups.setdefault(leg, []).append(group)
    trunk = groups.pop("")
    legs = [b.Compound(label=leg, children=links) for leg, links in groups.items()]
    file = BytesIO()
    b.export_step(b.Compound(label=_plain_name(assembly.name), children=[*trunk, *legs]), file)
    return file.getvalue()


def group_paths(assembly: Assembly) -> dict[str, str]:
    """Return the path in the STEP file of each link's parts, such as ``right_front/coxa``."""
    taken = {"body"}
    legs: dict[str, str] = {}
    for link in assembly.links:
        leg = link.rpartition(".")[0]
        if leg and leg not in legs:
            legs[leg] = unique(_plain_name(leg), taken)
    split = {link: link.rpartition(".") for link in assembly.links}
    return {
        link: f"{legs[leg]}/{joint}" if leg else joint for link, (leg, _, joint) in split.items()
    }


def _plain_name(name: str) -> str:
    """Return a name in letters that every reader of STEP files knows."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", name)


def sidecar_text(robot: Robot, assembly: Assembly, *, masses: str = "solids") -> str:
    """Return the sidecar of a robot's own assembly.

    Links and joints are called as in `tree_of`; angles are those of Table 1. Masses are computed
    of the ``solids``, or kept of the robot's ``file``.
    """
    poses = assembly.poses
    known = robot.servo.name in servo_names()
    lines = [
        f"# What {plain(robot.name)} is made of: which part of the drawing belongs to which link,",
        "# what parts weigh, and where the joints' axes are.",
        f"name = {toml_string(robot.name)}",
        *([f"servo = {toml_string(robot.servo.name)}"] if known else servo_table(robot.servo)),
        "",
    ]
    # Each part once, by its own name.
    solids = {p.solid.name: p.solid for parts in assembly.links.values() for p in parts}
    for name, solid in solids.items():
        density = f"density_kg_m3 = {solid.material.density!r}  # {solid.material.name}"
        mass = density if solid.mass is None else f"mass_kg = {solid.mass!r}"
        lines += _table("parts", name, mass)
    links: dict[str, Body | Link] = {"body": robot.body}
    links |= {f"{leg.name}.{link.name}": link for leg in robot.legs for link in leg.links}
    for group, path in group_paths(assembly).items():
        name = "base_link" if group == "body" else f"{group.replace('.', '_')}_link"
        given = _given(links[group], poses[group]) if masses == "file" else []
        lines += _table("links", name, f"parts = [{toml_string(f'{path}/*')}]", *given)
    for leg in robot.legs:
        q = joint_angles(leg, leg.neutral_foot)
        parent = "base_link"
        for number, joint in enumerate(JOINTS):
            child, X = f"{leg.name}_{joint}_link", poses[f"{leg.name}.{joint}"]
            lines += _table(
                "joints",
                f"{leg.name}_{joint}",
                f"parent = {toml_string(parent)}",
                f"child = {toml_string(child)}",
                f"point_m = {_row(X[:3, 3])}",
                f"direction = {_row(X[:3, 2])}",
                f"drawn_at_rad = {float(q[number])!r}",
                f"limits_rad = {_row(leg.joint_limits[number])}",
            )
            parent = child
        foot = poses[f"{leg.name}.tibia"] @ np.array([leg.tibia.length, 0, 0, 1])
        place = [f"link = {toml_string(parent)}", f"point_m = {_row(foot[:3])}"]
        if robot.foot_radius:
            place.append(f"radius_m = {robot.foot_radius!r}")
        lines += _table("feet", f"{leg.name}_foot", *place)
    return "\n".join(lines)


def _table(kind: str, name: str, *lines: str) -> list[str]:
    return [f"[{kind}.{toml_key(name)}]", *lines, ""]


def _row(values: np.ndarray) -> str:
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


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
