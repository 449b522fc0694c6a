"""Binary glTF files of a robot's meshes."""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.robot.appearance import MOST_FACES, Part

LARGEST_FILE = 64_000_000
"""Files of meshes above this many bytes are refused."""

_MOST_NODES, _MOST_LEVELS = 4000, 64
_JSON, _UNSIGNED, _FLOAT, _TRIANGLES = 0x4E4F534A, 5125, 5126, 4
"""Codes of the format."""


def read_glb(path: Path) -> dict[str, tuple[Part, ...]]:
    """Read the parts of a binary glTF file with nodes named ``LINK/PART``.

    Raises:
        InvalidInput: It is absent, too large, refers to other files, or is no such file.
        InvalidRobot: A mesh in it is impossible.
    """
    try:
        with path.open("rb") as file:
            raw = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise InvalidInput(f"cannot read {path}: {reason}.") from None
    if len(raw) > LARGEST_FILE:
        raise InvalidInput(f"{path} holds more than {LARGEST_FILE} bytes; such files are refused.")
    try:
        content, data = _chunks(raw)
        _check(content, len(data))
        found = list(_plain_parts(content, data) or _parts(raw))
    except InvalidRobot:
        raise
    except Exception as error:
        # The mesh library raises many kinds of exceptions.
        what = f"{path.name} cannot be read as a binary glTF file"
        detail = f": {error}" if isinstance(error, ValueError) else ""
        raise InvalidInput(f"{what}{detail}.") from None
    parts: dict[str, list[Part]] = {}
    for node, part in sorted(found, key=lambda item: item[0]):
        parts.setdefault(node.partition("/")[0], []).append(part)
    return {link: tuple(some) for link, some in parts.items()}


def glb(parts: Mapping[str, tuple[Part, ...]]) -> bytes:
    """Return parts as a binary glTF file for `read_glb`, in single precision."""
    import trimesh as library

    # Its own annotations are partial.
    trimesh: Any = library
    scene = trimesh.Scene()
    for link, pieces in parts.items():
        for number, part in enumerate(pieces):
            rgba = [round(255 * c) for c in part.color]
            material = trimesh.visual.material.PBRMaterial(
                baseColorFactor=rgba, metallicFactor=0.1, roughnessFactor=0.7
            )
            mesh = trimesh.Trimesh(part.vertices, part.faces, process=False)
            mesh.visual = trimesh.visual.TextureVisuals(material=material)
            name = f"{link}/{part.name or number}"
            if name in scene.graph.nodes:
                name = f"{link}/{part.name} {number}"
            scene.add_geometry(mesh, node_name=name, geom_name=name)
    return bytes(scene.export(file_type="glb"))


def _chunks(raw: bytes) -> tuple[dict[str, Any], memoryview]:
    """Return the description of a file, and its data."""
    magic, version, _, length, kind = struct.unpack_from("<4sIIII", raw)
    if magic != b"glTF" or version != 2 or kind != _JSON:
        raise ValueError("it must begin as glTF 2.0 does")
    start = 28 + length
    return json.loads(raw[20 : 20 + length]), memoryview(raw)[start:]


def _check(content: dict[str, Any], held: int) -> None:
    """Refuse a file that refers to other files, or unpacks to far more than it holds.

    Source: glTF 2.0 specification, sections 3.5, 3.6 and 4.4.
    """
    if any("uri" in each for noun in ("buffers", "images") for each in content.get(noun, ())):
        raise ValueError("it refers to other files")
    counts = [array["count"] for array in content.get("accessors", ())]
    # Each element takes a byte of the data at least. Arrays may share bytes.
    if not all(0 <= count <= held for count in counts) or sum(counts) > LARGEST_FILE:
        raise ValueError("an array is larger than the file")
    if any("bufferView" not in array for array in content.get("accessors", ())):
        raise ValueError("an array has no data in the file")
    sizes = [
        sum(counts[i] for piece in mesh["primitives"] for i in _arrays(piece))
        for mesh in content.get("meshes", ())
    ]
    nodes = content.get("nodes", ())
    shown = sum(sizes[node["mesh"]] for node in nodes if "mesh" in node)
    if len(nodes) > _MOST_NODES or shown > 4 * MOST_FACES:
        raise ValueError(f"it shows more than {_MOST_NODES} nodes or {MOST_FACES} faces")
    inner = [child for node in nodes for child in node.get("children", ())]
    level = set(range(len(nodes))) - set(inner)
    left = len(nodes)
    for _ in range(_MOST_LEVELS):
        left -= len(level)
        level = {child for index in level for child in nodes[index].get("children", ())}
    if left or level or len(set(inner)) < len(inner):
        raise ValueError(f"its nodes must form trees of at most {_MOST_LEVELS} levels")


def _arrays(piece: dict[str, Any]) -> Iterator[int]:
    """Yield the indices of the arrays of a primitive."""
    yield from piece["attributes"].values()
    if "indices" in piece:
        yield piece["indices"]


def _plain_parts(content: dict[str, Any], data: memoryview) -> list[tuple[str, Part]] | None:
    """Return the parts of a file as `glb` writes it; None for others.

    It saves the import of the mesh library, 0.4 s of each walk.
    """
    nodes, found = content.get("nodes", ()), []
    names = [node.get("name") for node in nodes]
    if "extensionsUsed" in content or None in names or len(set(names)) < len(names):
        return None
    for node in nodes:
        if set(node) != {"name", "mesh"}:
            return None
        piece, *others = content["meshes"][node["mesh"]]["primitives"]
        if others or set(piece["attributes"]) != {"POSITION"}:
            return None
        if not {"indices", "material"} <= set(piece) or piece.get("mode", 4) != _TRIANGLES:
            return None
        vertices = _numbers(content, data, piece["attributes"]["POSITION"], _FLOAT, "<f4")
        faces = _numbers(content, data, piece["indices"], _UNSIGNED, "<u4")
        look = content["materials"][piece["material"]].get("pbrMetallicRoughness", {})
        if vertices is None or faces is None or "baseColorFactor" not in look:
            return None
        # Colours have 256 levels.
        r, g, b, a = (round(255 * c) / 255 for c in look["baseColorFactor"])
        found.append((node["name"], _part(node["name"], vertices, faces, (r, g, b, a))))
    return found


def _numbers(
    content: dict[str, Any], data: memoryview, index: int, code: int, kind: str
) -> np.ndarray | None:
    """Return the rows of three numbers of a contiguous array of a type; None for others."""
    array = content["accessors"][index]
    view = content["bufferViews"][array["bufferView"]]
    if (
        array["componentType"] != code
        or {"sparse", "normalized"} & set(array)
        or "byteStride" in view
    ):
        return None
    count = array["count"] * (3 if array["type"] == "VEC3" else 1)
    start = view.get("byteOffset", 0) + array.get("byteOffset", 0)
    return np.frombuffer(data, kind, count, start).reshape(-1, 3)


def _parts(raw: bytes) -> list[tuple[str, Part]]:
    """Return the parts of any binary glTF file, in the file's frame."""
    import trimesh

    scene: Any = trimesh.load_scene(io.BytesIO(raw), file_type="glb", process=False)
    found = []
    for node in scene.graph.nodes_geometry:
        X, geometry = scene.graph[node]
        mesh = scene.geometry[geometry]
        if not hasattr(mesh, "faces"):
            raise ValueError("it holds points or lines without faces")
        rgba = getattr(getattr(mesh.visual, "material", None), "baseColorFactor", None)
        r, g, b, a = (0.5, 0.5, 0.5, 1.0) if rgba is None else np.asarray(rgba, dtype=float) / 255
        vertices = np.asarray(mesh.vertices) @ X[:3, :3].T + X[:3, 3]
        found.append((str(node), _part(str(node), vertices, mesh.faces, (r, g, b, a))))
    return found


def _part(node: str, vertices: Any, faces: Any, color: tuple[float, float, float, float]) -> Part:
    return Part(
        np.asarray(vertices, dtype=float),
        np.asarray(faces, dtype=int),
        color,
        node.partition("/")[2],
    )
