"""MJCF files made harmless: one text of what a robot is, with its meshes, for the engine."""

from __future__ import annotations

import hashlib
import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from phasmid.errors import InvalidInput, located
from phasmid.formats import meshes
from phasmid.formats.files import named_file
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.mjcf_includes import expand_includes
from phasmid.formats.options import ImportOptions
from phasmid.formats.urdf_out import stl
from phasmid.formats.xml import Element, load_xml, short
from phasmid.robot import Part

MOST_KEPT = 2000
"""Models of more elements than this, which the engine would read, are no robots."""

LARGEST_NUMBER = 1e10
"""Numbers above this are slips or attacks; the largest honest ones are stiffnesses."""

MOST_STL_FACES = 200_000
"""The engine refuses STL files of more faces."""

EXTENSION = "phasmid"
"""Name of the text element that carries what MJCF cannot say."""

_TRANSMISSIONS = {"joint", "jointinparent"}

_ACTUATORS = {
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
}

_BODIES = {"body", "frame", "inertial", "joint", "freejoint", "geom", "site"}

_READ = {
    "mujoco": {"compiler", "default", "asset", "worldbody", "actuator"},
    "compiler": set[str](),
    "default": {"default", "geom", "joint", "site", "mesh", "material", *_ACTUATORS},
    "asset": {"mesh", "material"},
    "worldbody": {"body", "frame"},
    "body": _BODIES,
    "frame": _BODIES,
    "actuator": _ACTUATORS,
}
"""What the engine gets to read of each element."""

_SILENT = {
    "mujoco": {"option", "size", "visual", "statistic", "custom"},
    "compiler": {"lengthrange"},
    "default": {"camera", "light", "pair", "equality", "tendon", "adhesion", "dcmotor"},
    "asset": {"texture", "model"},
    "worldbody": {"light", "camera", "geom", "site"},
    "body": {"light", "camera"},
    "frame": {"light", "camera"},
    "material": {"layer"},
}
"""What says nothing about a robot, of which no word is lost."""

_SECTIONS = {"equality", "tendon", "sensor", "keyframe", "contact", "deformable"}
"""Sections whose entries are counted under the section's name."""

SIMMECHANICS = {"PhysicalModelingXMLFile", "SimscapeMultibodyImportXML"}
"""Root elements of what CAD programs export for SimMechanics and its successor."""

_REFUSED = {"attach", "replicate"}
"""What makes more of a robot than the file says."""

_LOST = {
    "compiler": {
        "meshdir",
        "texturedir",
        "assetdir",
        "strippath",
        "fusestatic",
        "discardvisual",
        "usethread",
    },
    "material": {"texture"},
}
"""Attributes that the engine does not get."""

_WORDS = {
    "name",
    "class",
    "childclass",
    "type",
    "mesh",
    "material",
    "joint",
    "jointinparent",
    "file",
    "angle",
    "eulerseq",
    "limited",
    "inertia",
    "shape",
}
"""Attributes that hold words and may look like numbers, as the name ``nan`` does."""


@dataclass(eq=False)
class Checked:
    """A model's file, with all that it includes, as the engine may read it.

    Attributes:
        name: Of the model; empty where the file gives none.
        root: What is read, includes replaced by what they hold; bodies and joints have names.
        text: The model for the engine, one element on each line.
        lines: The element on each line.
        files: Meshes by the names that the text gives them.
        extension: What phasmid added, of which the engine knows nothing.
        findings: What was left out.
        incomplete: Names of bodies of which a mesh was left out.
    """

    name: str
    root: Element
    text: str
    lines: list[Element]
    files: dict[str, bytes]
    extension: str
    findings: list[Finding]
    incomplete: frozenset[str] = frozenset()

    def where(self, line: int) -> str:
        """File and line of what stands on a line of the text, from 1; empty beyond it."""
        return self.lines[line - 1].where if 0 < line <= len(self.lines) else ""


def escaped(extension: str) -> str:
    """A text on one line; MuJoCo itself would keep line ends only until it saves the file."""
    return extension.replace("\\", "\\\\").replace("\n", "\\n").replace("\r", "\\r")


def unescaped(data: str) -> str:
    """The text that `escaped` put on one line."""
    kinds = {"\\n": "\n", "\\r": "\r", "\\\\": "\\"}
    return re.sub(r"\\[nr\\]", lambda found: kinds[found.group()], data)


def check_mjcf(path: Path, options: ImportOptions) -> Checked:
    """Read an MJCF file and its includes and meshes, none of them from outside its folder.

    Args:
        path: The file.
        options: Where packages lie, the unit of meshes, and whether anything may be ignored.

    Raises:
        InvalidInput: A file cannot be read, includes go in a circle, a name leads outside the
            folder, or a number cannot be used.
    """
    root = load_xml(path)
    if root.tag in SIMMECHANICS:
        raise InvalidInput(
            f"{root.file} line {root.line}: the file holds a <{short(root.tag)}> of SimMechanics, "
            "which is not read; robots are read from URDF, a <robot>, and MJCF, a <mujoco>.",
            hint="export the assembly as URDF or STEP",
        )
    if root.tag != "mujoco":
        raise InvalidInput(
            f"{root.file} line {root.line}: the file holds a <{short(root.tag)}>; "
            "an MJCF file holds a <mujoco>."
        )
    expand_includes(root, path, options)
    checker = _Checker(path, options)
    kept = checker.keep(root)
    checker.name_all(kept)
    checker.add_meshes(kept, _mesh_folder(root))
    extension = _extension(root)
    checker.count_ignored(own=bool(extension))
    lines: list[Element] = []
    text = "\n".join(_written(kept, lines))
    return Checked(
        root.attributes.get("model", ""),
        kept,
        text,
        lines,
        checker.files,
        extension,
        checker.findings,
        frozenset(checker.incomplete),
    )


@dataclass
class _Checker:
    """One model being checked."""

    path: Path
    options: ImportOptions
    files: dict[str, bytes] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    ignored: Counter[str] = field(default_factory=Counter)
    incomplete: set[str] = field(default_factory=set)
    kept: int = 0

    def keep(self, element: Element) -> Element:
        """A copy of what the engine may read; the rest is counted."""
        self._check(element)
        self.kept += 1
        if self.kept > MOST_KEPT:
            raise InvalidInput(
                f"{self.path.name} describes more than {MOST_KEPT} bodies, shapes and other "
                "things; such models are refused."
            )
        lost = _LOST.get(element.tag, set())
        kept = Element(
            element.tag,
            {key: value for key, value in element.attributes.items() if key not in lost},
            element.file,
            element.line,
        )
        read, silent = _READ.get(element.tag, set()), _SILENT.get(element.tag, set())
        for child in element.children:
            if child.tag in _REFUSED:
                raise InvalidInput(
                    f"<{child.tag}> is not read.",
                    where=child.where,
                    hint="open the file in MuJoCo and save it there, which writes it out",
                )
            if child.tag in read and not _is_foreign(child, element.tag):
                kept.children.append(self.keep(child))
            elif child.tag in _SECTIONS and element.tag == "mujoco":
                self.ignored[child.tag] += len(child.children)
            elif child.tag not in silent:
                self.ignored[child.tag] += 1
        return kept

    def _check(self, element: Element) -> None:
        for key, value in element.attributes.items():
            if key in {"name", "class", "childclass"} and value:
                element.need_name(key)
            if key in _WORDS:
                continue
            for word in value.split():
                try:
                    number = float(word)
                except ValueError:
                    continue
                if not math.isfinite(number):
                    raise InvalidInput(
                        f'{element.shown}: {key} is "{short(value, 60)}"; '
                        "all numbers must be finite.",
                        where=element.where,
                    )
                if abs(number) > LARGEST_NUMBER:
                    raise InvalidInput(
                        f'{element.shown}: {key} is "{short(value, 60)}"; '
                        f"numbers above {LARGEST_NUMBER:g} are refused.",
                        where=element.where,
                    )
        if element.tag == "joint" and len(element.attributes.get("range", "").split()) == 2:
            lower, upper = element.numbers("range", 2, largest=LARGEST_NUMBER)
            if lower > upper:
                raise InvalidInput(
                    f"{element.shown}: its lower limit {lower:.6g} lies above the upper "
                    f"{upper:.6g}.",
                    where=element.where,
                    hint="swap them",
                )

    def name_all(self, root: Element) -> None:
        """Give names to bodies and joints without one."""
        elements = list(root.walk())
        for noun, tags in (("body", {"body"}), ("joint", {"joint", "freejoint"})):
            worlds = [world for section in root.all("worldbody") for world in section.walk()]
            there = [element for element in worlds if element.tag in tags]
            taken = {element.attributes.get("name", "") for element in elements}
            number = 0
            for element in there:
                while not element.attributes.get("name"):
                    number += 1
                    if f"{noun}_{number}" not in taken:
                        element.attributes["name"] = f"{noun}_{number}"

    def add_meshes(self, root: Element, folder: str) -> None:
        """Read the mesh files; geoms of those that are not there are left out."""
        reader = meshes.MeshFiles(self.options.mesh_unit)
        scales = dict(_mesh_scales(root))
        absent: set[str] = set()
        for asset in root.all("asset"):
            for mesh in asset.all("mesh"):
                name = mesh.attributes.get("name") or _stem(mesh.attributes.get("file", ""))
                mesh.attributes["name"] = name
                if not self._add_mesh(mesh, reader, folder, scales):
                    absent.add(name)
            asset.children = [
                child
                for child in asset.children
                if child.tag != "mesh" or child.attributes["name"] not in absent
            ]
        for element in root.walk():
            if element.tag == "mesh":
                element.attributes.pop("scale", None)
            kept = [
                child
                for child in element.children
                if child.tag != "geom" or child.attributes.get("mesh") not in absent
            ]
            if len(kept) < len(element.children):
                self.incomplete.add(element.attributes.get("name", ""))
            element.children = kept

    def _add_mesh(
        self,
        mesh: Element,
        reader: meshes.MeshFiles,
        folder: str,
        scales: dict[str, list[float]],
    ) -> bool:
        written = mesh.attributes.get("file", "").strip()
        default = scales.get(mesh.attributes.get("class", ""), scales[""])
        scale = mesh.numbers("scale", 3, default)
        if 0.0 in scale:
            raise InvalidInput("<mesh>: a scale of 0 leaves nothing.", where=mesh.where)
        if not written:
            what = f"{mesh.shown} names no file; it was left out."
            self._note(Severity.SUSPECT, mesh, what)
            return False
        with located(mesh.where):
            named = written if "://" in written or not folder else f"{folder}/{written}"
            try:
                path = named_file(self.path, named, "mesh", self.options.packages)
            except InvalidInput as error:
                # The name as it is written, without the folder that another element gives.
                error.what = error.what.replace(f'"{named}"', f'"{written}"')
                error.args = (error.what,)
                raise
            if not path.is_file():
                self._note(
                    Severity.SUSPECT,
                    mesh,
                    f'mesh "{short(written)}" is not there; it was left out.',
                )
                return False
            try:
                found = reader.meshes(path, scale)
            except meshes.UnreadMesh as error:
                self._note(Severity.SUSPECT, mesh, error.what, error.hint)
                return False
            starts = np.cumsum([0, *(len(each.vertices) for each in found)])
            faces = [each.faces + start for each, start in zip(found, starts, strict=False)]
            part = Part(np.concatenate([each.vertices for each in found]), np.concatenate(faces))
            if len(part.faces) > MOST_STL_FACES:
                raise InvalidInput(
                    f"mesh {path.name} has {len(part.faces)} faces; the engine takes "
                    f"{MOST_STL_FACES}."
                )
            raw = stl(part)
        # The engine keeps files by their names, even if they have changed.
        name = f"{hashlib.sha256(raw).hexdigest()[:32]}.stl"
        self.files[name] = raw
        mesh.attributes["file"] = name
        return True

    def _note(self, severity: Severity, mesh: Element, what: str, hint: str = "") -> None:
        subject = f"mesh {short(mesh.attributes.get('name', ''))}"
        self.findings.append(Finding(severity, subject, what, mesh.where, hint))

    def count_ignored(self, *, own: bool) -> None:
        """Say what was not read, or refuse it where nothing may be ignored."""
        if own:
            # Our export adds them for MuJoCo's users; the robot itself knows both.
            del self.ignored["sensor"], self.ignored["keyframe"]
        if not self.ignored.total():
            return
        counted = [(tag, n) for tag, n in sorted(self.ignored.items()) if n]
        listed = ", ".join(f"{n} <{short(tag, 40)}>" for tag, n in counted[:20])
        what = f"{listed} {'was' if self.ignored.total() == 1 else 'were'} ignored."
        if self.options.strict:
            raise InvalidInput(what, where=self.path.name, hint="leave --strict out")
        name = self.path.name
        self.findings.append(Finding(Severity.NOTE, f"file {name}", what, name))


def _is_foreign(element: Element, parent: str) -> bool:
    """Whether a geom or an actuator hangs on something that is not read."""
    if element.tag == "geom":
        kind = element.attributes.get("type")
        return kind in {"hfield", "sdf"} or "hfield" in element.attributes
    return parent == "actuator" and not _TRANSMISSIONS & set(element.attributes)


def _mesh_folder(root: Element) -> str:
    """The folder in which meshes lie, from that of the file."""
    folders = {"assetdir": "", "meshdir": ""}
    for compiler in root.all("compiler"):
        folders |= {key: compiler.attributes[key] for key in folders if key in compiler.attributes}
    return folders["meshdir"] or folders["assetdir"]


def _mesh_scales(root: Element) -> Iterator[tuple[str, list[float]]]:
    """Scales of meshes by class; the class without a name is that of all."""
    pending: list[tuple[Element, list[float]]] = [(top, [1.0] * 3) for top in root.all("default")]
    yield "", [1.0] * 3
    tops = {id(top) for top, _ in pending}
    while pending:
        element, scale = pending.pop()
        mesh = element.find("mesh")
        if mesh is not None:
            scale = mesh.numbers("scale", 3, scale)
            if 0.0 in scale:
                raise InvalidInput("<mesh>: a scale of 0 leaves nothing.", where=mesh.where)
        if id(element) in tops:
            yield "", scale
        yield element.attributes.get("class", "main"), scale
        pending += [(child, scale) for child in element.all("default")]


def _extension(root: Element) -> str:
    # MuJoCo itself saves it as the element's text.
    found = [
        text.attributes.get("data", text.text)
        for custom in root.all("custom")
        for text in custom.all("text")
        if text.attributes.get("name") == EXTENSION
    ]
    if len(found) > 1:
        raise InvalidInput(f'<text name="{EXTENSION}"> is there twice.', where=root.file)
    return unescaped(found[0]) if found else ""


def _stem(file: str) -> str:
    return file.replace("\\", "/").rpartition("/")[2].rpartition(".")[0]


def _written(element: Element, lines: list[Element]) -> Iterator[str]:
    """The text of an element, each start or end on a line of its own."""
    attributes = "".join(f" {key}={quoteattr(value)}" for key, value in element.attributes.items())
    # Attributes of several lines would shift the count.
    attributes = attributes.replace("\n", " ").replace("\r", " ")
    lines.append(element)
    if not element.children:
        yield f"<{element.tag}{attributes}/>"
        return
    yield f"<{element.tag}{attributes}>"
    for child in element.children:
        yield from _written(child, lines)
    lines.append(element)
    yield f"</{element.tag}>"
