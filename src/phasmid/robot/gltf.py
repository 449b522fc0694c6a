"""Check of the sizes that a binary glTF file declares, before it is unpacked."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any

from phasmid.errors import InvalidInput

LARGEST_JSON = 4_000_000
"""Files whose description holds more bytes than this are refused."""

MOST_NODES = 4000
"""Files of more nodes than this are refused."""

MOST_LEVELS = 64
"""Nodes in nodes deeper than this are refused."""

ATTRIBUTES = 4
"""Arrays by corner, such as normals and colours, that a file may have for each corner on average
of the most that it may show."""

SIZES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
"""Bytes of a number by the format's own code."""

SHAPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
"""Numbers of an element by the format's own word."""

_JSON, _BIN = 0x4E4F534A, 0x004E4942


@dataclass(frozen=True)
class _Size:
    corners: int = 0
    values: int = 0
    faces: int = 0

    def __add__(self, other: _Size) -> _Size:
        return _Size(
            self.corners + other.corners, self.values + other.values, self.faces + other.faces
        )


def check_glb(raw: bytes, name: str, *, most_bytes: int, most_faces: int) -> None:
    """Refuse a file that would unpack to more than it may, or that names other files.

    A mesh counts as often as a node shows it, and an array as often as it is described.

    Args:
        raw: The file.
        name: Of the file, for messages.
        most_bytes: Most that all arrays together take.
        most_faces: Most triangles, and most corners, that all nodes together show.

    Raises:
        InvalidInput: It is no such file, or too large.

    Source: glTF 2.0 specification, sections 3.5, 3.6 and 4.4.
    """
    try:
        told, data = chunks(raw)
        if any("uri" in each for noun in ("buffers", "images") for each in told.get(noun, [])):
            raise InvalidInput(
                f"{name} names other files, which are not opened.", hint="put all into the one file"
            )
        counts = _counts(told, len(data), name, most_bytes)
        meshes = [_mesh(mesh, counts) for mesh in told.get("meshes", [])]
        shown = [_at(meshes, node["mesh"]) for node in _nodes(told, name) if "mesh" in node]
    except RecursionError:
        raise InvalidInput(f"{name} is no binary glTF file: it is nested too deep.") from None
    except (ArithmeticError, AttributeError, LookupError, TypeError, struct.error):
        raise InvalidInput(
            f"{name} is no binary glTF file: its description does not hold together."
        ) from None
    except ValueError as error:
        raise InvalidInput(f"{name} is no binary glTF file: {error}.") from None
    for sizes in (meshes, shown):
        whole = sum(sizes, _Size())
        for number, most, noun in (
            (whole.faces, most_faces, "faces"),
            (whole.corners, most_faces, "corners"),
            (whole.values, ATTRIBUTES * most_faces, "values at corners"),
        ):
            if number > most:
                raise _too_many(name, most, noun)


def _too_many(name: str, most: int, noun: str) -> InvalidInput:
    return InvalidInput(f"{name} holds more than {most} {noun}; such files are refused.")


def chunks(raw: bytes) -> tuple[dict[str, Any], memoryview]:
    """The description, and the data beside it.

    Raises:
        ValueError: It is no such file.
        struct.error: It ends before its description begins.
    """
    magic, version, _, length, kind = struct.unpack_from("<4sIIII", raw)
    if magic != b"glTF" or version != 2 or kind != _JSON:
        raise ValueError("it must begin as glTF 2.0 does")
    if length > LARGEST_JSON:
        raise ValueError(f"its description holds more than {LARGEST_JSON} bytes")
    told = json.loads(raw[20 : 20 + length])
    if not isinstance(told, dict):
        raise ValueError("its description must be an object")
    start = 20 + length
    while start + 8 <= len(raw):
        length, kind = struct.unpack_from("<II", raw, start)
        if kind == _BIN:
            return told, memoryview(raw)[start + 8 : start + 8 + length]
        start += 8 + length
    return told, memoryview(b"")


def _counts(told: dict[str, Any], held: int, name: str, most_bytes: int) -> list[int]:
    """Return the number of elements of each array, all inside the file."""
    views = told.get("bufferViews", [])
    for view in views:
        _at([0], view["buffer"])
        if _whole(view.get("byteOffset", 0)) + _whole(view["byteLength"]) > held:
            raise ValueError("an array lies outside the file")
    counts, whole = [], sum(view["byteLength"] for view in views)
    for array in told.get("accessors", []):
        if "bufferView" not in array:
            raise ValueError("an array has no data in the file")
        view = _at(views, array["bufferView"])
        count = _whole(array["count"])
        row = SIZES[array["componentType"]] * SHAPES[array["type"]]
        stride = _whole(view.get("byteStride", row))
        end = _whole(array.get("byteOffset", 0)) + (count - 1) * stride + row
        if count and (not stride or end > view["byteLength"]):
            raise ValueError("an array lies outside the file")
        counts.append(count)
        whole += count * row
    # Views and arrays that share bytes take them anew.
    if whole > 2 * most_bytes:
        raise _too_many(name, 2 * most_bytes, "bytes of arrays")
    return counts


def _mesh(mesh: dict[str, Any], counts: list[int]) -> _Size:
    whole = _Size()
    for piece in mesh["primitives"]:
        arrays = {key: _at(counts, index) for key, index in piece["attributes"].items()}
        corners = arrays.get("POSITION", 0)
        ends = _at(counts, piece["indices"]) if "indices" in piece else corners
        # Strips and fans have a face for nearly each corner.
        faces = ends // 3 if piece.get("mode", 4) == 4 else ends
        whole += _Size(corners, sum(arrays.values()), faces)
    return whole


def _nodes(told: dict[str, Any], name: str) -> list[dict[str, Any]]:
    """Return the nodes, which form trees."""
    nodes: list[dict[str, Any]] = told.get("nodes", [])
    if len(nodes) > MOST_NODES:
        raise _too_many(name, MOST_NODES, "nodes")
    children = [node.get("children", []) for node in nodes]
    inner = [child for row in children for child in row]
    for child in inner:
        _at(nodes, child)
    if len(set(inner)) < len(inner):
        raise ValueError("a node stands in two others")
    held = set(inner)
    level, left = [n for n in range(len(nodes)) if n not in held], len(nodes)
    for _ in range(MOST_LEVELS):
        left -= len(level)
        level = [child for n in level for child in children[n]]
    if level:
        raise _too_many(name, MOST_LEVELS, "levels of nodes")
    if left:
        raise ValueError("its nodes stand in a ring")
    return nodes


def _whole(number: Any) -> int:
    if not isinstance(number, int) or not 0 <= number < 2**40:
        raise ValueError("a size in it is no whole number")
    return number


def _at(items: list[Any], index: Any) -> Any:
    """Return an item by its number, which must not be negative."""
    return items[_whole(index)]
