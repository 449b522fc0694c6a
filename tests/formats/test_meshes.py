"""Mesh files give their triangles in metres, and lying ones a sentence."""

import numpy as np
import pytest
import trimesh

from formats.tetrahedron import CORNERS, FACES, binary_stl
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.formats import ImportOptions, meshes
from phasmid.formats.meshes import MeshFiles, UnreadMesh, primitive, read_meshes
from phasmid.robot import Part
from phasmid.robot.glb import glb

TETRAHEDRON = trimesh.Trimesh(CORNERS, FACES, process=False)


def saved(folder, name, content):
    path = folder / name
    path.write_bytes(content)
    return path


FORMATS = {
    "a.stl": binary_stl(CORNERS[FACES]),
    "solid.stl": binary_stl(CORNERS[FACES], header=b"solid of a liar"),
    "ascii.stl": TETRAHEDRON.export(file_type="stl_ascii").encode(),
    "a.obj": TETRAHEDRON.export(file_type="obj").encode(),
    "a.ply": TETRAHEDRON.export(file_type="ply"),
    "A.PLY": TETRAHEDRON.export(file_type="ply", encoding="ascii"),
    "a.glb": glb({"body": (Part(CORNERS, FACES, (0.2, 0.4, 0.6, 1.0)),)}),
}


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_gives_the_same_triangles_with_corners_made_one(name, tmp_path):
    (mesh,) = read_meshes(saved(tmp_path, name, FORMATS[name]))
    assert len(mesh.vertices) == len(mesh.faces) == 4
    # Powers of two survive any precision; OBJ writes eight digits, enough for them.
    rotated = [np.roll(CORNERS[face], k, axis=0).tolist() for face in FACES for k in range(3)]
    assert all(triangle in rotated for triangle in mesh.vertices[mesh.faces].tolist())


@pytest.mark.parametrize("scale", [(-1, 1, 1), (-1, -1, -1), (-1, -1, 1), (2, 3, 4)])
def test_a_mirrored_mesh_keeps_its_outside_out(scale, tmp_path):
    """Its volume, the sum of det(corners) / 6 over the faces, stays positive."""
    path = saved(tmp_path, "a.stl", FORMATS["a.stl"])
    (mesh,) = MeshFiles(path, ImportOptions()).meshes("a.stl", scale)
    volume = np.linalg.det(mesh.vertices[mesh.faces]).sum() / 6
    expected = 0.125 * 0.25 * 0.5 / 6 * abs(np.prod(scale))
    assert volume == pytest.approx(expected, rel=1e-14)


def test_the_unit_takes_the_place_of_an_even_scale_and_mirrors_stay(tmp_path):
    path = saved(tmp_path, "tibia.stl", binary_stl(280 * CORNERS[FACES]))
    (mesh,) = MeshFiles(path, ImportOptions(mesh_unit="mm")).meshes(
        "tibia.stl", (0.001, -0.001, 0.001)
    )
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [0.035, 0.07, 0.14], rtol=1e-14)
    assert mesh.vertices[:, 1].min() < -0.06
    (mesh,) = MeshFiles(path, ImportOptions(mesh_unit="mm")).meshes("tibia.stl", (1, 1, 2))
    assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(0.28, rel=1e-14)


NAN = CORNERS[FACES].copy()
NAN[0, 1, 2] = np.nan
ASCII = FORMATS["ascii.stl"]


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("a.stl", binary_stl(CORNERS[FACES], 4_000_000_000), "mesh a.stl "),
        ("a.stl", binary_stl(CORNERS[FACES], 3), "mesh a.stl "),
        ("a.stl", binary_stl(NAN), "mesh a.stl has 1 corners that are not finite."),
        ("a.stl", b"", "mesh a.stl is empty."),
        ("a.stl", binary_stl(CORNERS[:0, None]), "mesh a.stl is empty."),
        ("a.stl", binary_stl(CORNERS[FACES])[:-1], "mesh a.stl "),
        ("a.stl", ASCII[: ASCII.rindex(b"vertex")], "mesh a.stl "),
        ("a.stl", ASCII.replace(b"vertex 0", b"vertex x", 1), "mesh a.stl "),
        ("a.ply", b"ply\nformat ascii 1.0\n", "mesh a.ply is no PLY file."),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nf 1 2\nf 1 2\n", "mesh a.obj is no OBJ file: it holds no"),
        ("a.dae", b"x", "mesh a.dae was left out: COLLADA files are not read."),
        ("a.fbx", b"x", 'mesh a.fbx was left out: files of the kind ".fbx" are not read.'),
    ],
)
def test_damaged_lying_and_other_meshes_are_named(name, content, what, tmp_path):
    with pytest.raises(PhasmidError) as error:
        read_meshes(saved(tmp_path, name, content))
    assert error.value.what.startswith(what)
    assert isinstance(error.value, UnreadMesh) == ("left out" in what)


@pytest.mark.parametrize(
    ("made", "size", "volume"),
    [
        (primitive("box", extents=(0.1, 0.2, 0.3)), (0.1, 0.2, 0.3), 0.006),
        (primitive("icosphere", radius=0.1), (0.2, 0.2, 0.2), 4 / 3 * np.pi * 1e-3),
        (primitive("cylinder", radius=0.1, height=0.3), (0.2, 0.2, 0.3), np.pi * 3e-3),
        (
            primitive("capsule", radius=0.1, height=0.3),
            (0.2, 0.2, 0.5),
            np.pi * (3e-3 + 4 / 3 * 1e-3),
        ),
    ],
)
def test_shapes_are_about_their_centre_and_have_their_size(made, size, volume):
    # Flat faces cut at most 1 - cos(pi / 16) off a round one's radius.
    np.testing.assert_allclose(np.ptp(made.vertices, axis=0), size, rtol=0.02)
    half = np.ptp(made.vertices, axis=0) / 2
    np.testing.assert_allclose(made.vertices.max(axis=0), half, rtol=1e-9)
    assert trimesh.Trimesh(made.vertices, made.faces).volume == pytest.approx(volume, rel=0.06)


def test_all_faces_of_a_model_together_have_a_limit(tmp_path, monkeypatch):
    """Two tetrahedra have 8 faces."""
    monkeypatch.setattr(meshes, "MOST_FACES", 8)
    files = MeshFiles(saved(tmp_path, "a.stl", FORMATS["a.stl"]), ImportOptions())
    for _ in range(2):
        files.meshes("a.stl")
    with pytest.raises(InvalidInput, match="or 8 faces; such models are refused"):
        files.meshes("a.stl")
