"""Simple binary glTF files, as phasmid writes them, read without a mesh library."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Integer

from phasmid.robot.gltf import chunks

KEYS = {"scene", "scenes", "asset", "accessors", "meshes", "materials", "nodes", "buffers"}
KEYS |= {"bufferViews"}
"""All that a plain file has: nothing that moves, and no extension."""

TRIANGLES = 4
"""The format's own code."""


class PlainMesh(NamedTuple):
    """Mesh in the frame of its file.

    Attributes:
        node: Name of the one node that shows it.
        vertices: Corners [m], shape (V, 3).
        faces: Indices of each triangle's corners, shape (F, 3).
        color: Red, green, blue and opacity, 0 to 1.
    """

    node: str
    vertices: Float[np.ndarray, "vertices 3"]
    faces: Integer[np.ndarray, "faces 3"]
    color: tuple[float, float, float, float]


def plain_meshes(raw: bytes) -> list[PlainMesh] | None:
    """Return the meshes of a simple file in the order of node names; None for others.

    A library that reads them all takes longer to import than a page of a run to draw.

    Args:
        raw: A file that `check_glb` found sound.
    """
    told, data = chunks(raw)
    try:
        nodes = told["nodes"]
        names = [node["name"] for node in nodes]
        alone = told["scenes"] == [{"nodes": list(range(len(nodes)))}] and not told.get("scene")
        whole = all(set(node) == {"name", "mesh"} and type(node["name"]) is str for node in nodes)
        if not (set(told) <= KEYS and alone and whole and len(set(names)) == len(names)):
            return None
        found = [_mesh(told, data, node) for node in nodes]
    except (AttributeError, LookupError, TypeError, ValueError):
        return None
    meshes = [mesh for mesh in found if mesh is not None]
    return sorted(meshes, key=lambda mesh: mesh.node) if len(meshes) == len(found) else None


def _mesh(told: dict[str, Any], data: memoryview, node: dict[str, Any]) -> PlainMesh | None:
    (piece,) = told["meshes"][node["mesh"]]["primitives"]
    if set(piece) != {"attributes", "indices", "mode", "material"} or piece["mode"] != TRIANGLES:
        return None
    if set(piece["attributes"]) != {"POSITION"}:
        return None
    vertices = _array(told, data, piece["attributes"]["POSITION"], 5126, "VEC3")
    faces = _array(told, data, piece["indices"], 5125, "SCALAR")
    color = told["materials"][piece["material"]]["pbrMetallicRoughness"]["baseColorFactor"]
    if vertices is None or faces is None or not all(0 <= c <= 1 for c in color):
        return None
    # Colours have 256 levels.
    r, g, b, a = (round(255 * c) / 255 for c in color)
    corners = vertices.reshape(-1, 3).astype(float)
    return PlainMesh(node["name"], corners, faces.reshape(-1, 3).astype(np.int64), (r, g, b, a))


def _array(
    told: dict[str, Any], data: memoryview, number: int, code: int, shape: str
) -> np.ndarray | None:
    """Return the numbers of a contiguous array of a type; None for others."""
    array = told["accessors"][number]
    view = told["bufferViews"][array["bufferView"]]
    if (array["componentType"], array["type"]) != (code, shape):
        return None
    if {"sparse", "normalized"} & set(array) or "byteStride" in view:
        return None
    start = view.get("byteOffset", 0) + array.get("byteOffset", 0)
    count = array["count"] * {"VEC3": 3, "SCALAR": 1}[shape]
    return np.frombuffer(data, {5126: "<f4", 5125: "<u4"}[code], count, start)
