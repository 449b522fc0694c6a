"""``python -m phasmid.cad.reader FILE OUT`` reads a STEP file in a process of its own.

The geometry kernel can crash, loop or eat memory over a damaged file; here only this process does.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from phasmid.cad.assembly import MM, solid_mass
from phasmid.cad.library import occt

MOST_PARTS = 4000
"""Files of more placed parts than this are refused."""

MOST_TRIANGLES = 4_000_000
"""Files whose solids make more triangles than this are refused."""

MOST_LEVELS = 32
"""Assemblies in assemblies deeper than this are refused."""

TOO_MANY = 3
"""Exit status for a file over one of these limits; its sentence is printed."""

NO_STEP = 4
"""Exit status for a file that holds no shapes."""

MEMORY = 12_000_000_000
"""Most address space that the process may take [B], where the system can limit it."""

GENERIC = ("", "NAUO", "=>", "Open CASCADE", "NONE", "SOLID", "COMPOUND")
"""Beginnings of names that some program made up."""


class Refused(Exception):
    """A file over a limit, or one without shapes."""

    def __init__(self, status: int, sentence: str) -> None:
        super().__init__(sentence)
        self.status = status


def main(file: str, out: str) -> int:
    """Read a file and write what is in it; returns the exit status."""
    _limit_memory()
    try:
        arrays, told = _read(file)
    except Refused as refused:
        print(refused, flush=True)  # noqa: T201
        return refused.status
    arrays["told"] = np.frombuffer(json.dumps(told).encode(), dtype=np.uint8)
    np.savez(out, **arrays)  # type: ignore[arg-type]
    return 0


def _limit_memory() -> None:
    with suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _read(file: str) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    document, shapes = _opened(file)
    prototypes: dict[str, int] = {}
    arrays: dict[str, np.ndarray] = {}
    told: dict[str, Any] = {"prototypes": [], "parts": []}
    triangles = 0
    for path, label, X in _leaves(shapes):
        if len(told["parts"]) >= MOST_PARTS:
            raise Refused(TOO_MANY, f"holds more than {MOST_PARTS} parts")
        key = _entry(label)
        if key not in prototypes:
            number = prototypes[key] = len(prototypes)
            facts, found = _prototype(document, shapes, label)
            told["prototypes"].append(facts)
            arrays |= {f"{noun}{number}": array for noun, array in found.items()}
            triangles += len(found["faces"])
            if triangles > MOST_TRIANGLES:
                raise Refused(TOO_MANY, f"makes more than {MOST_TRIANGLES} triangles")
        number = len(told["parts"])
        told["parts"].append({"path": path, "prototype": prototypes[key]})
        arrays[f"X{number}"] = X
    if not told["parts"]:
        raise Refused(NO_STEP, "holds no solids")
    return arrays, told


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
    static = occt("Interface").Interface_Static
    static.SetIVal_s("read.stepcaf.subshapes.name", 1)
    if reader.ReadFile(file) != occt("IFSelect").IFSelect_RetDone:
        raise Refused(NO_STEP, "is no STEP file, or a damaged one")
    if files := _other_files(reader):
        raise Refused(
            NO_STEP, f"has parts in other files, such as {files[0]}; write all parts into one"
        )
    if not reader.Transfer(document):
        raise Refused(NO_STEP, "holds no shapes that can be read")
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
        raise Refused(TOO_MANY, f"holds assemblies more than {MOST_LEVELS} deep")
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
    """A name as a step of a path."""
    return name.replace("/", "_")


def unique(path: str, taken: set[str]) -> str:
    """A path, numbered where it is taken; it is taken from now on."""
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


def _prototype(
    document: Any, shapes: Any, label: Any
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    shape = shapes.GetShape_s(label)
    facts: dict[str, Any] = {
        "name": _name(label),
        "color": _color(document, label, shape),
        "solid": _explorer(shape, "SOLID").More(),
    }
    vertices, faces = _triangles(shape)
    mass = np.zeros(13)
    if facts["solid"]:
        found = solid_mass(_Wrapped(shape), 1.0)
        mass = np.r_[found.mass, found.com, found.inertia.ravel()]
    cylinders, names = _cylinders(shapes, label, shape)
    facts["faces"] = names
    found_arrays = {
        "vertices": vertices,
        "faces": faces,
        "mass": mass,
        "cylinders": cylinders,
    }
    return facts, found_arrays


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
    from phasmid.cad.meshes import ANGULAR_TOLERANCE, TOLERANCE

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


def _cylinders(shapes: Any, label: Any, shape: Any) -> tuple[np.ndarray, list[str]]:
    """A point on the axis [m], its direction, the radius [m] and the area [m²] of each face."""
    rows, names = [], []
    kind = occt("GeomAbs").GeomAbs_SurfaceType.GeomAbs_Cylinder
    for face in _faces(shape):
        surface = occt("BRepAdaptor").BRepAdaptor_Surface(face)
        if surface.GetType() != kind:
            continue
        cylinder = surface.Cylinder()
        axis = cylinder.Axis()
        point, way = axis.Location(), axis.Direction()
        found = occt("GProp").GProp_GProps()
        occt("BRepGProp").BRepGProp.SurfaceProperties_s(face, found)
        spot = [c / MM for c in (point.X(), point.Y(), point.Z())]
        rows.append(
            [*spot, way.X(), way.Y(), way.Z(), cylinder.Radius() / MM, found.Mass() / MM**2]
        )
        sub = occt("TDF").TDF_Label()
        names.append(_name(sub) if shapes.FindSubShape(label, face, sub) else "")
    return np.array(rows).reshape(-1, 8), names


def _color(document: Any, label: Any, shape: Any) -> list[float] | None:
    """The part's own colour, or that of its largest coloured solid or face."""
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
            return None
    rgb = found.GetRGB()
    # The kernel keeps linear light; files and screens mean sRGB.
    linear = np.array([rgb.Red(), rgb.Green(), rgb.Blue()])
    s = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return [*(float(c) for c in np.clip(s, 0, 1)), float(found.Alpha())]


if __name__ == "__main__":
    sys.exit(main(str(Path(sys.argv[1])), sys.argv[2]))
