"""URDF files out: a kinematic tree as a robot for ROS and simulators, no number rounded."""

from __future__ import annotations

import html
import math
import re
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.formats.meshes import StlFiles
from phasmid.formats.tree import Tree, TreeJoint, TreeLink
from phasmid.formats.urdf_in import GREY, KINDS, OWN_SHAPE, UNLIMITED

FOOT_RADIUS = 0.005
"""Radius of the ball at a foot, on which simulators let the robot stand [m]."""

_STICK_RADIUS = 0.008
"""Radius of the sticks that show a robot without a look [m]."""


def urdf_files(tree: Tree, name: str) -> dict[str, bytes]:
    """Return a robot's URDF file and its meshes.

    A massless link at the end of a chain is a foot; the link that carries it gets a small ball
    there as its collision shape, since simulators take the ball's own mass for that of a massless
    link.
    A tree without any look is shown as cylinders from joint to joint. The inertia of
    rotors, which URDF has no word for, is in elements ``<phasmid>``, which other readers ignore.

    Args:
        tree: The tree.
        name: Name of the URDF file without its ending.

    Returns:
        Content by the name of the file relative to the folder: ``NAME.urdf`` and
        ``NAME_meshes/*.stl``, the latter in single precision.

    Raises:
        InvalidInput: A joint is of a kind that URDF does not have.
    """
    looks = _Looks(name)
    shown = any(link.parts for link in tree.links.values())
    body: list[str] = []
    for link in tree.links.values():
        body += _link(tree, link, looks, sticks=not shown)
    for joint in tree.joints:
        body += _joint(joint)
    lines = [
        '<?xml version="1.0" encoding="utf-8"?>',
        f"<robot{_attributes(name=tree.name)}>",
        # MuJoCo would look for all meshes beside the file.
        '  <mujoco><compiler strippath="false"/></mujoco>',
        *looks.materials(),
        *body,
        "</robot>",
        "",
    ]
    return {f"{name}.urdf": "\n".join(lines).encode(), **looks.meshes.files}


def rpy_of(R: Float[np.ndarray, "3 3"]) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a rotation Rz(yaw) Ry(pitch) Rx(roll) [rad].

    The roll is taken from the remainder of the yaw, so that both are exact where the pitch is
    a right angle and each of them alone is not determined.

    Args:
        R: A rotation, shape (3, 3).
    """
    yaw = math.atan2(R[1, 0], R[0, 0])
    pitch = math.atan2(-R[2, 0], math.hypot(R[0, 0], R[1, 0]))
    c, s = math.cos(yaw), math.sin(yaw)
    roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return roll, pitch, yaw


class _Looks:
    """Materials and mesh files, each written once."""

    def __init__(self, name: str) -> None:
        self.meshes = StlFiles(name)
        self._colors: dict[tuple[float, ...], str] = {}

    def material(self, color: tuple[float, ...]) -> str:
        return self._colors.setdefault(tuple(color), f"color_{len(self._colors) + 1}")

    def materials(self) -> list[str]:
        return [
            f'  <material name="{name}"><color rgba="{_row(color)}"/></material>'
            for color, name in self._colors.items()
        ]


def _link(tree: Tree, link: TreeLink, looks: _Looks, *, sticks: bool) -> list[str]:
    lines = []
    if link.inertial is not None:
        I = link.inertial.inertia
        moments = _attributes(
            ixx=I[0, 0], ixy=I[0, 1], ixz=I[0, 2], iyy=I[1, 1], iyz=I[1, 2], izz=I[2, 2]
        )
        lines += [
            "    <inertial>",
            f'      <origin xyz="{_row(link.inertial.com)}" rpy="0 0 0"/>',
            f"      <mass{_attributes(value=link.inertial.mass)}/>",
            f"      <inertia{moments}/>",
            "    </inertial>",
        ]
    for number, part in enumerate(link.parts):
        file = looks.meshes.add(part, f"{link.name}_{part.name}".strip("_"))
        mesh = f"<mesh{_attributes(filename=file)}/>"
        # Simulators want names of their own for all shapes of a robot.
        lines += _look(
            "visual", f"{link.name}/{number}/{part.name}", mesh, looks.material(part.color)
        )
    joints = tree.joints_from(link.name)
    if sticks:
        for joint in joints:
            lines += _stick(joint, looks)
    for joint in joints:
        foot = tree.links[joint.child]
        if joint.kind == "fixed" and foot.inertial is None and not tree.joints_from(foot.name):
            ball = f"<sphere{_attributes(radius=FOOT_RADIUS)}/>"
            origin = f'      <origin xyz="{_row(joint.X_parent_child[:3, 3])}" rpy="0 0 0"/>'
            lines += _look("collision", f"{OWN_SHAPE}{foot.name}", ball, origin=origin)
    name = _attributes(name=link.name)
    return [f"  <link{name}>", *lines, "  </link>"] if lines else [f"  <link{name}/>"]


def _look(tag: str, name: str, shape: str, material: str = "", origin: str = "") -> list[str]:
    return [
        f"    <{tag}{_attributes(name=name)}>",
        *([origin] if origin else []),
        f"      <geometry>{shape}</geometry>",
        *([f'      <material name="{material}"/>'] if material else []),
        f"    </{tag}>",
    ]


def _stick(joint: TreeJoint, looks: _Looks) -> list[str]:
    """Return a cylinder from a link's origin to a joint that it carries."""
    end = joint.X_parent_child[:3, 3]
    length = float(np.linalg.norm(end))
    if length < 1e-3:
        return []
    x, y, z = end / length
    # Ry(pitch) and Rz(yaw) turn the cylinder's z to the end.
    rpy = (0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x))
    origin = f'      <origin xyz="{_row(end / 2)}" rpy="{_row(rpy)}"/>'
    shape = f"<cylinder{_attributes(radius=_STICK_RADIUS, length=length)}/>"
    return _look("visual", f"{OWN_SHAPE}{joint.name}", shape, looks.material(GREY), origin)


def _joint(joint: TreeJoint) -> list[str]:
    kind = joint.kind
    if kind not in KINDS:
        raise InvalidInput(f"joint {joint.name} is {kind}; URDF has no such joint.")
    endless = math.isinf(joint.lower) and math.isinf(joint.upper)
    if kind == "revolute" and endless:
        kind = "continuous"
    X = joint.X_parent_child
    lines = [
        f"  <joint{_attributes(name=joint.name, type=kind)}>",
        f'    <origin xyz="{_row(X[:3, 3])}" rpy="{_row(rpy_of(X[:3, :3]))}"/>',
        f"    <parent{_attributes(link=joint.parent)}/>",
        f"    <child{_attributes(link=joint.child)}/>",
    ]
    if kind != "fixed":
        lines.append(f'    <axis xyz="{_row(joint.axis)}"/>')
        # URDF has no word for "unknown" or "none"; readers want numbers in all four places.
        limits = {
            "lower": max(joint.lower, -UNLIMITED),
            "upper": min(joint.upper, UNLIMITED),
            "effort": UNLIMITED if joint.effort is None else joint.effort,
            "velocity": UNLIMITED if joint.velocity is None else joint.velocity,
        }
        if kind == "continuous":
            del limits["lower"], limits["upper"]
        lines.append(f"    <limit{_attributes(**limits)}/>")
        dynamics = _attributes(damping=joint.damping, friction=joint.friction)
        lines.append(f"    <dynamics{dynamics}/>")
        if joint.armature:
            lines.append(f"    <phasmid{_attributes(armature=joint.armature)}/>")
    return [*lines, "  </joint>"]


def _attributes(**values: object) -> str:
    return "".join(
        f' {key}="{_text(value) if isinstance(value, str) else _number(value)}"'
        for key, value in values.items()
    )


def _text(text: str) -> str:
    """Return a text for XML, without the characters that XML cannot hold."""
    kept = re.sub(r"[^\t\n\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "\ufffd", text)
    return html.escape(kept)


def _number(value: object) -> str:
    # Adding 0 turns a negative zero into a plain one.
    return repr(float(value) + 0.0)  # type: ignore[arg-type]


def _row(values: Iterable[float]) -> str:
    return " ".join(map(_number, values))
