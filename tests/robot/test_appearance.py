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
from phasmid.robot import Appearance, Part, appearance, load_robot, plain_glb, robot_to_toml
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
                {"componentType": 5126, "count": 40_000_000, "type": "VEC3"}
            ),
            "look.glb is no binary glTF file: an array has no data in the file.",
        ),
        (
            accessor(count=40_000_000),
            "look.glb is no binary glTF file: an array lies outside the file.",
        ),
        (
            accessor(count=-3),
            "look.glb is no binary glTF file: a size in it is no whole number.",
        ),
        (
            accessor(bufferView=99),
            "look.glb is no binary glTF file: its description does not hold together.",
        ),
        (
            lambda told: told["bufferViews"][0].update(byteLength=10_000),
            "look.glb is no binary glTF file: an array lies outside the file.",
        ),
        (
            lambda told: told["buffers"][0].update(uri="/etc/passwd"),
            "look.glb names other files, which are not opened.",
        ),
        (
            lambda told: told.update(images=[{"uri": "https://example.org/a.png"}]),
            "look.glb names other files, which are not opened.",
        ),
        (nodes(4001), "look.glb holds more than 4000 nodes; such files are refused."),
        (nest(64), "look.glb holds more than 64 levels of nodes; such files are refused."),
        (
            lambda told: told["nodes"].extend([{"children": [len(told["nodes"])]}]),
            "look.glb is no binary glTF file: its nodes stand in a ring.",
        ),
        (
            nodes(2, children=[0]),
            "look.glb is no binary glTF file: a node stands in two others.",
        ),
    ],
)
def test_what_a_file_claims_is_weighed_before_it_is_unpacked(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], said: str
) -> None:
    path = tmp_path / "look.glb"
    path.write_bytes(told_otherwise(change))
    with pytest.raises(InvalidInput) as refused:
        read_glb(path)
    assert refused.value.what == said


def test_a_mesh_counts_as_often_as_it_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "look.glb"
    path.write_bytes(told_otherwise(nodes(6, mesh=0)))
    # The triangle itself and its 6 copies have 21 corners.
    monkeypatch.setattr(appearance, "MOST_FACES", 20)
    with pytest.raises(InvalidInput) as refused:
        read_glb(path)
    assert refused.value.what == ("look.glb holds more than 20 corners; such files are refused.")


@pytest.mark.parametrize("preset", ["phantomx-paper", "phantomx-ax", "octopod"])
def test_plain_files_are_read_as_the_library_of_meshes_reads_them(
    preset: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = Path(appearance.__file__).with_name("presets") / f"{preset}.glb"
    assert plain_glb.plain_meshes(path.read_bytes())
    plain = read_glb(path)
    monkeypatch.setattr(appearance, "plain_meshes", lambda raw: None)
    other = read_glb(path)
    assert list(plain) == list(other)
    for link in plain:
        assert [(p.name, p.color) for p in plain[link]] == [(p.name, p.color) for p in other[link]]
        for mine, library in zip(plain[link], other[link], strict=True):
            np.testing.assert_array_equal(mine.vertices, library.vertices)
            np.testing.assert_array_equal(mine.faces, library.faces)


@pytest.mark.parametrize(
    "change",
    [
        lambda told: told["nodes"][-1].update(translation=[0.1, 0.2, 0.3]),
        lambda told: told["nodes"].append({"name": "body/again", "mesh": 0}),
        lambda told: told["meshes"][0]["primitives"][0].update(mode=5),
        lambda told: told["accessors"][0].update(normalized=True),
        lambda told: told["materials"][0].clear(),
        lambda told: told.update(extensionsUsed=["KHR_draco_mesh_compression"]),
    ],
)
def test_what_is_not_plain_is_left_to_the_library(change: Callable[[dict[str, Any]], None]) -> None:
    assert plain_glb.plain_meshes(told_otherwise(lambda told: None))
    assert plain_glb.plain_meshes(told_otherwise(change)) is None


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
