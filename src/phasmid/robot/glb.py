"""Binary glTF files of a robot's meshes."""

from __future__ import annotations

import io
import json
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.errors import InvalidInput, InvalidRobot, WrongContent, own_words
from phasmid.robot.appearance import MOST_FACES, Part
from phasmid.toml import read_bytes

LARGEST_FILE = 64_000_000
"""Files of meshes above this many bytes are refused."""

_MOST_NODES, _MOST_LEVELS = 4000, 64


def read_glb(path: Path) -> dict[str, tuple[Part, ...]]:
    """Read the parts of a binary glTF file with nodes named ``LINK/PART``.

    Raises:
        InvalidInput: It is absent, too large, refers to other files, or is no such file.
        InvalidRobot: A mesh in it is impossible.
    """
    raw = read_bytes(path, LARGEST_FILE)
    try:
        _check(raw)
        found = _parts(raw)
    except InvalidRobot:
        raise
    except Exception as error:
        # The mesh library raises many kinds of exceptions.
        what = f"{path.name} cannot be read as a binary glTF file"
        raise InvalidInput(f"{what}{own_words(error)}.") from None
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


def _check(raw: bytes) -> None:
    """Refuse a file that refers to other files, or unpacks to far more than it holds.

    Source: glTF 2.0 specification, sections 3.5, 3.6 and 4.4.
    """
    magic, version, _, length = struct.unpack_from("<4sIII", raw)
    if magic != b"glTF" or version != 2:
        raise WrongContent("it must begin as glTF 2.0 does")
    content, held = json.loads(raw[20 : 20 + length]), len(raw) - 28 - length
    if any("uri" in each for noun in ("buffers", "images") for each in content.get(noun, ())):
        raise WrongContent("it refers to other files")
    counts = [array["count"] for array in content.get("accessors", ())]
    # Each element takes a byte of the data at least. Arrays may share bytes.
    if not all(0 <= count <= held for count in counts) or sum(counts) > LARGEST_FILE:
        raise WrongContent("an array is larger than the file")
    if any("bufferView" not in array for array in content.get("accessors", ())):
        raise WrongContent("an array has no data in the file")
    sizes = [
        sum(counts[i] for piece in mesh["primitives"] for i in _arrays(piece))
        for mesh in content.get("meshes", ())
    ]
    nodes = content.get("nodes", ())
    shown = sum(sizes[node["mesh"]] for node in nodes if "mesh" in node)
    if len(nodes) > _MOST_NODES or shown > 4 * MOST_FACES:
        raise WrongContent(f"it shows more than {_MOST_NODES} nodes or {MOST_FACES} faces")
    inner = [child for node in nodes for child in node.get("children", ())]
    level = set(range(len(nodes))) - set(inner)
    left = len(nodes)
    for _ in range(_MOST_LEVELS):
        left -= len(level)
        level = {child for index in level for child in nodes[index].get("children", ())}
    if left or level or len(set(inner)) < len(inner):
        raise WrongContent(f"its nodes must form trees of at most {_MOST_LEVELS} levels")


def _arrays(piece: dict[str, Any]) -> Iterator[int]:
    """Yield the indices of the arrays of a primitive."""
    yield from piece["attributes"].values()
    if "indices" in piece:
        yield piece["indices"]


def _parts(raw: bytes) -> list[tuple[str, Part]]:
    """Return the parts of any binary glTF file, in the file's frame."""
    import trimesh

    scene: Any = trimesh.load_scene(io.BytesIO(raw), file_type="glb", process=False)
    found = []
    for node in scene.graph.nodes_geometry:
        X, geometry = scene.graph[node]
        mesh = scene.geometry[geometry]
        if not hasattr(mesh, "faces"):
            raise WrongContent("it holds points or lines without faces")
        rgba = getattr(getattr(mesh.visual, "material", None), "baseColorFactor", None)
        r, g, b, a = (0.5, 0.5, 0.5, 1.0) if rgba is None else np.asarray(rgba, dtype=float) / 255
        vertices = np.asarray(mesh.vertices) @ X[:3, :3].T + X[:3, 3]
        part = Part(vertices, mesh.faces, (r, g, b, a), str(node).partition("/")[2])
        found.append((str(node), part))
    return found
