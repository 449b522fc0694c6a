"""STEP files in: solids and a sidecar become a kinematic tree with computed inertias."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
from jaxtyping import Float

from phasmid.cad.drawing import Cylinder, DrawnPart, read_drawing
from phasmid.errors import InvalidInput, located, nearest
from phasmid.formats.findings import Findings
from phasmid.formats.options import ImportOptions
from phasmid.formats.solids import step_files
from phasmid.formats.step_guess import first_guess
from phasmid.formats.step_sidecar import (
    FrameTable,
    PartTable,
    Sidecar,
    StepJointTable,
    StepLinkTable,
    read_sidecar,
    sidecar_of,
)
from phasmid.formats.tree import Tree, TreeJoint, TreeLink, inverse
from phasmid.robot import Part, Servo
from phasmid.robot.inertial import Inertial, merged
from phasmid.tables import Locator, in_file

__all__ = ["axis_of", "first_guess", "read_step", "sidecar_of", "step_files", "tree_of_parts"]

COAXIAL = 1e-6
"""Axes closer than this are one [m]."""


def read_step(path: Path, options: ImportOptions | None = None) -> Tree:
    """The kinematic tree of a STEP file and the sidecar beside it.

    Masses, centres of mass and inertias are those of the solids, at the sidecar's densities or
    scaled to its weighed masses. Each child's frame lies on its joint's axis, which is its z.

    Args:
        path: The STEP file; ``NAME.step.toml`` stands beside it.
        options: Data that the user adds to the file.

    Raises:
        InvalidInput: A file cannot be read, or the sidecar does not fit the drawing.
        InvalidRobot: The links and joints form no tree.
        PhasmidError: build123d is not installed.
    """
    options = options or ImportOptions()
    sidecar, content = read_sidecar(path)
    servo = Servo(**sidecar.servo.model_dump()) if sidecar.servo else None
    parts = read_drawing(path)
    return tree_of_parts(path, sidecar, content, parts, servo, strict=options.strict)


def tree_of_parts(
    path: Path,
    sidecar: Sidecar,
    content: str,
    parts: tuple[DrawnPart, ...],
    servo: Servo | None,
    *,
    strict: bool = False,
) -> Tree:
    """The tree that a sidecar makes of a drawing's parts.

    Args:
        path: The STEP file, for messages.
        sidecar: Links, joints and masses of the parts.
        content: The sidecar's text, for line numbers.
        parts: The drawing.
        servo: The motor of all joints.
        strict: Whether parts of no link are an error.

    Raises:
        InvalidInput: The sidecar does not fit the drawing.
        InvalidRobot: The links and joints form no tree.
    """
    locate = in_file(sidecar_of(path), content)
    findings = Findings()
    groups = _groups(sidecar, parts, locate, findings, strict=strict)
    poses = _frames(sidecar, parts, locate)
    links = {}
    for name in sidecar.links:
        where = locate(("links", name))[1]
        with located(where):
            mass = _mass(sidecar, name, groups[name], poses[name], findings)
        looks = tuple(_look(part, poses[name]) for part in groups[name] if part.look is not None)
        links[name] = TreeLink(name, mass, looks, where)
    joints = [
        _joint(name, table, poses, servo, locate(("joints", name))[1])
        for name, table in sidecar.joints.items()
    ]
    for name, foot in sidecar.feet.items():
        where = locate(("feet", name))[1]
        if foot.link not in links:
            raise _no_link(f"feet.{name}.link", foot.link, links, where)
        if name in links:
            raise InvalidInput(f"feet.{name} is called as a link is.", where=where)
        links[name] = TreeLink(name, where=where)
        X = np.eye(4)
        X[:3, 3] = (inverse(poses[foot.link]) @ np.array([*foot.point, 1.0]))[:3]
        joints.append(TreeJoint(f"{name}_joint", "fixed", foot.link, name, X, where=where))
    return Tree(sidecar.name, links, tuple(joints), path.name, tuple(findings), servo)


def _groups(
    sidecar: Sidecar,
    parts: tuple[DrawnPart, ...],
    locate: Locator,
    findings: Findings,
    *,
    strict: bool,
) -> dict[str, list[DrawnPart]]:
    """Return the parts by link; a part belongs to the first link with a pattern for its path."""
    groups: dict[str, list[DrawnPart]] = {name: [] for name in sidecar.links}
    lost = []
    used = set()
    for part in parts:
        for name, table in sidecar.links.items():
            pattern = next((p for p in table.parts if fnmatchcase(part.path, p)), None)
            if pattern is not None:
                groups[name].append(part)
                used.add((name, pattern))
                break
        else:
            lost.append(part.path)
    for name, table in sidecar.links.items():
        for pattern in table.parts:
            if (name, pattern) not in used and not groups[name]:
                raise InvalidInput(
                    f'links.{name}: no part of the drawing is called "{pattern}".',
                    where=locate(("links", name, "parts"))[1],
                    hint=_nearest_path(pattern, parts),
                )
    if lost:
        shown = ", ".join(lost[:4]) + (", …" if len(lost) > 4 else "")
        what = f"{len(lost)} of {len(parts)} parts belong to no link and were left out: {shown}."
        if strict:
            raise InvalidInput(what, where=locate(("links",))[1])
        findings.suspect("parts", what, hint='parts = ["*"] in a link')
    return groups


def _nearest_path(pattern: str, parts: tuple[DrawnPart, ...]) -> str:
    paths = [part.path for part in parts]
    return nearest(pattern, paths) or f"such as {paths[0]}"


def _no_link(what: str, name: str, links: Mapping[str, object], where: str) -> InvalidInput:
    guess = nearest(name, tuple(links))
    return InvalidInput(
        f'{what} names "{name}", which is no link.',
        where=where,
        hint=f'"{guess}"' if guess else f"links are {', '.join(list(links)[:6])}",
    )


def _mass(
    sidecar: Sidecar,
    name: str,
    parts: list[DrawnPart],
    X_drawing_link: Float[np.ndarray, "4 4"],
    findings: Findings,
) -> Inertial | None:
    """Mass of a link's parts in its frame; None where none of them encloses anything."""
    table = sidecar.links[name]
    X_link_drawing = inverse(X_drawing_link)
    if table.com is not None or table.inertia is not None:
        return _given(name, table, X_link_drawing)
    weighed = table.mass
    masses = []
    for part in parts:
        if part.solid is None:
            what = "is a surface that encloses nothing; it has no mass."
            findings.suspect(f"part {part.path}", what)
            continue
        scale = _density(sidecar, part, known=weighed is not None)
        masses.append(part.solid.scaled(scale).at(X_link_drawing @ part.X_drawing_part))
    whole = merged(masses)
    if whole is None or weighed is None:
        return whole
    return whole.scaled(weighed / whole.mass)


def _given(name: str, table: StepLinkTable, X_link_drawing: np.ndarray) -> Inertial:
    if table.mass is None or table.com is None or table.inertia is None:
        raise InvalidInput(f"links.{name} must have all of mass, com and inertia, or mass alone.")
    return Inertial(table.mass, np.array(table.com), np.array(table.inertia)).at(X_link_drawing)


def _density(sidecar: Sidecar, part: DrawnPart, *, known: bool) -> float:
    """Density of a part [kg/m³]; the first pattern that fits its path or its own name counts.

    Where the link as a whole was weighed, parts without a density all have the same.
    """
    for pattern, table in sidecar.parts.items():
        if fnmatchcase(part.path, pattern) or fnmatchcase(part.product, pattern):
            return _density_said(pattern, table, part)
    if sidecar.density is not None:
        return sidecar.density
    if known:
        return 1000.0
    raise InvalidInput(
        f"part {part.path} has neither a mass nor a density.",
        hint=f'[parts."{part.product or part.path}"] with mass_g or density_kg_m3, '
        "or density_kg_m3 for all parts",
    )


def _density_said(pattern: str, table: PartTable, part: DrawnPart) -> float:
    if (table.mass is None) == (table.density is None):
        raise InvalidInput(f'parts."{pattern}" must have either mass_g or density_kg_m3.')
    if table.mass is not None:
        return table.mass / part.volume
    assert table.density is not None
    return table.density


def _frames(
    sidecar: Sidecar, parts: tuple[DrawnPart, ...], locate: Locator
) -> dict[str, np.ndarray]:
    """Pose of each link's frame in the drawing."""
    with located(locate(("frame",))[1]):
        root = _root_frame(sidecar.frame)
    poses = {}
    for name, joint in sidecar.joints.items():
        where = locate(("joints", name))[1]
        for end in ("parent", "child"):
            link = getattr(joint, end)
            if link not in sidecar.links:
                raise _no_link(f"joints.{name}.{end}", link, sidecar.links, where)
        with located(where):
            point, direction = axis_of(name, joint, parts)
        poses[joint.child] = _frame(point, direction)
    return {name: poses.get(name, root) for name in sidecar.links}


def _root_frame(table: FrameTable) -> np.ndarray:
    z, x = np.array(table.up, dtype=float), np.array(table.forward, dtype=float)
    if np.linalg.norm(z) < 1e-9 or np.linalg.norm(np.cross(z, x)) < 1e-9 * np.linalg.norm(x):
        raise InvalidInput("frame: forward and up must be two directions across each other.")
    z = z / np.linalg.norm(z)
    x = x - (x @ z) * z
    if np.linalg.norm(x) < 1e-9:
        raise InvalidInput("frame: forward and up must be two directions across each other.")
    x /= np.linalg.norm(x)
    X = np.eye(4)
    X[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    X[:3, 3] = table.origin
    return X


def axis_of(
    name: str, joint: StepJointTable, parts: tuple[DrawnPart, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """A point of a joint's axis and its direction, in the drawing [m].

    Raises:
        InvalidInput: The sidecar names no such part or face, or gives no axis.
    """
    if joint.axis_of is None:
        if joint.point is None or joint.direction is None:
            raise InvalidInput(
                f"joints.{name} must have axis_of, or point_mm and direction.",
                hint='axis_of = "body/servo" takes the axis of that part\'s largest round face',
            )
        return np.array(joint.point), _unit(name, joint.direction)
    if joint.point is not None:
        raise InvalidInput(f"joints.{name} has both axis_of and point; one must go.")
    found = [part for part in parts if fnmatchcase(part.path, joint.axis_of)]
    if len(found) != 1:
        count = "no part" if not found else f"{len(found)} parts"
        raise InvalidInput(
            f'joints.{name}: {count} of the drawing are called "{joint.axis_of}"; '
            "its axis must be that of one."
            if found
            else f'joints.{name}: no part of the drawing is called "{joint.axis_of}".',
            hint=_nearest_path(joint.axis_of, parts),
        )
    part = found[0]
    cylinder = _hinge_face(name, part)
    X = part.X_drawing_part
    point = X[:3, :3] @ cylinder.point + X[:3, 3]
    direction = X[:3, :3] @ cylinder.direction
    direction /= np.linalg.norm(direction)
    if joint.direction is not None:
        asked = _unit(name, joint.direction)
        if abs(asked @ direction) < math.cos(math.radians(45)):
            raise InvalidInput(
                f"joints.{name}: direction lies across the axis of {part.path}; "
                "it gives the sense of the axis."
            )
        direction *= np.sign(asked @ direction)
    # The point of the axis nearest to the part's middle.
    middle = X[:3, 3] if part.solid is None else X[:3, :3] @ part.solid.com + X[:3, 3]
    return point + ((middle - point) @ direction) * direction, direction


def _unit(name: str, direction: list[float]) -> np.ndarray:
    v = np.array(direction, dtype=float)
    length = float(np.linalg.norm(v))
    if not 1e-9 < length < 1e9:
        raise InvalidInput(f"joints.{name}: direction must be a vector of some length.")
    return v / length


def _hinge_face(name: str, part: DrawnPart) -> Cylinder:
    """Return the largest of all round faces about one axis."""
    faces = part.cylinders
    if not faces:
        raise InvalidInput(
            f"joints.{name}: {part.path} has no round face.", hint="point_mm and direction"
        )
    return max(faces, key=lambda face: sum(f.area for f in faces if coaxial(f, face)))


def coaxial(one: Cylinder, other: Cylinder) -> bool:
    """Return whether two round faces of one part have the same axis."""
    across = other.point - one.point
    return bool(
        np.linalg.norm(np.cross(one.direction, other.direction)) < COAXIAL
        and np.linalg.norm(np.cross(across, one.direction)) < COAXIAL
    )


def _frame(point: np.ndarray, z: np.ndarray) -> np.ndarray:
    """A frame on an axis: z along it, x level where it can be."""
    up = np.array([0.0, 0.0, 1.0])
    x = np.cross(up, z)
    if np.linalg.norm(x) < 1e-6:
        x = np.array([1.0, 0.0, 0.0]) - z[0] * z
    x /= np.linalg.norm(x)
    X = np.eye(4)
    X[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    X[:3, 3] = point
    return X


def _joint(
    name: str,
    table: StepJointTable,
    poses: Mapping[str, np.ndarray],
    servo: Servo | None,
    where: str,
) -> TreeJoint:
    c, s = math.cos(table.drawn_at), math.sin(table.drawn_at)
    back = np.eye(4)
    back[:2, :2] = [[c, s], [-s, c]]
    X = inverse(poses[table.parent]) @ poses[table.child] @ back
    lower, upper = table.limits
    if not lower < upper:
        raise InvalidInput(f"joints.{name}: its lower limit is above its upper one.", where=where)
    limited = math.isfinite(lower) and math.isfinite(upper)
    return TreeJoint(
        name,
        "revolute" if limited else "continuous",
        table.parent,
        table.child,
        X,
        lower=lower,
        upper=upper,
        effort=servo.stall_torque if servo else None,
        velocity=servo.no_load_speed if servo else None,
        damping=servo.viscous_friction if servo else 0.0,
        friction=servo.friction if servo else 0.0,
        armature=servo.armature if servo else 0.0,
        where=where,
    )


def _look(part: DrawnPart, X_drawing_link: np.ndarray) -> Part:
    assert part.look is not None
    moved = part.look.at(inverse(X_drawing_link) @ part.X_drawing_part)
    return Part(moved.vertices, moved.faces, moved.color, part.path.rpartition("/")[2])
