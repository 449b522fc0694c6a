"""A tree as MJCF: a file that MuJoCo opens, with a floor on which the robot stands."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from phasmid.errors import InvalidRobot
from phasmid.formats.meshes import StlFiles
from phasmid.formats.tree import HINGES, Tree, TreeJoint, TreeLink
from phasmid.formats.xml import written
from phasmid.robot import Part, Servo
from phasmid.robot.inertial import Inertial
from phasmid.units import STANDARD_GRAVITY

FOOT_SHARE = 0.05
"""Radius of a foot's collision sphere, as a share of the way from its hinge."""

MOST_STL_FACES = 200_000
"""Largest number of faces in an STL file that the engine reads."""

SAG = 0.1
"""Error at which a servo of unknown stiffness gives its torque, or carries the robot [rad]."""


def mjcf_files(
    tree: Tree,
    name: str,
    *,
    home: Mapping[str, float] | None = None,
    servo: Servo | None = None,
) -> dict[str, bytes]:
    """Return a tree as an MJCF file and its meshes; the robot stands in its keyframe `home`.

    Feet are the massless links without a look at the ends of the legs: each becomes a site of its
    name and a small collision sphere, whose far end is the foot. Every hinge has a position
    actuator of its name. Data that MJCF cannot express is left out: fixed joints, speed limits.

    Args:
        tree: The robot.
        name: Name of the file without its ending.
        home: Joint angles by name in which the robot stands [rad]; an absent one is as near to 0
            as its limits allow.
        servo: Gives the actuators' stiffness and damping; without one they give their torque, or
            carry the robot, at an error of 0.1 rad, and are damped critically.

    Returns:
        Content by file name: ``NAME.xml`` and ``NAME_meshes/*.stl``, each mesh once.

    Raises:
        InvalidRobot: A moving link has no mass, or a joint is neither a hinge nor fixed.
    """
    document = _Document(tree, home or {}, servo, StlFiles(name))
    root = document.element(name)
    ET.indent(root)
    files = {f"{name}.xml": ET.tostring(root, encoding="utf-8") + b"\n"}
    return files | document.meshes.files


class _Document:
    """One file in the making, and its mesh files."""

    def __init__(
        self, tree: Tree, home: Mapping[str, float], servo: Servo | None, meshes: StlFiles
    ) -> None:
        self._tree, self._servo, self.meshes = tree, servo, meshes
        self._hinges = list(_hinges(tree))
        self._feet = {joint.child: joint for joint in tree.joints if _is_foot(tree, joint)}
        self._home = {
            joint.name: min(max(home.get(joint.name, 0.0), joint.lower), joint.upper)
            for joint in self._hinges
        }
        masses = [link.inertial.mass for link in tree.links.values() if link.inertial]
        self._weight = STANDARD_GRAVITY * sum(masses)

    def element(self, name: str) -> ET.Element:
        """Return the whole file."""
        root = ET.Element("mujoco", model=self._tree.name or name)
        settings = {"angle": "radian", "autolimits": "true", "meshdir": self.meshes.folder}
        ET.SubElement(root, "compiler", settings)
        # Hard friction, so that standing feet hardly creep.
        option = {"timestep": "0.001", "integrator": "implicitfast"}
        ET.SubElement(root, "option", option | {"cone": "elliptic", "impratio": "100"})
        default = ET.SubElement(root, "default")
        asset = ET.SubElement(root, "asset")
        world = ET.SubElement(root, "worldbody")
        _furnish(asset, world)
        trunk = ET.SubElement(world, "body", name=self._tree.root.name)
        height = self._height()
        trunk.set("pos", written([0.0, 0.0, height]))
        ET.SubElement(trunk, "freejoint", name=f"{self._tree.root.name}_free")
        self._fill(trunk, self._tree.root)
        ET.SubElement(trunk, "site", name="imu", size="0.005", group="4")
        for file in map(Path, self.meshes.files):
            ET.SubElement(asset, "mesh", name=file.stem, file=file.name)
        actuator = ET.SubElement(root, "actuator")
        for joint in self._hinges:
            ET.SubElement(actuator, "position", self._drive(joint))
        _add_sensors(root, list(self._feet))
        angles = [self._home[joint.name] for joint in self._hinges]
        qpos = [0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0, *angles]
        key = {"name": "home", "qpos": written(qpos), "ctrl": written(angles)}
        if not angles:
            del key["ctrl"]
        ET.SubElement(ET.SubElement(root, "keyframe"), "key", key)
        self._add_classes(default)
        for empty in [child for child in (default, asset, actuator) if not len(child)]:
            root.remove(empty)
        return root

    def _fill(self, body: ET.Element, link: TreeLink, by: TreeJoint | None = None) -> None:
        """Write a link, moved by a joint, and all that hangs on it."""
        moves = by is None or by.kind in HINGES
        if link.inertial is not None:
            ET.SubElement(body, "inertial", _inertia(link.inertial))
        elif moves:
            raise InvalidRobot(f"link {link.name} moves but has no mass.", where=link.where)
        if by is not None and moves:
            ET.SubElement(body, "joint", _hinge(by))
        most = MOST_STL_FACES
        pieces = [
            Part(part.vertices, part.faces[start : start + most], part.color, part.name)
            for part in link.parts
            for start in range(0, len(part.faces), most)
        ]
        for number, part in enumerate(pieces):
            mesh = Path(self.meshes.add(part, part.name or link.name)).stem
            look = {"mesh": mesh, "rgba": written(part.color)}
            # The engine wants names of their own for all geoms.
            name = f"{link.name}/{number}/{part.name}"
            ET.SubElement(body, "geom", {"class": "visual", "name": name, **look})
        for joint in self._tree.joints_from(link.name):
            if joint.child in self._feet:
                self._add_foot(body, joint)
                continue
            if joint.kind not in HINGES and joint.kind != "fixed":
                raise InvalidRobot(
                    f"joint {joint.name} is of kind {joint.kind}; only hinges and fixed joints "
                    "are written.",
                    where=joint.where,
                )
            child = ET.SubElement(body, "body", {"name": joint.child, **_pose(joint)})
            self._fill(child, self._tree.links[joint.child], joint)

    def _add_foot(self, body: ET.Element, joint: TreeJoint) -> None:
        radius, centre = _sphere(joint)
        site = {"name": joint.child, **_pose(joint), "size": written([1.5 * radius])}
        ET.SubElement(body, "site", {"class": "foot", **site})
        name = f"{joint.child}_sphere"
        ET.SubElement(
            body, "geom", {"class": "foot"}, name=name, pos=written(centre), size=written([radius])
        )

    def _drive(self, joint: TreeJoint) -> dict[str, str]:
        drive = {"name": joint.name, "joint": joint.name}
        torque = joint.effort or self._weight * self._reach(joint)
        if self._servo is not None:
            drive |= {"kp": written([self._servo.stiffness]), "kv": written([self._servo.damping])}
        else:
            drive |= {"kp": written([torque / SAG]), "dampratio": "1.0"}
        if math.isfinite(joint.lower) and math.isfinite(joint.upper):
            drive["ctrlrange"] = written([joint.lower, joint.upper])
        if joint.effort:
            drive["forcerange"] = written([-joint.effort, joint.effort])
        return drive

    def _reach(self, joint: TreeJoint) -> float:
        """Longest way from a hinge along the links that it carries [m]."""
        ways = [
            float(np.linalg.norm(after.X_parent_child[:3, 3])) + self._reach(after)
            for after in self._tree.joints_from(joint.child)
        ]
        return max(ways, default=0.0)

    def _poses(self) -> dict[str, np.ndarray]:
        """Poses of all links in the root's at home."""
        poses = {self._tree.root.name: np.eye(4)}
        frontier = [self._tree.root.name]
        while frontier:
            parent = frontier.pop()
            for joint in self._tree.joints_from(parent):
                turn = np.eye(4)
                angle = self._home.get(joint.name, 0.0)
                turn[:3, :3] = Rotation.from_rotvec(angle * joint.axis).as_matrix()
                poses[joint.child] = poses[parent] @ joint.X_parent_child @ turn
                frontier.append(joint.child)
        return poses

    def _height(self) -> float:
        """Of the root above the floor, so that the lowest foot, or mesh, touches it."""
        poses, lowest = self._poses(), []
        for joint in self._feet.values():
            radius, centre = _sphere(joint)
            lowest.append(float(poses[joint.parent][2, :3] @ centre) - radius)
            lowest[-1] += float(poses[joint.parent][2, 3])
        if not lowest:
            for name, link in self._tree.links.items():
                X = poses[name]
                lowest += [float((part.vertices @ X[2, :3]).min() + X[2, 3]) for part in link.parts]
        return -min(lowest, default=0.0)

    def _add_classes(self, default: ET.Element) -> None:
        """Write the classes of shapes and feet."""
        if self.meshes.files:
            # Some meshes are open or flat; a shell has its frame all the same.
            ET.SubElement(default, "mesh", inertia="shell")
            visual = ET.SubElement(default, "default", {"class": "visual"})
            ET.SubElement(
                visual, "geom", type="mesh", group="2", contype="0", conaffinity="0", mass="0"
            )
        if self._feet:
            foot = ET.SubElement(default, "default", {"class": "foot"})
            # Feet touch the floor and not each other.
            ET.SubElement(
                foot, "geom", type="sphere", group="3", contype="0", conaffinity="1", mass="0"
            )
            ET.SubElement(foot, "site", type="sphere", group="4")


def _hinges(tree: Tree, link: str | None = None) -> Iterator[TreeJoint]:
    """Hinges in the engine's order, depth first."""
    for joint in tree.joints_from(tree.root.name if link is None else link):
        if joint.kind in HINGES:
            yield joint
        yield from _hinges(tree, joint.child)


def _is_foot(tree: Tree, joint: TreeJoint) -> bool:
    link = tree.links[joint.child]
    bare = link.inertial is None and not link.parts and not tree.joints_from(joint.child)
    carried = any(above.child == joint.parent and above.kind in HINGES for above in tree.joints)
    last = not any(beside.kind in HINGES for beside in tree.joints_from(joint.parent))
    return joint.kind == "fixed" and bare and carried and last


def _sphere(joint: TreeJoint) -> tuple[float, Float[np.ndarray, "3"]]:
    """Radius and centre of a foot's sphere, in the frame of the link that carries it."""
    tip = joint.X_parent_child[:3, 3]
    length = float(np.linalg.norm(tip))
    return FOOT_SHARE * max(length, 0.01), (1 - FOOT_SHARE) * tip


def _quaternion(R: Float[np.ndarray, "3 3"]) -> dict[str, str]:
    if np.array_equal(R, np.eye(3)):
        return {}
    return {"quat": written(Rotation.from_matrix(R).as_quat(canonical=True, scalar_first=True))}


def _pose(joint: TreeJoint) -> dict[str, str]:
    X = joint.X_parent_child
    return {"pos": written(X[:3, 3]), **_quaternion(X[:3, :3])}


def _inertia(inertial: Inertial) -> dict[str, str]:
    own = {"pos": written(inertial.com), "mass": written([inertial.mass])}
    if np.array_equal(inertial.inertia, np.diag(np.diag(inertial.inertia))):
        return own | {"diaginertia": written(np.diag(inertial.inertia))}
    # The engine would stop at 1e-12 kg·m² when it turns to principal axes itself.
    moments, axes = np.linalg.eigh(inertial.inertia)
    if np.linalg.det(axes) < 0:
        axes = axes * [1, 1, -1]
    return own | _quaternion(axes) | {"diaginertia": written(moments)}


def _hinge(joint: TreeJoint) -> dict[str, str]:
    hinge = {"name": joint.name, "type": "hinge", "axis": written(joint.axis)}
    if math.isfinite(joint.lower) and math.isfinite(joint.upper) and joint.kind == "revolute":
        hinge["range"] = written([joint.lower, joint.upper])
    physics = {
        "armature": joint.armature,
        "damping": joint.damping,
        "frictionloss": joint.friction,
    }
    return hinge | {key: written([value]) for key, value in physics.items() if value}


def _furnish(asset: ET.Element, world: ET.Element) -> None:
    """Return a sky, a light and a floor."""
    size = {"width": "512", "height": "512"}
    sky = {"type": "skybox", "builtin": "gradient", "rgb1": "0.6 0.7 0.8", "rgb2": "0.1 0.15 0.2"}
    ET.SubElement(asset, "texture", sky | size)
    checker = {"type": "2d", "name": "floor", "builtin": "checker"}
    colours = {"rgb1": "0.75 0.75 0.75", "rgb2": "0.65 0.65 0.65"}
    ET.SubElement(asset, "texture", checker | colours | size)
    ET.SubElement(
        asset, "material", name="floor", texture="floor", texrepeat="10 10", texuniform="true"
    )
    ET.SubElement(world, "light", type="directional", pos="0 0 3", dir="-0.3 0.2 -1")
    ET.SubElement(world, "geom", name="floor", type="plane", size="0 0 0.05", material="floor")


def _add_sensors(root: ET.Element, feet: list[str]) -> None:
    sensor = ET.SubElement(root, "sensor")
    ET.SubElement(sensor, "accelerometer", name="imu_acceleration", site="imu")
    ET.SubElement(sensor, "gyro", name="imu_angular_velocity", site="imu")
    frame = {"name": "imu_orientation", "objtype": "site", "objname": "imu"}
    ET.SubElement(sensor, "framequat", frame)
    for foot in feet:
        ET.SubElement(sensor, "touch", name=f"{foot}_contact", site=foot)
