"""STEP files out: a robot's solids with their sidecar, and a first guess of a sidecar.

`cad_files` adds meshes and a table of masses.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from phasmid.cad import Assembly, build, meshes
from phasmid.cad.drawing import Cylinder, DrawnPart, read_drawing
from phasmid.cad.step import group_paths, step_text, unique
from phasmid.cad.weights import mass_table
from phasmid.formats.meshes import stl
from phasmid.formats.step_in import sidecar_of
from phasmid.kinematics import joint_angles
from phasmid.robot import JOINTS, Body, Link, Robot, servo_names
from phasmid.robot.file import servo_table
from phasmid.robot.glb import glb
from phasmid.toml import toml_key, toml_string

WORDS = {
    "coxa": ("coxa", "hip", "shoulder"),
    "femur": ("femur", "thigh", "upper_leg"),
    "tibia": ("tibia", "shin", "calf", "shank", "lower_leg"),
}
"""Common names of the links of a leg."""

TRUNK = "body"
NEAR = 5e-5
"""Axes of two parts closer than this are one [m]."""

FARTHEST = 0.1
"""Faces of one hinge lie no farther apart along its axis than this [m]."""

TIP = 5e-5
"""Corners within this of the farthest one are a link's tip [m]."""

PLASTIC = 1200.0
"""Assumed density of parts without one [kg/m³]."""


def cad_files(robot: Robot, folder: Path) -> dict[Path, tuple[str, bytes]]:
    """Draw a robot; return its STEP file, sidecar, meshes and table of masses.

    Args:
        robot: The robot.
        folder: Where the files will be.

    Returns:
        By the path of the file, its description in a few words and its content.

    Raises:
        PhasmidError: build123d is not installed.
    """
    name = _file_name(robot.name)
    step = folder / f"{name}.step"
    assembly = build(robot)
    looks = meshes(assembly)
    table = f"# {robot.name}: masses\n\n{mass_table(robot, assembly)}"
    files = {
        step: ("assembly of named, coloured solids", step_text(assembly)),
        sidecar_of(step): (
            "which part belongs to which link, axes, densities",
            sidecar_text(robot, assembly).encode(),
        ),
        folder / f"{name}.glb": (
            "meshes of all links; name it as appearance in the robot's file",
            glb(looks),
        ),
        folder / f"{name}-masses.md": (
            "the file's masses beside those of the solids",
            table.encode(),
        ),
    }
    taken: set[str] = set()
    for link, parts in looks.items():
        own = unique(_file_name(link).casefold(), taken)
        files[folder / "stl" / f"{own}.stl"] = (f"mesh of {link}, in metres", stl(*parts))
    return files


def step_files(robot: Robot, name: str) -> dict[str, bytes]:
    """Return a robot as a STEP file and its sidecar, which keeps the robot's own masses.

    Args:
        robot: The robot.
        name: Of the STEP file.

    Returns:
        The two files' contents, by their names.

    Raises:
        PhasmidError: build123d is not installed.
    """
    assembly = build(robot)
    text = sidecar_text(robot, assembly, masses="file")
    return {name: step_text(assembly), sidecar_of(Path(name)).name: text.encode()}


def _file_name(name: str) -> str:
    """Return a name as a file name that all systems accept."""
    plain = "".join(c if c.isalnum() or c in "-_." else "_" for c in name)
    return plain.strip(".") or "robot"


def sidecar_text(robot: Robot, assembly: Assembly, *, masses: str = "solids") -> str:
    """Return the sidecar of a robot's own assembly.

    Links and joints are called as in `tree_of`; angles are those of Table 1.

    Args:
        robot: The robot.
        assembly: Its solids.
        masses: ``solids`` to have them computed, or ``file`` to keep those of the robot.
    """
    poses = assembly.poses
    known = robot.servo.name in servo_names()
    lines = [
        f"# What {_plain(robot.name)} is made of: which part of the drawing belongs to which link,",
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
        place = f"point_m = {_row(foot[:3])}"
        lines += _table("feet", f"{leg.name}_foot", f"link = {toml_string(parent)}", place)
    return "\n".join(lines)


def _literal(name: str) -> str:
    """Return a pattern that matches this name only."""
    return re.sub(r"([*?[])", r"[\1]", name)


def _table(kind: str, name: str, *lines: str) -> list[str]:
    return [f"[{kind}.{toml_key(name)}]", *lines, ""]


def _plain(name: str) -> str:
    return "".join(c if c.isprintable() else " " for c in name)


def _row(values: np.ndarray) -> str:
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


def _rounded(values: np.ndarray) -> str:
    return _row(np.round(values, 9) + 0.0)


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


def first_guess(path: Path) -> str:
    """Return a sidecar's text, from names and from round faces that two links share.

    Parts of assemblies whose names hold such words as coxa, femur and tibia form legs, all others
    the trunk. A hinge is where a round face of one link and one of the next have the same axis; a
    foot is the point of the last link farthest from its hinge. Missing data stands as a
    comment with instructions.

    Args:
        path: The STEP file.

    Raises:
        InvalidInput: It cannot be read.
        PhasmidError: build123d is not installed.
    """
    parts = read_drawing(path)
    found = [_link_of(part.path) for part in parts]
    joints: dict[str, set[str]] = {}
    for leg, joint, _ in found:
        joints.setdefault(leg, set()).add(joint)
    legs = [leg for leg, own in joints.items() if own >= set(JOINTS)]
    links: dict[str, list[DrawnPart]] = {}
    patterns: dict[str, dict[str, None]] = {}
    for part, (leg, joint, pattern) in zip(parts, found, strict=True):
        name = f"{leg}_{joint}" if leg in legs else TRUNK
        links.setdefault(name, []).append(part)
        patterns.setdefault(name, {})[pattern] = None
    # The first link whose pattern fits has the part: what is left is the trunk's.
    links[TRUNK], patterns[TRUNK] = links.pop(TRUNK, []), {"*": None}
    lines = [
        f"# A first guess for {_plain(path.name)}: {len(parts)} parts, {len(legs)} legs. "
        "Correct it where it is wrong.",
        f"name = {toml_string(_plain(path.stem)[:64] or 'robot')}",
        '# servo = "AX-12A"',
        f"density_kg_m3 = {PLASTIC:g}  # a guess, for all parts without a density of their own",
        "",
    ]
    for name, group in links.items():
        shown = ", ".join(part.path for part in group[:3]) + (", …" if len(group) > 3 else "")
        head, *rest = _table(
            "links",
            name,
            f"parts = [{', '.join(map(toml_string, patterns[name]))}]",
            "# mass_g = ...  # as weighed, in place of what its parts' densities give",
        )
        lines += [f"{head}  # {_plain(shown) or 'no part'}", *rest]
    for leg in legs:
        parent = TRUNK
        for joint in JOINTS:
            name = f"{leg}_{joint}"
            axis = _shared_axis(links[parent], links[name])
            lines += _joint(parent, name, axis)
            parent = name
        lines += _foot(f"{leg}_foot", parent, links[parent], axis)
    return "\n".join(lines)


def _link_of(path: str) -> tuple[str, str, str]:
    """Return leg, joint and pattern of a part's path; empty for the trunk's parts."""
    names = path.split("/")
    for depth, name in enumerate(names):
        for joint, words in WORDS.items():
            found = next((word for word in words if word in name.lower()), None)
            if found is None:
                continue
            # A name that also holds the words of a part, such as hip_bracket, decides nothing
            # where an assembly above it or below has decided.
            rest = re.sub(found, "", name, flags=re.IGNORECASE).strip("_-. ")
            held = depth < len(names) - 1
            above = "_".join(names[:depth])
            leg = "_".join(filter(None, (above, rest))) if not above or not held else above
            pattern = "/".join(_literal(n) for n in names[: depth + 1])
            return leg or "leg", joint, f"{pattern}/*" if held else pattern
    return "", "", ""


Axis = tuple[DrawnPart, Cylinder]
"""A round face in the drawing's frame, with its part."""


def _joint(parent: str, child: str, axis: Axis | None) -> list[str]:
    if axis is None:
        found = [
            "# No round face is shared by the two links: give the axis.",
            "# point_mm = [0, 0, 0]",
            "# direction = [0, 0, 1]",
        ]
    else:
        part, face = axis
        found = [
            f"# of {_plain(part.path)}, radius {1000 * face.radius:.4g} mm",
            f"point_m = {_rounded(face.point)}",
            f"direction = {_rounded(face.direction)}",
        ]
    ends = (f"parent = {toml_string(parent)}", f"child = {toml_string(child)}")
    return _table("joints", child, *ends, *found, "# limits_deg = [-90, 90]")


def _shared_axis(one: Iterable[DrawnPart], other: Iterable[DrawnPart]) -> Axis | None:
    """Return the axis that round faces of two links share; the widest face's, if several do."""
    mine = [(part, face) for part in one for face in part.cylinders]
    theirs = [face for part in other for face in part.cylinders]
    points = np.reshape([face.point for face in theirs], (-1, 3))
    directions = np.reshape([face.direction for face in theirs], (-1, 3))
    widest, best = 0.0, None
    for part, face in mine:
        across = points - face.point
        along = across @ face.direction
        off = np.linalg.norm(across - along[:, None] * face.direction, axis=1)
        turned = np.linalg.norm(np.cross(directions, face.direction), axis=1)
        for number in np.flatnonzero((off < NEAR) & (turned < 1e-4) & (np.abs(along) < FARTHEST)):
            radius = min(face.radius, theirs[number].radius)
            if radius > widest:
                widest, best = radius, (part, face)
    return best


def _foot(name: str, link: str, parts: Iterable[DrawnPart], axis: Axis | None) -> list[str]:
    """Take the corners of a link's triangles that lie farthest from its hinge, in the mean."""
    looks = [part.look.vertices for part in parts if part.look is not None]
    place = "# point_mm = [0, 0, 0]  # where it touches the ground, in the drawing"
    if looks and axis is not None:
        points, face = np.concatenate(looks), axis[1]
        distance = np.linalg.norm(np.cross(points - face.point, face.direction), axis=1)
        tip = points[distance > distance.max() - TIP].mean(axis=0)
        place = f"point_m = {_rounded(tip)}  # the farthest corner of its parts"
    return _table("feet", name, f"link = {toml_string(link)}", place)
