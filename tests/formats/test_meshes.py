"""Mesh files give their triangles in metres, and lying ones a sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from formats.tetrahedron import CORNERS, FACES, binary_stl
from phasmid.errors import InvalidInput, PhasmidError
from phasmid.formats import meshes
from phasmid.formats.meshes import MeshFiles, UnreadMesh, read_meshes
from phasmid.robot import Part
from phasmid.robot.glb import glb

TETRAHEDRON = trimesh.Trimesh(CORNERS, FACES, process=False)


def saved(folder: Path, name: str, content: bytes) -> Path:
    path = folder / name
    path.write_bytes(content)
    return path


def said(folder: Path, name: str, content: bytes) -> str:
    with pytest.raises(PhasmidError) as error:
        MeshFiles().meshes(saved(folder, name, content))
    return error.value.what


def triangles(mesh: meshes.Mesh) -> list[list[float]]:
    return sorted(mesh.vertices[mesh.faces].reshape(-1, 9).tolist())


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
def test_every_format_gives_the_same_triangles_with_corners_made_one(
    name: str, tmp_path: Path
) -> None:
    (mesh,) = read_meshes(saved(tmp_path, name, FORMATS[name]))
    assert len(mesh.vertices) == 4
    # Powers of two survive any precision; OBJ writes eight digits, enough for them.
    rotated = [
        np.roll(CORNERS[face], k, axis=0).ravel().tolist() for face in FACES for k in range(3)
    ]
    assert len(mesh.faces) == 4
    assert all(triangle in rotated for triangle in triangles(mesh))


@pytest.mark.parametrize("scale", [(-1, 1, 1), (-1, -1, -1), (-1, -1, 1), (2, 3, 4)])
def test_a_mirrored_mesh_keeps_its_outside_out(scale: tuple[float, ...], tmp_path: Path) -> None:
    """Its volume, the sum of det(corners) / 6 over the faces, stays positive."""
    (mesh,) = MeshFiles().meshes(saved(tmp_path, "a.stl", FORMATS["a.stl"]), scale)
    volume = np.linalg.det(mesh.vertices[mesh.faces]).sum() / 6
    expected = 0.125 * 0.25 * 0.5 / 6 * abs(np.prod(scale))
    assert volume == pytest.approx(expected, rel=1e-14)


def test_the_unit_takes_the_place_of_an_even_scale_and_mirrors_stay(tmp_path: Path) -> None:
    path = saved(tmp_path, "tibia.stl", binary_stl(280 * CORNERS[FACES]))
    (mesh,) = MeshFiles("mm").meshes(path, (0.001, -0.001, 0.001))
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [0.035, 0.07, 0.14], rtol=1e-14)
    assert mesh.vertices[:, 1].min() < -0.06
    (mesh,) = MeshFiles("mm").meshes(path, (1, 1, 2))
    assert mesh.span == pytest.approx(0.28, rel=1e-14)


@pytest.mark.parametrize("claimed", [4_000_000_000, 3])
def test_i10_a_lying_header_is_named(claimed: int, tmp_path: Path) -> None:
    what = said(tmp_path, "tibia.stl", binary_stl(CORNERS[FACES], claimed))
    assert what.startswith("mesh tibia.stl ")


def test_i10_empty_truncated_and_broken_meshes_are_named(tmp_path: Path) -> None:
    nan = CORNERS[FACES].copy()
    nan[0, 1, 2] = np.nan
    assert said(tmp_path, "a.stl", binary_stl(nan)) == (
        "mesh a.stl has 1 corners that are not finite."
    )
    assert said(tmp_path, "a.stl", b"") == "mesh a.stl is empty."
    assert said(tmp_path, "a.stl", binary_stl(CORNERS[:0, None])) == "mesh a.stl is empty."
    text = FORMATS["ascii.stl"]
    for bad in (
        b"solid a\nendsolid a",
        b"hello",
        binary_stl(CORNERS[FACES])[:-1],
        text[: text.rindex(b"vertex")],
        text.replace(b"vertex 0", b"vertex x", 1),
    ):
        assert said(tmp_path, "a.stl", bad).startswith("mesh a.stl ")
    assert said(tmp_path, "a.ply", b"ply\nformat ascii 1.0\n").startswith(
        "mesh a.ply is no PLY file: "
    )
    assert said(tmp_path, "a.obj", b"v 0 0 0\nv 1 0 0\nf 1 2\nf 1 2\n").startswith(
        "mesh a.obj is no OBJ file: "
    )
    assert said(tmp_path, "a.obj", b"v 0 0 0\nf 1 2 3\n").startswith("mesh a.obj is no OBJ file: ")


@pytest.mark.parametrize("name", ["a.dae", "a.fbx", "a"])
def test_a_format_that_is_not_read_is_told_apart(name: str, tmp_path: Path) -> None:
    with pytest.raises(UnreadMesh, match=r"was left out: .* are not read") as error:
        read_meshes(saved(tmp_path, name, b"x"))
    assert error.value.hint == "convert it to STL, OBJ, PLY or GLB"


def test_all_faces_of_a_model_together_have_a_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(meshes, "MOST_FACES", 8)
    files = MeshFiles()
    path = saved(tmp_path, "a.stl", FORMATS["a.stl"])
    files.meshes(path)
    files.meshes(path)
    with pytest.raises(InvalidInput, match="more than 8 faces; such models are refused"):
        files.meshes(path)
    monkeypatch.setattr(meshes, "MOST_MESHES", 1)
    with pytest.raises(InvalidInput, match="more than 1 meshes; such models are refused"):
        MeshFiles().count((meshes.box((1, 1, 1)),) * 2)


@pytest.mark.parametrize(
    ("made", "size", "volume"),
    [
        (meshes.box((0.1, 0.2, 0.3)), (0.1, 0.2, 0.3), 0.006),
        (meshes.sphere(0.1), (0.2, 0.2, 0.2), 4 / 3 * np.pi * 1e-3),
        (meshes.cylinder(0.1, 0.3), (0.2, 0.2, 0.3), np.pi * 3e-3),
        (meshes.capsule(0.1, 0.3), (0.2, 0.2, 0.5), np.pi * (3e-3 + 4 / 3 * 1e-3)),
    ],
)
def test_shapes_are_closed_about_their_centre_and_have_their_size(
    made: meshes.Mesh, size: tuple[float, ...], volume: float
) -> None:
    body = trimesh.Trimesh(made.vertices, made.faces)
    assert body.is_watertight
    # Flat faces cut at most 1 - cos(pi / 16) off a round one's radius.
    np.testing.assert_allclose(np.ptp(made.vertices, axis=0), size, rtol=0.02)
    np.testing.assert_allclose(
        made.vertices.max(axis=0), np.ptp(made.vertices, axis=0) / 2, rtol=1e-9
    )
    assert body.volume == pytest.approx(volume, rel=0.06)
    assert body.volume > 0
