"""A robot's look: parts keep their numbers in a file, and a damaged file gets a sentence."""

import json
import struct
from dataclasses import replace

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


@pytest.fixture
def look(tmp_path):
    return tmp_path / "look.glb"


def test_parts_keep_shape_colour_name_and_pose_in_a_file(look):
    look.write_bytes(glb({"body": (TRIANGLE, TRIANGLE), "left_front.coxa": (TRIANGLE,)}))
    parts = read_glb(look)
    assert set(parts) == {"body", "left_front.coxa"}
    assert [part.name for part in parts["body"]] == ["plate", "plate 1"]
    (part,) = parts["left_front.coxa"]
    # Single precision of a number below 1.
    np.testing.assert_allclose(part.vertices[part.faces], TRIANGLE.vertices[[[0, 1, 2]]], atol=6e-8)
    # A colour has 256 steps.
    np.testing.assert_allclose(part.color, TRIANGLE.color, atol=0.5 / 255)

    def shown_again(told):
        told["nodes"].append({"name": "body/again", "mesh": 0, "translation": [0.1, 0.2, 0.3]})
        told["scenes"][0]["nodes"].append(len(told["nodes"]) - 1)

    look.write_bytes(told_otherwise(shown_again))
    again, plate = read_glb(look)["body"]
    np.testing.assert_allclose(again.vertices - plate.vertices, [[0.1, 0.2, 0.3]] * 3, atol=6e-8)


def told_otherwise(change):
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


def nodes(count, **keys):
    return lambda told: told["nodes"].extend({"name": f"body/{n}", **keys} for n in range(count))


def nest(levels):
    """Nodes each of which holds the next."""
    first = 1000

    def change(told):
        told["nodes"] = [{} for _ in range(first)]
        told["nodes"] += [{"children": [first + n + 1]} for n in range(levels)] + [{}]

    return change


def own_child(told):
    told["nodes"].append({"children": [len(told["nodes"])]})


def accessor(**keys):
    return lambda told: told["accessors"][0].update(keys)


NO_DATA = {"componentType": 5126, "count": 40, "type": "VEC3"}
ELSEWHERE = ": it refers to other files."
NO_TREES = ": its nodes must form trees of at most 64 levels."
POINTS = trimesh.Scene({"body/a": trimesh.PointCloud(TRIANGLE.vertices)})


@pytest.mark.parametrize(
    ("content", "said"),
    [
        *((glb({"body": (TRIANGLE,)})[:cut], "") for cut in (0, 3, 30, 500, -20)),
        (told_otherwise(accessor(bufferView=99))[:-4], ""),
        (told_otherwise(lambda told: told["bufferViews"][0].update(byteLength=9999))[:-4], ""),
        (
            told_otherwise(lambda told: told["accessors"].append(NO_DATA)),
            ": an array has no data in the file.",
        ),
        (told_otherwise(accessor(count=40_000_000)), ": an array is larger than the file."),
        (told_otherwise(accessor(count=-3)), ": an array is larger than the file."),
        (told_otherwise(lambda told: told["buffers"][0].update(uri="/etc/passwd")), ELSEWHERE),
        (told_otherwise(lambda told: told.update(images=[{"uri": "http://a/b.png"}])), ELSEWHERE),
        (told_otherwise(nodes(4001)), ": it shows more than 4000 nodes or 5000000 faces."),
        (told_otherwise(nest(64)), NO_TREES),
        (told_otherwise(own_child), NO_TREES),
        (told_otherwise(nodes(2, children=[0])), NO_TREES),
        (POINTS.export(file_type="glb"), ": it holds points or lines without faces"),
    ],
)
def test_a_damaged_or_lying_file_gets_one_sentence(look, content, said):
    look.write_bytes(content)
    with pytest.raises(InvalidInput) as refused:
        read_glb(look)
    assert refused.value.what.startswith(f"look.glb cannot be read as a binary glTF file{said}")


def test_a_mesh_counts_as_often_as_it_is_shown(look, monkeypatch):
    look.write_bytes(told_otherwise(nodes(6, mesh=0)))
    # The triangle and its 6 copies have 3 corners and 3 indices each: 42 numbers of 4 per face.
    monkeypatch.setattr(glb_files, "MOST_FACES", 10)
    with pytest.raises(InvalidInput, match="more than 4000 nodes or 10 faces"):
        read_glb(look)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"faces": np.array([[0, 1, 3]])}, "a corner that does not exist"),
        ({"vertices": np.full((3, 3), np.nan)}, "corners that are not finite"),
        ({"faces": np.zeros((0, 3), dtype=int)}, r"faces of shape \(0, 3\)"),
        ({"color": (1.0, 0.0, 0.0, 2.0)}, "four numbers from 0 to 1"),
    ],
)
def test_an_impossible_mesh_is_refused(changes, said):
    with pytest.raises(InvalidRobot, match=said):
        replace(TRIANGLE, **changes)


def test_a_robot_file_names_its_look_and_walks_without_it(tmp_path):
    robot = replace(load_robot("phantomx-paper"), appearance=Appearance.of({}, "look.glb"))
    path = tmp_path / "robot.toml"
    path.write_text(robot_to_toml(robot), encoding="utf-8")
    assert load_robot(path).appearance is None
    (tmp_path / "look.glb").write_bytes(glb({"body": (TRIANGLE,)}))
    look = load_robot(path).appearance
    assert len(look.body) == 1
    # A leg without parts of its own has those of all legs.
    look = Appearance.of({"coxa": (TRIANGLE,), "left_front.femur": (TRIANGLE, TRIANGLE)})
    lengths = [len(look.link("left_front", joint)) for joint in ("coxa", "femur", "tibia")]
    assert lengths == [1, 2, 0]


@pytest.mark.parametrize("name", ["../look.glb", "/look.glb", "look.stl", "c:look.glb", "a\\b.glb"])
def test_a_look_lies_beside_its_robot(tmp_path, name):
    path = tmp_path / "robot.toml"
    text = robot_to_toml(replace(load_robot("phantomx-paper"), appearance=None))
    path.write_text(f"appearance = '{name}'\n{text}", encoding="utf-8")
    with pytest.raises(InvalidInput, match=r"the name of a \.glb file beside"):
        load_robot(path)
