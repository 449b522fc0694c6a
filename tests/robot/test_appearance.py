"""A robot's look: parts keep their numbers in a file, and a damaged file gets a sentence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.robot import Appearance, Part, load_robot, robot_to_toml
from phasmid.robot.appearance import glb, read_glb

TRIANGLE = Part(
    np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.2, 0.3]]),
    np.array([[0, 1, 2]]),
    (0.2, 0.4, 0.6, 1.0),
    "plate",
)


def test_parts_keep_shape_colour_and_name_in_a_file(tmp_path: Path) -> None:
    path = tmp_path / "look.glb"
    path.write_bytes(glb({"body": (TRIANGLE, TRIANGLE), "left_front.coxa": (TRIANGLE,)}))
    parts = read_glb(path)
    assert set(parts) == {"body", "left_front.coxa"}
    assert [part.name for part in parts["body"]] == ["plate", "plate 1"]
    (part,) = parts["left_front.coxa"]
    # Single precision of a number below 1.
    np.testing.assert_allclose(part.vertices[part.faces], TRIANGLE.vertices[[[0, 1, 2]]], atol=6e-8)
    # A colour has 256 steps.
    np.testing.assert_allclose(part.color, TRIANGLE.color, atol=0.5 / 255)


def test_a_leg_without_parts_of_its_own_has_those_of_all_legs() -> None:
    look = Appearance.of({"coxa": (TRIANGLE,), "left_front.femur": (TRIANGLE, TRIANGLE)})
    assert len(look.link("left_front", "coxa")) == 1
    assert len(look.link("left_front", "femur")) == 2
    assert look.link("left_front", "tibia") == look.body == ()


@pytest.mark.parametrize("cut", [0, 3, 30, 500, -20])
def test_a_damaged_file_gets_one_sentence(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "look.glb"
    path.write_bytes(glb({"body": (TRIANGLE,)})[:cut])
    with pytest.raises(InvalidInput, match=r"look\.glb is no binary glTF file"):
        read_glb(path)


def test_points_without_triangles_are_no_look(tmp_path: Path) -> None:
    path = tmp_path / "look.glb"
    points = trimesh.PointCloud(TRIANGLE.vertices)
    path.write_bytes(trimesh.Scene({"body/a": points}).export(file_type="glb"))
    with pytest.raises(InvalidInput) as refused:
        read_glb(path)
    assert refused.value.what == (
        "look.glb is no binary glTF file: it holds points or lines without faces."
    )


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"faces": np.array([[0, 1, 3]])}, "a corner that is not there"),
        ({"vertices": np.full((3, 3), np.nan)}, "3 corners that are not finite"),
        ({"faces": np.zeros((0, 3), dtype=int)}, r"faces of shape \(0, 3\)"),
        ({"color": (1.0, 0.0, 0.0, 2.0)}, "four numbers from 0 to 1"),
    ],
)
def test_an_impossible_mesh_is_refused(changes: dict[str, object], said: str) -> None:
    with pytest.raises(InvalidRobot, match=said):
        replace(TRIANGLE, **changes)


def test_a_robot_file_names_its_look_and_walks_without_it(tmp_path: Path) -> None:
    robot = replace(load_robot("phantomx-paper"), appearance=Appearance.of({}, "look.glb"))
    path = tmp_path / "robot.toml"
    path.write_text(robot_to_toml(robot), encoding="utf-8")
    assert load_robot(path).appearance is None
    (tmp_path / "look.glb").write_bytes(glb({"body": (TRIANGLE,)}))
    look = load_robot(path).appearance
    assert look is not None
    assert len(look.body) == 1


@pytest.mark.parametrize("name", ["../look.glb", "/look.glb", "look.stl", "c:look.glb", "a\\b.glb"])
def test_a_look_lies_beside_its_robot(tmp_path: Path, name: str) -> None:
    path = tmp_path / "robot.toml"
    text = robot_to_toml(replace(load_robot("phantomx-paper"), appearance=None))
    path.write_text(f"appearance = '{name}'\n{text}", encoding="utf-8")
    with pytest.raises(InvalidInput, match=r"must be the name of a \.glb file beside"):
        load_robot(path)
