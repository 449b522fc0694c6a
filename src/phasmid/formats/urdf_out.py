"""URDF files out: a kinematic tree as a robot for ROS and simulators, no number rounded."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np

from phasmid.formats.meshes import Color, StlFiles
from phasmid.formats.tree import Tree, TreeJoint, TreeLink, rpy_of
from phasmid.formats.urdf_in import OWN_SHAPE, UNLIMITED
from phasmid.formats.xml import written
from phasmid.robot import Part

FOOT_RADIUS = 0.005
"""Radius of the ball at a foot that is a point, on which simulators let the robot stand [m]."""

_STICK_RADIUS = 0.008
"""Radius of the sticks that show a robot without a look [m]."""

_NOT_XML = re.compile(r"[^\t\n\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML cannot hold."""


def urdf_files(tree: Tree, name: str) -> dict[str, bytes]:
    """Return a robot's URDF file and its meshes.

    Balls of a link are its collision shapes. A massless link at the end of a chain is a foot; where
    the link that carries it has no ball it gets a small one there, since simulators take a ball's
    own mass for that of a massless link. A tree without any look is shown as cylinders from joint
    to joint. The inertia of rotors, and the stance, for which URDF has no words, are in elements
    ``<phasmid>``, which other readers ignore.

    Returns:
        Content by file name: ``NAME.urdf`` and ``NAME_meshes/*.stl`` in single precision.
    """
    meshes, colors = StlFiles(name), dict[Color, str]()
    root = ET.Element("robot", name=tree.name)
    # MuJoCo would look for all meshes beside the file.
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", strippath="false")
    sticks = not any(link.parts for link in tree.links.values())
    for link in tree.links.values():
        _add_link(root, tree, link, meshes, colors, sticks=sticks)
    for joint in tree.joints:
        _add_joint(root, joint)
    for number, (color, own) in enumerate(colors.items(), 1):
        material = ET.Element("material", name=own)
        ET.SubElement(material, "color", rgba=written(color))
        root.insert(number, material)
    for element in root.iter():
        for key, value in element.items():
            element.set(key, _NOT_XML.sub("\ufffd", value))
    ET.indent(root)
    return {f"{name}.urdf": ET.tostring(root, "utf-8", xml_declaration=True), **meshes.files}


def _add_link(
    root: ET.Element,
    tree: Tree,
    link: TreeLink,
    meshes: StlFiles,
    colors: dict[Color, str],
    *,
    sticks: bool,
) -> None:
    body = ET.SubElement(root, "link", name=link.name)

    def add_shape(
        tag: str, name: str, shape: str, color: Color | None = None, **sizes: str
    ) -> ET.Element:
        look = ET.SubElement(body, tag, name=name)
        ET.SubElement(ET.SubElement(look, "geometry"), shape, sizes)
        if color:
            own = colors.setdefault(color, f"color_{len(colors) + 1}")
            ET.SubElement(look, "material", name=own)
        return look

    if link.inertial is not None:
        inertial, I = ET.SubElement(body, "inertial"), link.inertial.inertia
        _add_origin(inertial, link.inertial.com)
        ET.SubElement(inertial, "mass", value=written([link.inertial.mass]))
        keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        moments = I[np.triu_indices(3)].tolist()
        numbers = {key: written([moment]) for key, moment in zip(keys, moments, strict=True)}
        ET.SubElement(inertial, "inertia", numbers)
    for number, part in enumerate(link.parts):
        file = meshes.add(part, f"{link.name}_{part.name}".strip("_"))
        # Simulators want names of their own for all shapes of a robot.
        add_shape("visual", f"{link.name}/{number}/{part.name}", "mesh", part.color, filename=file)
    for joint in tree.joints_from(link.name):
        end = joint.X_parent_child[:3, 3]
        length = float(np.linalg.norm(end))
        if sticks and length >= 1e-3:
            x, y, z = end / length
            sizes = {"radius": written([_STICK_RADIUS]), "length": written([length])}
            look = add_shape("visual", f"{OWN_SHAPE}{joint.name}", "cylinder", Part.color, **sizes)
            # Ry(pitch) and Rz(yaw) turn the cylinder's z to the end.
            _add_origin(look, end / 2, (0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x)))
    for number, (x, y, z, radius) in enumerate(link.balls, 1):
        ball = add_shape(
            "collision", f"{link.name}_ball_{number}", "sphere", radius=written([radius])
        )
        _add_origin(ball, [x, y, z])
    for joint in [] if link.balls else tree.joints_from(link.name):
        foot = tree.links[joint.child]
        if joint.kind == "fixed" and foot.inertial is None and not tree.joints_from(foot.name):
            name, size = f"{OWN_SHAPE}{foot.name}", written([FOOT_RADIUS])
            ball = add_shape("collision", name, "sphere", radius=size)
            _add_origin(ball, joint.X_parent_child[:3, 3])


def _add_origin(
    owner: ET.Element, xyz: Iterable[float], rpy: Iterable[float] = (0.0, 0.0, 0.0)
) -> None:
    ET.SubElement(owner, "origin", xyz=written(xyz), rpy=written(rpy))


def _own(joint: TreeJoint) -> dict[str, float]:
    """Return what only phasmid reads: inertia of the rotor and angle of the stance."""
    numbers = {"armature": joint.armature or None, "home": joint.home}
    return {name: number for name, number in numbers.items() if number is not None}


def _add_joint(root: ET.Element, joint: TreeJoint) -> None:
    kind, X = joint.kind, joint.X_parent_child
    if kind == "revolute" and math.isinf(joint.lower) and math.isinf(joint.upper):
        kind = "continuous"
    element = ET.SubElement(root, "joint", name=joint.name, type=kind)
    _add_origin(element, X[:3, 3], rpy_of(X[:3, :3]))
    ET.SubElement(element, "parent", link=joint.parent)
    ET.SubElement(element, "child", link=joint.child)
    if kind == "fixed":
        return
    ET.SubElement(element, "axis", xyz=written(joint.axis))
    # URDF has no word for "unknown" or "none"; readers want numbers in all four places.
    limits = {
        "lower": max(joint.lower, -UNLIMITED),
        "upper": min(joint.upper, UNLIMITED),
        "effort": UNLIMITED if joint.effort is None else joint.effort,
        "velocity": UNLIMITED if joint.velocity is None else joint.velocity,
    }
    if kind == "continuous":
        del limits["lower"], limits["upper"]
    groups = {
        "limit": limits,
        "dynamics": {"damping": joint.damping, "friction": joint.friction},
        "phasmid": _own(joint),
    }
    for tag, values in groups.items():
        if values:
            ET.SubElement(element, tag, {key: written([v]) for key, v in values.items()})
