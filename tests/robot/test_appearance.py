"""A robot's look: parts keep their numbers in a file, and a damaged file gets a sentence."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.robot import Appearance, Part, load_robot, robot_to_toml
from phasmid.robot import glb as glb_files
from phasmid.robot.glb import glb, read_glb

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
    with pytest.raises(InvalidInput, match=r"look\.glb cannot be read as a binary glTF file"):
        read_glb(path)


def told_otherwise(change: Callable[[dict[str, Any]], object]) -> bytes:
    """A file of one triangle whose description is changed, its data not."""
    raw = glb({"body": (TRIANGLE,)})
    length = struct.unpack_from("<I", raw, 12)[0]
    told = json.loads(raw[20 : 20 + length])
    change(told)
    text = json.dumps(told).encode()
    text += b" " * (-len(text) % 4)
    rest = raw[20 + length :]
    size = 20 + len(text) + len(rest)
    return struct.pack("<4sIIII", b"glTF", 2, size, len(text), 0x4E4F534A) + text + rest


def nodes(count: int, **keys: object) -> Callable[[dict[str, Any]], object]:
    return lambda told: told["nodes"].extend({"name": f"body/{n}", **keys} for n in range(count))


def nest(levels: int) -> Callable[[dict[str, Any]], object]:
    """Nodes each of which holds the next."""
    first = 1000

    def change(told: dict[str, Any]) -> None:
        told["nodes"] = [{} for _ in range(first)]
        told["nodes"] += [{"children": [first + n + 1]} for n in range(levels)] + [{}]

    return change


def accessor(**keys: object) -> Callable[[dict[str, Any]], object]:
    return lambda told: told["accessors"][0].update(keys)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda told: told["accessors"].append(
                {"componentType": 5126, "count": 40, "type": "VEC3"}
            ),
            "an array has no data in the file",
        ),
        (accessor(count=40_000_000), "an array is larger than the file"),
        (accessor(count=-3), "an array is larger than the file"),
        (lambda told: told["buffers"][0].update(uri="/etc/passwd"), "it refers to other files"),
        (
            lambda told: told.update(images=[{"uri": "https://example.org/a.png"}]),
            "it refers to other files",
        ),
        (nodes(4001), "it shows more than 4000 nodes or 5000000 faces"),
        (nest(64), "its nodes must form trees of at most 64 levels"),
        (
            lambda told: told["nodes"].extend([{"children": [len(told["nodes"])]}]),
            "its nodes must form trees of at most 64 levels",
        ),
        (nodes(2, children=[0]), "its nodes must form trees of at most 64 levels"),
    ],
)
def test_sizes_are_checked_before_a_file_is_unpacked(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], said: str
) -> None:
    path = tmp_path / "look.glb"
    path.write_bytes(told_otherwise(change))
    with pytest.raises(InvalidInput) as refused:
        read_glb(path)
    assert refused.value.what == f"look.glb cannot be read as a binary glTF file: {said}."


@pytest.mark.parametrize(
    "change", [accessor(bufferView=99), lambda told: told["bufferViews"][0].update(byteLength=9999)]
)
def test_arrays_outside_the_file_are_not_read(
    tmp_path: Path, change: Callable[[dict[str, Any]], object]
) -> None:
    path = tmp_path / "look.glb"
    path.write_bytes(told_otherwise(change)[:-4])
    with pytest.raises(InvalidInput, match=r"look\.glb cannot be read as a binary glTF file"):
        read_glb(path)


def test_a_mesh_counts_as_often_as_it_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "look.glb"
    path.write_bytes(told_otherwise(nodes(6, mesh=0)))
    # The triangle and its 6 copies have 3 corners and 3 indices each: 42 numbers of 4 per face.
    monkeypatch.setattr(glb_files, "MOST_FACES", 10)
    with pytest.raises(InvalidInput, match="more than 4000 nodes or 10 faces"):
        read_glb(path)


def test_a_node_s_pose_and_a_repeated_mesh_are_read(tmp_path: Path) -> None:
    def change(told: dict[str, Any]) -> None:
        told["nodes"].append({"name": "body/again", "mesh": 0, "translation": [0.1, 0.2, 0.3]})
        told["scenes"][0]["nodes"].append(len(told["nodes"]) - 1)

    path = tmp_path / "look.glb"
    path.write_bytes(told_otherwise(change))
    again, plate = read_glb(path)["body"]
    # Single precision of numbers below 1.
    np.testing.assert_allclose(again.vertices - plate.vertices, [[0.1, 0.2, 0.3]] * 3, atol=6e-8)


def test_points_without_triangles_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "look.glb"
    points = trimesh.PointCloud(TRIANGLE.vertices)
    path.write_bytes(trimesh.Scene({"body/a": points}).export(file_type="glb"))
    with pytest.raises(InvalidInput, match="it holds points or lines without faces"):
        read_glb(path)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"faces": np.array([[0, 1, 3]])}, "a corner that does not exist"),
        ({"vertices": np.full((3, 3), np.nan)}, "corners that are not finite"),
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
