"""MJCF files out: a robot that MuJoCo opens, on a floor on which it stands."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from phasmid.formats.meshes import StlFiles
from phasmid.formats.mjcf_in import NO_LOAD_SPEED
from phasmid.formats.tree import Tree, TreeJoint, TreeLink, tree_of
from phasmid.formats.urdf_in import OWN_SHAPE
from phasmid.formats.xml import written
from phasmid.kinematics import joint_angles, leg_frames, neutral_feet
from phasmid.robot import Part, Robot
from phasmid.robot.inertial import Inertial

FOOT_SHARE = 0.05
"""Radius of the collision sphere of a point foot, as a share of the way from its hinge."""

MOST_STL_FACES = 200_000
"""Largest number of faces in an STL file that the engine reads."""

# Hard friction, so that standing feet hardly creep. Feet touch the floor and not each other. Some
# meshes are open or flat; a shell has its frame all the same.
_SCENE = """<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="100"/>
  <default>
    <mesh inertia="shell"/>
    <default class="visual">
      <geom type="mesh" group="2" contype="0" conaffinity="0" mass="0"/>
    </default>
    <default class="foot">
      <geom type="sphere" group="3" contype="0" conaffinity="1" mass="0"/>
      <site type="sphere" group="4"/>
    </default>
  </default>
  <asset>
    <texture type="skybox" builtin="gradient" rgb1="0.6 0.7 0.8" rgb2="0.1 0.15 0.2" width="512"
             height="512"/>
    <texture type="2d" name="floor" builtin="checker" rgb1="0.75 0.75 0.75" rgb2="0.65 0.65 0.65"
             width="512" height="512"/>
    <material name="floor" texture="floor" texrepeat="10 10" texuniform="true"/>
  </asset>
  <worldbody>
    <light type="directional" pos="0 0 3" dir="-0.3 0.2 -1"/>
    <geom name="floor" type="plane" size="0 0 0.05" material="floor"/>
  </worldbody>
  <actuator/>
  <sensor>
    <accelerometer name="imu_acceleration" site="imu"/>
    <gyro name="imu_angular_velocity" site="imu"/>
    <framequat name="imu_orientation" objtype="site" objname="imu"/>
  </sensor>
  <keyframe/>
  <custom/>
</mujoco>"""


def mjcf_files(robot: Robot, name: str) -> dict[str, bytes]:
    """Return a robot's MJCF file and its meshes; the robot stands in its keyframe `home`.

    Each foot becomes a site of its name, and its ball a collision sphere about it. A foot that is a
    point gets a small sphere whose far end is the foot; its name marks it as no part of the robot.
    Every hinge has a position actuator of its name.

    Returns:
        Content by file name: ``NAME.xml`` and ``NAME_meshes/*.stl``, each mesh once.
    """
    tree = tree_of(robot)
    homes = (joint.home for joint in tree.joints if joint.kind != "fixed")
    # A foot out of reach has no angles.
    angles = [home or 0.0 for home in homes]
    root, meshes = ET.fromstring(_SCENE), StlFiles(name)  # noqa: S314, our own text
    asset, world, actuator, sensor, keyframe = (
        _only(root, tag) for tag in ("asset", "worldbody", "actuator", "sensor", "keyframe")
    )
    root.set("model", tree.name or name)
    _only(root, "compiler").set("meshdir", meshes.folder)
    height = _height(robot)
    trunk = ET.SubElement(world, "body", name=tree.root.name, pos=written([0.0, 0.0, height]))
    ET.SubElement(trunk, "freejoint", name=f"{tree.root.name}_free")
    _fill(trunk, tree, tree.root, meshes)
    ET.SubElement(trunk, "site", name="imu", size="0.005", group="4")
    for file in map(Path, meshes.files):
        ET.SubElement(asset, "mesh", name=file.stem, file=file.name)
    for joint in tree.joints:
        if joint.kind == "fixed":
            touch = {"name": f"{joint.child}_contact", "site": joint.child}
            ET.SubElement(sensor, "touch", touch)
        else:
            ET.SubElement(actuator, "position", _drive(joint))
    speeds = {NO_LOAD_SPEED: robot.servo.no_load_speed} | {
        f"{NO_LOAD_SPEED}:{joint.name}": joint.velocity
        for joint in tree.joints
        if joint.velocity not in (None, robot.servo.no_load_speed)
    }
    for own, speed in speeds.items():
        ET.SubElement(_only(root, "custom"), "numeric", name=own, data=written([speed]))
    qpos = [0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0, *angles]
    ET.SubElement(keyframe, "key", name="home", qpos=written(qpos), ctrl=written(angles))
    ET.indent(root)
    return {f"{name}.xml": ET.tostring(root, encoding="utf-8") + b"\n"} | meshes.files


def _only(root: ET.Element, tag: str) -> ET.Element:
    found = root.find(tag)
    assert found is not None
    return found


def _fill(
    body: ET.Element, tree: Tree, link: TreeLink, meshes: StlFiles, by: TreeJoint | None = None
) -> None:
    """Write a link, moved by a joint, and all that hangs on it."""
    assert link.inertial is not None
    ET.SubElement(body, "inertial", _inertia(link.inertial))
    if by is not None:
        ET.SubElement(body, "joint", _hinge(by))
    pieces = [
        Part(part.vertices, part.faces[start : start + MOST_STL_FACES], part.color, part.name)
        for part in link.parts
        for start in range(0, len(part.faces), MOST_STL_FACES)
    ]
    for number, part in enumerate(pieces):
        mesh = Path(meshes.add(part, part.name or link.name)).stem
        # The engine wants names of their own for all geoms.
        name = f"{link.name}/{number}/{part.name}"
        look = {"class": "visual", "name": name, "mesh": mesh, "rgba": written(part.color)}
        ET.SubElement(body, "geom", look)
    for joint in tree.joints_from(link.name):
        if joint.kind == "fixed":
            name, radius, centre = _sphere(joint, link)
            size = written([1.5 * radius])
            site = {"class": "foot", "name": joint.child, "size": size, **_pose(joint)}
            ET.SubElement(body, "site", site)
            ball = {"name": name, "size": written([radius])}
            ET.SubElement(body, "geom", {"class": "foot", "pos": written(centre), **ball})
        else:
            child = ET.SubElement(body, "body", {"name": joint.child, **_pose(joint)})
            _fill(child, tree, tree.links[joint.child], meshes, joint)


def _height(robot: Robot) -> float:
    """Return the height of the trunk at which the lowest foot touches the floor [m]."""
    if robot.foot_radius:
        return robot.foot_radius - float(neutral_feet(robot)[:, 2].min())
    lowest = []
    for leg in robot.legs:
        frames = leg.X_body_hip @ leg_frames(leg, joint_angles(leg, leg.neutral_foot))
        knee, foot = frames[2, :3, 3], frames[3, :3, 3]
        radius = FOOT_SHARE * float(np.linalg.norm(foot - knee))
        lowest.append(float((foot + FOOT_SHARE * (knee - foot))[2]) - radius)
    return -min(lowest)


def _sphere(joint: TreeJoint, link: TreeLink) -> tuple[str, float, Float[np.ndarray, "3"]]:
    """Name, radius and centre of a foot's sphere, in the frame of the link that carries it."""
    tip = joint.X_parent_child[:3, 3]
    for x, y, z, radius in link.balls:
        return f"{joint.child}_ball", radius, np.array([x, y, z])
    name = f"{OWN_SHAPE}{joint.child}_sphere"
    return name, FOOT_SHARE * float(np.linalg.norm(tip)), (1 - FOOT_SHARE) * tip


def _pose(joint: TreeJoint) -> dict[str, str]:
    X = joint.X_parent_child
    return {"pos": written(X[:3, 3]), "quat": _quaternion(X[:3, :3])}


def _quaternion(R: Float[np.ndarray, "3 3"]) -> str:
    return written(Rotation.from_matrix(R).as_quat(canonical=True, scalar_first=True))


def _inertia(inertial: Inertial) -> dict[str, str]:
    # The engine would stop at 1e-12 kg·m² when it turns to principal axes itself.
    moments, axes = np.linalg.eigh(inertial.inertia)
    if np.array_equal(inertial.inertia, np.diag(np.diag(inertial.inertia))):
        moments, axes = np.diag(inertial.inertia), np.eye(3)
    if np.linalg.det(axes) < 0:
        axes = axes * [1, 1, -1]
    return {
        "pos": written(inertial.com),
        "quat": _quaternion(axes),
        "mass": written([inertial.mass]),
        "diaginertia": written(moments),
    }


def _hinge(joint: TreeJoint) -> dict[str, str]:
    return {
        "name": joint.name,
        "type": "hinge",
        "axis": written(joint.axis),
        "range": written([joint.lower, joint.upper]),
        "armature": written([joint.armature]),
        "damping": written([joint.damping]),
        "frictionloss": written([joint.friction]),
    }


def _drive(joint: TreeJoint) -> dict[str, str]:
    assert joint.effort is not None
    return {
        "name": joint.name,
        "joint": joint.name,
        "kp": written([joint.stiffness]),
        "kv": written([joint.servo_damping]),
        "ctrlrange": written([joint.lower, joint.upper]),
        "forcerange": written([-joint.effort, joint.effort]),
    }
