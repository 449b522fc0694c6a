"""What is fuzzed: each reader of files with whole files to damage; hook a new one in here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from dataclasses import replace as replaced
from importlib import resources
from pathlib import Path

import trimesh

from formats.tetrahedron import CORNERS, FACES, binary_stl
from phasmid.formats import import_robot, mjcf_files, tree_of, urdf_files
from phasmid.formats.meshes import MeshFiles
from phasmid.robot import Appearance, Part, load_robot, robot_to_toml
from phasmid.robot.glb import glb, read_glb


@dataclass(frozen=True)
class Target:
    """A reader of files.

    Attributes:
        ending: Of the files, such as ``.urdf``.
        load: Reads one; it must return, or raise a PhasmidError.
        whole: Files that it reads, at least one.
        beside: Undamaged files in the same folder, by name.
    """

    ending: str
    load: Callable[[Path], object]
    whole: tuple[bytes, ...]
    beside: Mapping[str, bytes] = field(default_factory=dict)


def targets() -> dict[str, Target]:
    """All readers by name."""
    part = Part(CORNERS, FACES, (0.2, 0.4, 0.6, 1.0), "shell")
    robot = load_robot("phantomx-paper")
    looking = replaced(robot, appearance=Appearance.of({"body": (part,), "coxa": (part,)}))
    exported = urdf_files(tree_of(looking), "robot")
    modelled = mjcf_files(tree_of(looking), "robot")
    ball = trimesh.creation.icosphere(subdivisions=3)
    preset = resources.files("phasmid.robot") / "presets" / "phantomx-paper.toml"

    def mesh(path: Path) -> object:
        return MeshFiles().meshes(path)

    return {
        "urdf": Target(
            ".urdf",
            import_robot,
            (exported.pop("robot.urdf"), FOREIGN.encode()),
            {**exported, "a.stl": binary_stl(CORNERS[FACES])},
        ),
        "mjcf": Target(
            ".xml",
            import_robot,
            (modelled.pop("robot.xml"), FOREIGN_MJCF.encode()),
            {**modelled, "a.stl": binary_stl(CORNERS[FACES]), "defaults.mjcf": DEFAULTS.encode()},
        ),
        "stl": Target(
            ".stl",
            mesh,
            (
                binary_stl(CORNERS[FACES]),
                bytes(ball.export(file_type="stl")),
                ball.export(file_type="stl_ascii").encode(),
            ),
        ),
        "obj": Target(".obj", mesh, (ball.export(file_type="obj").encode(),)),
        "ply": Target(
            ".ply",
            mesh,
            (
                bytes(ball.export(file_type="ply")),
                bytes(ball.export(file_type="ply", encoding="ascii")),
            ),
        ),
        "glb": Target(".glb", read_glb, (glb({"body": (part,), "left.coxa": (part, part)}),)),
        "toml": Target(
            ".toml",
            load_robot,
            (preset.read_bytes(), robot_to_toml(robot).encode()),
        ),
    }


FOREIGN = """<?xml version="1.0" encoding="utf-8"?>
<!-- What other programs write. -->
<robot name="foreign" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <material name="blue"><color rgba="0 0 1 1"/><texture filename="a.png"/></material>
  <link name="base">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><geometry><box size="0.1 0.2 0.3"/></geometry><material name="blue"/></visual>
    <collision><geometry><cylinder radius="0.1" length="0.2"/></geometry></collision>
  </link>
  <link name="upper">
    <visual><origin xyz="0 0 1" rpy="1 2 3"/>
      <geometry><mesh filename="a.stl" scale="1 -1 1"/></geometry></visual>
    <visual><geometry><mesh filename="b.dae"/></geometry></visual>
  </link>
  <link name="lower">
    <visual><geometry><sphere radius="0.1"/></geometry></visual>
    <collision><geometry><capsule radius="0.1" length="0.1"/></geometry></collision>
  </link>
  <joint name="hip" type="revolute">
    <origin xyz="0.1 0 0" rpy="0 1.5707963 0"/>
    <parent link="base"/><child link="upper"/><axis xyz="0 0 2"/>
    <limit lower="-1.5" upper="1.5" effort="2" velocity="6"/>
    <dynamics damping="0.1" friction="0.2"/>
  </joint>
  <joint name="knee" type="continuous">
    <parent link="upper"/><child link="lower"/><mimic joint="hip"/>
  </joint>
  <transmission name="t"><type>simple</type><joint name="hip"/></transmission>
  <gazebo reference="base"><material>Gazebo/Blue</material></gazebo>
</robot>
"""


FOREIGN_MJCF = """<mujoco model="foreign">
  <compiler angle="degree" eulerseq="XYZ"/>
  <include file="defaults.mjcf"/>
  <asset>
    <mesh name="plate" file="a.stl" scale="0.01 0.01 -0.01"/>
    <material name="red" rgba="0.8 0.1 0.1 1"/>
  </asset>
  <worldbody>
    <light pos="0 0 3"/>
    <geom type="plane" size="1 1 1"/>
    <frame euler="10 20 30" pos="0 0 0.3">
      <body name="hull" pos="0 0 0.1" childclass="leg">
        <freejoint/>
        <geom class="visual" mesh="plate" material="red"/>
        <geom type="ellipsoid" size=".1 .08 .05" mass="2"/>
        <body name="thigh" pos=".1 .05 0" euler="0 30 45">
          <joint name="hip" pos="0.01 0.02 -0.03" ref="15"/>
          <geom type="capsule" fromto="0 0 0 .1 0 -.02" size=".015"/>
          <body pos=".1 0 0" axisangle="1 1 0 60">
            <inertial pos="0 0 -.06" mass="0.1" fullinertia="2e-4 2e-4 1e-4 1e-5 0 0"/>
            <joint name="abduct" axis="1 0 0.5" range="-20 20"/>
            <joint name="knee" pos="-.02 .01 0" axis="0 2 0" frictionloss="0.2"/>
            <geom type="box" pos="0 0 -.06" size=".01 .01 .06" xyaxes="1 0 0 0 1 0"/>
            <geom type="mesh" mesh="plate"/>
            <site name="toe_1" pos="0 0 -.13" zaxis="0 1 0"/>
          </body>
        </body>
        <body name="mast" pos="0 0 .1">
          <geom type="cylinder" fromto="0 0 0 0 0 .2" size=".01"/>
        </body>
      </body>
    </frame>
  </worldbody>
  <actuator>
    <position class="leg" joint="hip" kp="20" forcerange="-3 4"/>
    <motor joint="knee" gear="5" ctrlrange="-.5 .5"/>
    <general joint="abduct" dyntype="integrator" gainprm="2" biastype="affine" biasprm="0 -2 0"/>
  </actuator>
  <tendon><fixed name="t"><joint joint="hip" coef="1"/></fixed></tendon>
</mujoco>
"""

DEFAULTS = """<mujocoinclude><default>
  <default class="leg"><joint damping="0.1" armature="0.01" range="-40 50" axis="0 1 0"/>
    <geom density="800" rgba="0.2 0.3 0.4 1"/></default>
  <default class="visual"><geom type="mesh" contype="0" conaffinity="0" mass="0"/></default>
</default></mujocoinclude>
"""
