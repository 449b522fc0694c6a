"""What is fuzzed: each reader of files with whole files to damage; hook a new one in here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from dataclasses import replace as replaced
from importlib import resources
from pathlib import Path

import trimesh

from formats.tetrahedron import CORNERS, FACES, binary_stl
from formats.trees import files_of
from formats.wild_model import BESIDE, WILD
from phasmid.formats import ImportOptions, import_robot, load_robot
from phasmid.formats.meshes import MeshFiles
from phasmid.robot import Appearance, Part, robot_to_toml
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
    exported, modelled = files_of(looking, ".urdf"), files_of(looking, ".xml")
    ball = trimesh.creation.icosphere(subdivisions=3)
    preset = resources.files("phasmid.robot") / "presets" / "phantomx-paper.toml"

    def mesh(path: Path) -> object:
        return MeshFiles(path, ImportOptions()).meshes(path.name)

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
            (modelled.pop("robot.xml"), WILD.encode()),
            {**modelled, **BESIDE},
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
  <link name="lower">
    <visual><origin xyz="0 0 1" rpy="1 2 3"/>
      <geometry><mesh filename="a.stl" scale="1 -1 1"/></geometry></visual>
    <visual><geometry><mesh filename="b.dae"/></geometry></visual>
    <collision><geometry><sphere radius="0.1"/></geometry></collision>
  </link>
  <joint name="hip" type="revolute">
    <origin xyz="0.1 0 0" rpy="0 1.5707963 0"/>
    <parent link="base"/><child link="lower"/><axis xyz="0 0 2"/>
    <limit lower="-1.5" upper="1.5" effort="2" velocity="6"/>
    <dynamics damping="0.1" friction="0.2"/><mimic joint="hip"/>
  </joint>
  <gazebo reference="base"><material>Gazebo/Blue</material></gazebo>
</robot>
"""
