"""A first guess of a STEP file's sidecar."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from phasmid.cad.drawing import Cylinder, DrawnPart, read_drawing
from phasmid.cad.servo_case import CASES
from phasmid.formats.step_sidecar import literal
from phasmid.robot import JOINTS
from phasmid.toml import toml_key, toml_string

WORDS = {
    "coxa": ("coxa", "hip", "shoulder"),
    "femur": ("femur", "thigh", "upper_leg", "upper leg"),
    "tibia": ("tibia", "shin", "calf", "shank", "lower_leg", "lower leg"),
}
"""Common names of the links of a leg."""

TRUNK = "body"
NEAR = 5e-5
"""Axes of two parts closer than this are one [m]."""

FARTHEST = 0.1
"""Faces of one hinge lie no farther apart along its axis than this [m]."""

TIP = 2e-4
"""Corners within this of the farthest one are a link's tip [m]."""

PLASTIC = 1200.0
"""Assumed density of parts without one [kg/m³]."""


@dataclass(frozen=True, eq=False)
class Axis:
    """A round face in the drawing's frame."""

    part: DrawnPart
    face: Cylinder
    point: np.ndarray
    direction: np.ndarray


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
    links: dict[str, list[DrawnPart]] = {TRUNK: []}
    patterns: dict[str, list[str]] = {}
    legs: dict[str, dict[str, str]] = {}
    for part, (leg, joint, pattern) in zip(parts, found, strict=True):
        if not joints[leg] >= set(JOINTS):
            links[TRUNK].append(part)
            continue
        name = f"{leg}_{joint}"
        links.setdefault(name, []).append(part)
        own = patterns.setdefault(name, [])
        if pattern not in own:
            own.append(pattern)
        legs.setdefault(leg, {})[joint] = name
    lines = [
        f"# A first guess for {_plain(path.name)}: {len(parts)} parts, {len(legs)} legs. "
        "Correct it where it is wrong.",
        f"name = {toml_string(_plain(path.stem)[:64] or 'robot')}",
        '# servo = "AX-12A"',
        f"density_kg_m3 = {PLASTIC:g}  # a guess, for all parts without a density of their own",
        "",
        *_servos(parts),
    ]
    for name, group in links.items():
        if name != TRUNK:
            lines += _link(name, patterns[name], group)
    # The first link whose pattern fits has the part: what is left is the trunk's.
    lines += _link(TRUNK, ["*"], links[TRUNK])
    for leg, names in legs.items():
        parent = TRUNK
        for joint in JOINTS:
            axis = shared_axis(links[parent], links[names[joint]])
            lines += _joint(parent, names[joint], axis)
            parent = names[joint]
        lines += _foot(f"{leg}_foot", parent, links[parent], axis)
    return "\n".join(lines)


def _plain(name: str) -> str:
    return "".join(c if c.isprintable() else " " for c in name)


def _link_of(path: str) -> tuple[str, str, str]:
    """Leg, joint and pattern of a part's path; empty for the trunk's parts."""
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
            pattern = "/".join(literal(n) for n in names[: depth + 1])
            return leg or "leg", joint, f"{pattern}/*" if held else pattern
    return "", "", ""


def _servos(parts: tuple[DrawnPart, ...]) -> list[str]:
    """Weights of the servos that go by their maker's name."""
    lines = []
    for product in sorted({part.product for part in parts}):
        bare = re.sub(r"[^a-z0-9]", "", product.lower())
        for servo, case in CASES.items():
            stem = re.sub(r"[^a-z0-9]", "", servo.lower())
            if bare and (stem in bare or stem.rstrip("a") in bare):
                lines += [
                    f"[parts.{toml_key(literal(product))}]",
                    f"mass_g = {1000 * case.mass:g}  # {servo}",
                    "",
                ]
                break
    return lines


def _link(name: str, patterns: list[str], found: list[DrawnPart]) -> list[str]:
    shown = ", ".join(part.path for part in found[:3]) + (", …" if len(found) > 3 else "")
    return [
        f"[links.{toml_key(name)}]  # {_plain(shown) or 'no part'}",
        f"parts = [{', '.join(map(toml_string, patterns))}]",
        "# mass_g = ...  # as weighed, in place of what its parts' densities give",
        "",
    ]


def _joint(parent: str, child: str, axis: Axis | None) -> list[str]:
    head = [
        f"[joints.{toml_key(child)}]",
        f"parent = {toml_string(parent)}",
        f"child = {toml_string(child)}",
    ]
    if axis is None:
        found = [
            "# No round face is shared by the two links: give the axis.",
            "# point_mm = [0, 0, 0]",
            "# direction = [0, 0, 1]",
        ]
    else:
        found = [
            f"# of {_plain(axis.part.path)}, radius {1000 * axis.face.radius:.4g} mm",
            f"point_m = {_row(axis.point)}",
            f"direction = {_row(axis.direction)}",
        ]
    return [*head, *found, "# limits_deg = [-90, 90]", ""]


def shared_axis(one: Iterable[DrawnPart], other: Iterable[DrawnPart]) -> Axis | None:
    """Find the axis that round faces of two links share, of several the one of the widest."""
    theirs = _axes(other)
    if not theirs:
        return None
    points = np.array([axis.point for axis in theirs])
    directions = np.array([axis.direction for axis in theirs])
    best: tuple[float, Axis] | None = None
    for axis in _axes(one):
        across = points - axis.point
        along = across @ axis.direction
        off = np.linalg.norm(across - along[:, None] * axis.direction, axis=1)
        turned = np.linalg.norm(np.cross(directions, axis.direction), axis=1)
        fits = (off < NEAR) & (turned < 1e-4) & (np.abs(along) < FARTHEST)
        for number in np.flatnonzero(fits):
            radius = min(axis.face.radius, theirs[number].face.radius)
            if best is None or radius > best[0]:
                best = radius, axis
    return best[1] if best else None


def _axes(parts: Iterable[DrawnPart]) -> list[Axis]:
    found = []
    for part in parts:
        X = part.X_drawing_part
        for face in part.cylinders:
            point = X[:3, :3] @ face.point + X[:3, 3]
            found.append(Axis(part, face, point, X[:3, :3] @ face.direction))
    return found


def _foot(name: str, link: str, parts: list[DrawnPart], axis: Axis | None) -> list[str]:
    """Return the mean of the corners of a link's triangles farthest from its hinge."""
    corners = [
        part.look.at(part.X_drawing_part).vertices for part in parts if part.look is not None
    ]
    head = [f"[feet.{toml_key(name)}]", f"link = {toml_string(link)}"]
    if not corners or axis is None:
        return [*head, "# point_mm = [0, 0, 0]  # where it touches the ground, in the drawing", ""]
    points = np.concatenate(corners)
    distance = np.linalg.norm(np.cross(points - axis.point, axis.direction), axis=1)
    tip = points[distance > distance.max() - TIP].mean(axis=0)
    return [*head, f"point_m = {_row(tip)}  # the farthest corner of its parts", ""]


def _row(values: np.ndarray) -> str:
    return "[" + ", ".join(repr(round(float(v), 9) + 0.0) for v in values) + "]"
