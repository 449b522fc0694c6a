"""STEP files out: an assembly with names, hierarchy and colours."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from phasmid.cad.assembly import Assembly, Solid, location
from phasmid.cad.library import build123d, occt
from phasmid.cad.reader import step_of, unique
from phasmid.errors import OutputError
from phasmid.recording.file import write_whole


def write_step(assembly: Assembly, path: Path) -> None:
    """Write an assembly as a STEP file, which is overwritten; as `step_text`.

    Raises:
        OutputError: It cannot be written.
        PhasmidError: build123d is not installed.
    """
    write_whole(path, step_text(assembly))


def step_text(assembly: Assembly) -> bytes:
    """Write an assembly as STEP: the robot, its ``body`` and legs, their links, and their parts.

    Each distinct part is written once and placed as often as it is needed.

    Raises:
        OutputError: The kernel cannot write it.
        PhasmidError: build123d is not installed.
    """
    document = _document()
    shapes = occt("XCAFDoc").XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    robot = _assembly(shapes, assembly.name)
    made: dict[int, Any] = {}
    legs: dict[str, Any] = {}
    for link, parts in assembly.links.items():
        group = _assembly(shapes, link.rpartition(".")[2])
        for placed in parts:
            solid = placed.solid
            if id(solid) not in made:
                made[id(solid)] = _part(document, shapes, solid)
            _place(shapes, group, made[id(solid)], placed.name, placed.X_link_part)
        leg, _, joint = link.rpartition(".")
        owner = robot
        if leg:
            if leg not in legs:
                legs[leg] = _assembly(shapes, leg)
                _place(shapes, robot, legs[leg], leg, np.eye(4))
            owner = legs[leg]
        _place(shapes, owner, group, joint, assembly.poses[link])
    shapes.UpdateAssemblies()
    return _text(document, assembly.name)


def part_paths(assembly: Assembly) -> dict[str, tuple[str, ...]]:
    """Return the path of each part by link, as `read_drawing` finds it in the assembly's STEP file.

    Args:
        assembly: The solids; ``body`` comes first in it.
    """
    taken: set[str] = set()
    owners: dict[str, str] = {}
    paths: dict[str, tuple[str, ...]] = {}
    for link, parts in assembly.links.items():
        leg, _, joint = link.rpartition(".")
        if leg and leg not in owners:
            owners[leg] = unique(step_of(leg), taken)
        above = unique(f"{owners[leg]}/{joint}" if leg else joint, taken)
        paths[link] = tuple(unique(f"{above}/{step_of(part.name)}", taken) for part in parts)
    return paths


def _document() -> Any:
    document = occt("TDocStd").TDocStd_Document(_text_of("XmlOcaf"))
    application = occt("XCAFApp").XCAFApp_Application.GetApplication_s()
    application.NewDocument(_text_of("MDTV-XCAF"), document)
    application.InitDocument(document)
    xcaf = occt("XCAFDoc")
    xcaf.XCAFDoc_DocumentTool.SetLengthUnit_s(document, 0.001)
    xcaf.XCAFDoc_ShapeTool.SetAutoNaming_s(False)
    return document


def _text_of(name: str) -> Any:
    return occt("TCollection").TCollection_ExtendedString(name, True)


def _assembly(shapes: Any, name: str) -> Any:
    label = shapes.NewShape()
    _name(label, name)
    return label


def _name(label: Any, name: str) -> None:
    occt("TDataStd").TDataStd_Name.Set_s(label, _text_of(name))


def _part(document: Any, shapes: Any, solid: Solid) -> Any:
    """Return a distinct part with its name, colour and density."""
    label = shapes.AddShape(_in_place(solid.shape.wrapped), False, False)
    _name(label, solid.name)
    xcaf, quantity = occt("XCAFDoc"), occt("Quantity")
    colors = xcaf.XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    r, g, b, a = solid.material.color
    rgb = quantity.Quantity_Color(r, g, b, quantity.Quantity_TOC_sRGB)
    color = quantity.Quantity_ColorRGBA(rgb, a)
    colors.SetColor(label, color, xcaf.XCAFDoc_ColorSurf)
    return label


def _place(shapes: Any, owner: Any, part: Any, name: str, X: Float[np.ndarray, "4 4"]) -> None:
    component = shapes.AddComponent(owner, part, location(X).wrapped)
    _name(component, name)


def _text(document: Any, name: str) -> bytes:
    """Return the document as the text of a STEP file."""
    build123d()  # Its controllers of formats are set up with it.
    control = occt("STEPCAFControl")
    control.STEPCAFControl_Controller.Init_s()
    static = occt("Interface").Interface_Static
    static.SetCVal_s("write.step.unit", "MM")
    message = occt("Message").Message.DefaultMessenger_s()
    message.RemovePrinters(occt("Message").Message_PrinterOStream.get_type_descriptor_s())
    writer = control.STEPCAFControl_Writer()
    writer.SetColorMode(True)
    writer.SetNameMode(True)
    header = occt("APIHeaderSection").APIHeaderSection_MakeHeader(writer.Writer().Model())
    if not header.IsDone():
        header = occt("APIHeaderSection").APIHeaderSection_MakeHeader(0)
        header.Apply(writer.Writer().Model())
    for put, word in ((header.SetName, name), (header.SetOriginatingSystem, "phasmid")):
        plain = "".join(c for c in word if c.isascii() and c.isprintable())
        put(occt("TCollection").TCollection_HAsciiString(plain))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.step"
        writer.Transfer(document, occt("STEPControl").STEPControl_AsIs)
        done = writer.Write(str(file))
        if done != occt("IFSelect").IFSelect_RetDone:
            raise OutputError(f"the solids of {name} cannot be written as a STEP file.")
        return file.read_bytes()


def _in_place(shape: Any) -> Any:
    """Return a shape without its own pose, with which it would become an assembly of one part."""
    pose = shape.Location()
    if pose.IsIdentity():
        return shape
    bare = shape.Located(occt("TopLoc").TopLoc_Location())
    return (
        occt("BRepBuilderAPI").BRepBuilderAPI_Transform(bare, pose.Transformation(), True).Shape()
    )
