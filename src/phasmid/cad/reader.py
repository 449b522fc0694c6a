"""``python -m phasmid.cad.reader FILE OUT`` reads a STEP file in a process of its own.

The geometry kernel can crash, loop or eat memory over a damaged file; here only this process does.
"""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.cad.assembly import MM, solid_mass
from phasmid.cad.drawing import REFUSED, Cylinder, DrawnPart
from phasmid.cad.library import occt
from phasmid.cad.meshes import ANGULAR_TOLERANCE, TOLERANCE
from phasmid.robot import Part

GREY = (0.5, 0.5, 0.5, 1.0)
"""Colour of parts without one."""

MOST_PARTS = 4000
"""Files of more placed parts than this are refused."""

MOST_TRIANGLES = 4_000_000
"""Files whose solids make more triangles than this are refused."""

MOST_LEVELS = 32
"""Assemblies in assemblies deeper than this are refused."""

MEMORY = 12_000_000_000
"""Most address space that the process may take [B], where the system can limit it."""

GENERIC = ("", "NAUO", "=>", "Open CASCADE", "NONE", "SOLID", "COMPOUND")
"""Beginnings of names that programs generate."""


class Refused(Exception):
    """A file over a limit, or one without shapes; the sentence follows its name."""


def main(file: str, out: str) -> int:
    """Read a file and write its parts; return the exit status."""
    _limit_memory()
    try:
        parts = _read(file)
    except Refused as refused:
        print(refused, flush=True)  # noqa: T201
        return REFUSED
    Path(out).write_bytes(pickle.dumps(parts))
    return 0


def _limit_memory() -> None:
    with suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _read(file: str) -> list[DrawnPart]:
    document, shapes = _opened(file)
    prototypes: dict[str, DrawnPart] = {}
    parts: list[DrawnPart] = []
    triangles = 0
    for path, label, X in _leaves(shapes):
        if len(parts) >= MOST_PARTS:
            raise Refused(f"holds more than {MOST_PARTS} parts; such files are refused")
        key = _entry(label)
        if key not in prototypes:
            prototype = prototypes[key] = _prototype(document, shapes, label)
            triangles += 0 if prototype.look is None else len(prototype.look.faces)
            if triangles > MOST_TRIANGLES:
                raise Refused(f"makes more than {MOST_TRIANGLES} triangles; such files are refused")
        parts.append(replace(prototypes[key], path=path, X_drawing_part=X))
    if not parts:
        raise Refused("holds no solids")
    return parts


def _opened(file: str) -> tuple[Any, Any]:
    document = occt("TDocStd").TDocStd_Document(_words("XmlOcaf"))
    application = occt("XCAFApp").XCAFApp_Application.GetApplication_s()
    application.NewDocument(_words("MDTV-XCAF"), document)
    tools = occt("XCAFDoc").XCAFDoc_DocumentTool
    tools.SetLengthUnit_s(document, 0.001)
    control = occt("STEPCAFControl")
    reader = control.STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    if reader.ReadFile(file) != occt("IFSelect").IFSelect_RetDone:
        raise Refused("is no STEP file, or a damaged one")
    if files := _other_files(reader):
        raise Refused(f"has parts in other files, such as {files[0]}; write all parts into one")
    if not reader.Transfer(document):
        raise Refused("holds no shapes that can be read")
    return document, tools.ShapeTool_s(document.Main())


def _other_files(reader: Any) -> list[str]:
    """Files that a transfer would open too, wherever they lie."""
    found = occt("STEPConstruct").STEPConstruct_ExternRefs(reader.Reader().WS())
    found.LoadExternRefs()
    names = [found.FileName(number) or "" for number in range(1, found.NbExternRefs() + 1)]
    return ["".join(c for c in name if c.isprintable())[:100] or "one" for name in names]


def _words(text: str) -> Any:
    return occt("TCollection").TCollection_ExtendedString(text, True)


def _entry(label: Any) -> str:
    found = occt("TCollection").TCollection_AsciiString()
    occt("TDF").TDF_Tool.Entry_s(label, found)
    return str(found.ToCString())


def _labels(fill: Any) -> list[Any]:
    found = occt("TDF").TDF_LabelSequence() if hasattr(occt("TDF"), "TDF_LabelSequence") else None
    if found is None:
        found = occt("collections").Sequence_TDF_Label()
    fill(found)
    return [found.Value(number) for number in range(1, found.Length() + 1)]


def _leaves(shapes: Any) -> Iterator[tuple[str, Any, np.ndarray]]:
    """Path, label and pose [m] of every placed part."""
    roots = _labels(shapes.GetFreeShapes)
    taken: set[str] = set()
    for root in roots:
        # A single root is the robot, whose name says nothing of its parts.
        path = () if len(roots) == 1 and shapes.IsAssembly_s(root) else (_name(root) or "part",)
        yield from _below(shapes, root, path, _pose(shapes, root), taken, 0)


def _below(
    shapes: Any, label: Any, path: tuple[str, ...], X: np.ndarray, taken: set[str], level: int
) -> Iterator[tuple[str, Any, np.ndarray]]:
    if level > MOST_LEVELS:
        raise Refused(f"holds assemblies more than {MOST_LEVELS} deep; such files are refused")
    if not shapes.IsAssembly_s(label):
        yield unique("/".join(path), taken), label, X
        return
    for component in _labels(lambda found: shapes.GetComponents_s(label, found)):
        referred = occt("TDF").TDF_Label()
        if not shapes.GetReferredShape_s(component, referred):
            referred = component
        own, product = _name(component), _name(referred)
        name = product if _generic(own) and product else own or "part"
        inner = (*path, step_of(name))
        below = X @ _pose(shapes, component)
        if shapes.IsAssembly_s(referred):
            inner = tuple(unique("/".join(inner), taken).split("/"))
        yield from _below(shapes, referred, inner, below, taken, level + 1)


def step_of(name: str) -> str:
    """Return a name as a step of a path."""
    return name.replace("/", "_")


def unique(path: str, taken: set[str]) -> str:
    """Reserve a path; add a number if it is taken."""
    name, number = path, 1
    while name in taken:
        number += 1
        name = f"{path}_{number}"
    taken.add(name)
    return name


def _generic(name: str) -> bool:
    made_up = any(name.startswith(word) for word in GENERIC if word)
    return not name or name.isdigit() or made_up


def _name(label: Any) -> str:
    data = occt("TDataStd")
    found = data.TDataStd_Name()
    if not label.FindAttribute(data.TDataStd_Name.GetID_s(), found):
        return ""
    try:
        # As UTF-8; the kernel's own characters are halves of UTF-16.
        raw = str(occt("TCollection").TCollection_AsciiString(found.Get(), "\0").ToCString())
    except UnicodeDecodeError:
        return ""
    return "".join(c for c in raw if c.isprintable()).strip()[:200]


def _pose(shapes: Any, label: Any) -> np.ndarray:
    turn = shapes.GetLocation_s(label).Transformation()
    X = np.eye(4)
    for row in range(3):
        for column in range(4):
            X[row, column] = turn.Value(row + 1, column + 1)
    X[:3, 3] /= MM
    return X


class _Wrapped:
    """A shape as `solid_mass` takes it."""

    def __init__(self, shape: Any) -> None:
        self.wrapped = shape


def _prototype(document: Any, shapes: Any, label: Any) -> DrawnPart:
    """Measure a part, in its own frame."""
    shape, name = shapes.GetShape_s(label), _name(label)
    vertices, faces = _triangles(shape)
    solid = None
    if _explorer(shape, "SOLID").More():
        solid = solid_mass(_Wrapped(shape), 1.0)
    cylinders = _cylinders(shape)
    numbers = [vertices] + [np.r_[c.point, c.direction, c.radius, c.area] for c in cylinders]
    if solid is not None:
        numbers += [np.array(solid.mass), solid.com, solid.inertia]
    if not all(np.isfinite(array).all() for array in numbers):
        raise Refused(f"has a part {name} with measures that are not finite")
    look = Part(vertices, faces, _color(document, label, shape), name) if len(faces) else None
    if solid is not None and not solid.mass > 0:
        solid = None
    return DrawnPart("", name, np.eye(4), solid, look, cylinders)


def _explorer(shape: Any, kind: str) -> Any:
    enum = occt("TopAbs").TopAbs_ShapeEnum
    return occt("TopExp").TopExp_Explorer(shape, getattr(enum, f"TopAbs_{kind}"))


def _faces(shape: Any) -> Iterator[Any]:
    explorer = _explorer(shape, "FACE")
    while explorer.More():
        yield occt("TopoDS").TopoDS.Face(explorer.Current())
        explorer.Next()


def _triangles(shape: Any) -> tuple[np.ndarray, np.ndarray]:
    """Corners [m] and triangles, counter-clockwise from outside."""
    occt("BRepMesh").BRepMesh_IncrementalMesh(shape, TOLERANCE, False, ANGULAR_TOLERANCE, False)
    corners: list[tuple[float, float, float]] = []
    triangles: list[tuple[int, int, int]] = []
    backwards = occt("TopAbs").TopAbs_Orientation.TopAbs_REVERSED
    for face in _faces(shape):
        place = occt("TopLoc").TopLoc_Location()
        mesh = occt("BRep").BRep_Tool.Triangulation_s(face, place)
        if mesh is None:
            continue
        turn = place.Transformation()
        first = len(corners) - 1
        for number in range(1, mesh.NbNodes() + 1):
            point = mesh.Node(number).Transformed(turn)
            corners.append((point.X(), point.Y(), point.Z()))
        flipped = face.Orientation() == backwards
        for number in range(1, mesh.NbTriangles() + 1):
            triangle = mesh.Triangle(number)
            a, b, c = (first + triangle.Value(corner) for corner in (1, 2, 3))
            triangles.append((a, c, b) if flipped else (a, b, c))
    return np.array(corners).reshape(-1, 3) / MM, np.array(triangles, dtype=int).reshape(-1, 3)


def _cylinders(shape: Any) -> tuple[Cylinder, ...]:
    """Find the cylindrical faces of a part."""
    found = []
    kind = occt("GeomAbs").GeomAbs_SurfaceType.GeomAbs_Cylinder
    for face in _faces(shape):
        surface = occt("BRepAdaptor").BRepAdaptor_Surface(face)
        if surface.GetType() != kind:
            continue
        cylinder = surface.Cylinder()
        point, direction = cylinder.Axis().Location(), cylinder.Axis().Direction()
        properties = occt("GProp").GProp_GProps()
        occt("BRepGProp").BRepGProp.SurfaceProperties_s(face, properties)
        found.append(
            Cylinder(
                np.array([point.X(), point.Y(), point.Z()]) / MM,
                np.array([direction.X(), direction.Y(), direction.Z()]),
                cylinder.Radius() / MM,
                properties.Mass() / MM**2,
            )
        )
    return tuple(found)


def _color(document: Any, label: Any, shape: Any) -> tuple[float, float, float, float]:
    """Return the part's own colour, or that of its first coloured solid or face."""
    xcaf, quantity = occt("XCAFDoc"), occt("Quantity")
    colors = xcaf.XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    found = quantity.Quantity_ColorRGBA()
    kinds = (xcaf.XCAFDoc_ColorSurf, xcaf.XCAFDoc_ColorGen, xcaf.XCAFDoc_ColorCurv)

    def known(get: Any, what: Any) -> bool:
        return any(get(what, kind, found) for kind in kinds)

    if not known(xcaf.XCAFDoc_ColorTool.GetColor_s, label):
        solids = _explorer(shape, "SOLID")
        pieces = [solids.Current()] if solids.More() else []
        if not any(known(colors.GetColor, piece) for piece in (shape, *pieces, *_faces(shape))):
            return GREY
    rgb = found.GetRGB()
    # The kernel keeps linear light; files and screens mean sRGB.
    linear = np.array([rgb.Red(), rgb.Green(), rgb.Blue()])
    s = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    r, g, b = (float(c) for c in np.clip(s, 0, 1))
    return r, g, b, float(found.Alpha())


if __name__ == "__main__":
    sys.exit(main(str(Path(sys.argv[1])), sys.argv[2]))
