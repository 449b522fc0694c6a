"""URDF files in: links, joints and meshes as a kinematic tree, with notes on omissions."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, located, nearest
from phasmid.formats import meshes
from phasmid.formats.files import named_file
from phasmid.formats.findings import Findings
from phasmid.formats.options import ImportOptions
from phasmid.formats.origins import ENDLESS, WHOLE_TURN, pose_of
from phasmid.formats.tree import Tree, TreeJoint, TreeLink
from phasmid.formats.xml import Element, load_xml, short
from phasmid.robot import Part
from phasmid.robot.inertial import Inertial
from phasmid.units import plain_number

KINDS = ("revolute", "continuous", "fixed", "prismatic", "floating", "planar")
"""Joints of URDF."""

GREY = (0.5, 0.5, 0.5, 1.0)

_KNOWN = {
    "robot": {"link", "joint", "material", "mujoco"},
    "link": {"inertial", "visual", "collision"},
    "inertial": {"origin", "mass", "inertia"},
    "visual": {"origin", "geometry", "material"},
    "geometry": {"box", "cylinder", "sphere", "capsule", "mesh"},
    "material": {"color"},
    "joint": {"origin", "parent", "child", "axis", "limit", "dynamics", "phasmid"},
}
"""Elements that are read, by their parent; others are counted. Collisions have the elements of
visuals, and settings of MuJoCo are not missed."""

OWN_SHAPE = "phasmid_"
"""So begin the names of shapes that our export adds; they are no part of the robot."""

UNLIMITED = 1e9
"""Efforts and speeds from here on mean no limit [N·m, rad/s]."""


def read_urdf(path: Path, options: ImportOptions | None = None) -> Tree:
    """Return the kinematic tree of a URDF file.

    Args:
        path: The file.
        options: Where packages lie and in which unit meshes are.

    Raises:
        InvalidInput: The file cannot be read, or a number in it cannot be used.
        InvalidRobot: Its links and joints form no tree.
    """
    options = options or ImportOptions()
    root = load_xml(path)
    _check_root(root)
    reader = _Reader(path, root, options)
    links = [reader.link(element) for element in root.all("link")]
    twice = [name for name, count in Counter(link.name for link in links).items() if count > 1]
    if twice:
        again = [link for link in links if link.name == twice[0]][1]
        raise InvalidInput(f"two links are called {twice[0]}.", where=again.where)
    joints = tuple(reader.joint(element) for element in root.all("joint"))
    reader.count_ignored()
    return Tree(
        root.need_name() if "name" in root.attributes else path.stem,
        {link.name: link for link in links},
        joints,
        file=path.name,
        findings=tuple(reader.findings),
    )


def _check_root(root: Element) -> None:
    for element in root.walk():
        if element.tag.startswith("xacro:"):
            raise InvalidInput(
                f"{element.file} line {element.line}: <{short(element.tag)}> is not expanded.",
                hint="run xacro first: xacro robot.urdf.xacro > robot.urdf",
            )
    if root.tag != "robot":
        raise InvalidInput(
            f"{root.file} line {root.line}: the file holds a <{short(root.tag)}>; "
            "a URDF file holds a <robot>.",
        )


@dataclass
class _Reader:
    """File being read: its materials, meshes and findings."""

    path: Path
    root: Element
    options: ImportOptions
    findings: Findings = field(default_factory=Findings)
    files: meshes.MeshFiles = field(init=False)
    colors: dict[str, meshes.Color] = field(default_factory=dict)
    missing: set[tuple[str, str]] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.files = meshes.MeshFiles(self.options.mesh_unit)
        # A material may be defined in one link and named in another; the robot's own count first.
        own = self.root.all("material")
        local = [
            material
            for link in self.root.all("link")
            for visual in link.all("visual")
            for material in visual.all("material")
        ]
        for material in own + local:
            color = material.find("color")
            if color is not None and "name" in material.attributes:
                self.colors.setdefault(material.attributes["name"], _rgba(color))

    def link(self, element: Element) -> TreeLink:
        name = element.need_name()
        inertial = element.find("inertial")
        parts = self._parts(element, "visual")
        if not parts and element.find("collision") is not None:
            parts = self._parts(element, "collision")
            if parts:
                why = "no visual one was read" if element.find("visual") else "it has no visual one"
                what = f"shows its collision shape, as {why}."
                self.findings.note(f"link {name}", what, element.where)
        return TreeLink(
            name,
            None if inertial is None else self._inertial(inertial, name),
            parts,
            element.where,
            _balls(element),
            complete=all(subject != f"link {name}" for subject, _ in self.missing),
        )

    def _inertial(self, element: Element, link: str) -> Inertial:
        mass = element.find("mass")
        moments = element.find("inertia")
        I = np.zeros((3, 3))
        if moments is not None:
            for i, j, key in (
                (0, 0, "ixx"),
                (1, 1, "iyy"),
                (2, 2, "izz"),
                (0, 1, "ixy"),
                (0, 2, "ixz"),
                (1, 2, "iyz"),
            ):
                I[i, j] = I[j, i] = moments.number(key)
        for part, tag in ((mass, "mass"), (moments, "inertia")):
            if part is None:
                what = f"link {link} has an <inertial> without <{tag}>; 0 was taken."
                hint = "--masses geometry" if tag == "inertia" else ""
                self.findings.suspect(f"link {link}", what, element.where, hint)
        X = pose_of(element.find("origin"))
        R = X[:3, :3]
        if not np.array_equal(R, np.eye(3)):
            I = R @ I @ R.T
            I = (I + I.T) / 2
        return Inertial(mass.number("value") if mass is not None else 0.0, X[:3, 3].copy(), I)

    def _parts(self, link: Element, tag: str) -> tuple[Part, ...]:
        parts: list[Part] = []
        for look in link.all(tag):
            geometry = look.find("geometry")
            if geometry is None or not geometry.children:
                continue
            name = look.attributes.get("name", "")
            if name.startswith(OWN_SHAPE):
                continue
            # Our export puts the link and a number before the name of a part.
            name = re.sub(rf"^{re.escape(link.need_name())}/\d+/", "", name)
            X = pose_of(look.find("origin"))
            color = self._color(look.find("material"))
            with located(look.where):
                for mesh in self._shapes(geometry.children[0], link):
                    shown = color or mesh.color or GREY
                    part = Part(
                        mesh.vertices, mesh.faces, shown, name if name.isprintable() else ""
                    )
                    parts.append(part if np.array_equal(X, np.eye(4)) else part.at(X))
        return tuple(parts)

    def _color(self, material: Element | None) -> meshes.Color | None:
        if material is None:
            return None
        color = material.find("color")
        if color is not None:
            return _rgba(color)
        return self.colors.get(material.attributes.get("name", ""))

    def _shapes(self, shape: Element, link: Element) -> tuple[meshes.Mesh, ...]:
        if shape.tag in {"box", "sphere", "cylinder", "capsule"}:
            made = (_primitive(shape),)
            self.files.count(made)
            return made
        if shape.tag != "mesh":
            return ()
        written = shape.need_text("filename")
        scale = shape.numbers("scale", 3, (1.0, 1.0, 1.0))
        if 0.0 in scale:
            raise InvalidInput("<mesh>: a scale of 0 leaves nothing.", where=shape.where)
        with located(shape.where):
            path = named_file(self.path, written, "mesh", self.options.packages)
            if not path.is_file():
                what = f'mesh "{short(written)}" is not there; it was left out.'
                self._miss(link, what, shape.where)
                return ()
            try:
                return self.files.meshes(path, scale)
            except meshes.UnreadMesh as error:
                self._miss(link, error.what, shape.where, error.hint)
                return ()

    def _miss(self, link: Element, what: str, where: str, hint: str = "") -> None:
        """Note a missing mesh once per link; equal findings are grouped later."""
        subject = f"link {link.need_name()}"
        if (subject, what) not in self.missing:
            self.missing.add((subject, what))
            self.findings.suspect(subject, what, where, hint)

    def joint(self, element: Element) -> TreeJoint:
        name = element.need_name()
        kind = element.need_text("type")
        if kind not in KINDS:
            guess = nearest(kind, KINDS)
            raise InvalidInput(
                f'joint {name}: type "{short(kind)}" is none of {", ".join(KINDS)}.',
                where=element.where,
                hint=f'type="{guess}"' if guess else "",
            )
        lower, upper, effort, velocity = self._limits(element, name, kind)
        damping, friction, armature = _dynamics(element, name)
        return TreeJoint(
            name,
            kind,
            element.need("parent").need_name("link"),
            element.need("child").need_name("link"),
            pose_of(element.find("origin")),
            self._axis(element.find("axis"), name, kind),
            lower,
            upper,
            effort,
            velocity,
            damping,
            friction,
            armature,
            element.where,
        )

    def _axis(self, element: Element | None, name: str, kind: str) -> Float[np.ndarray, "3"]:
        if kind in {"fixed", "floating"}:
            return np.array([0.0, 0.0, 1.0])
        axis = np.array([1.0, 0.0, 0.0])
        if element is not None:
            axis = np.array(element.numbers("xyz", 3, axis.tolist()))
        length = float(np.linalg.norm(axis))
        where = element.where if element is not None else ""
        if length < 1e-9:
            raise InvalidInput(f"joint {name}: its axis has no direction.", where=where)
        if abs(length - 1) > 1e-3:
            what = f"joint {name}: its axis has length {plain_number(length)}; it was made 1."
            self.findings.note(f"joint {name}", what, where)
        # A unit vector stays as it is, to the last digit.
        return axis if abs(length - 1) < 1e-15 else axis / length

    def _limits(
        self, element: Element, name: str, kind: str
    ) -> tuple[float, float, float | None, float | None]:
        limit = element.find("limit")
        lower, upper = -math.inf, math.inf
        effort = velocity = None
        if limit is not None:
            effort, velocity = _strength(limit, name, "effort"), _strength(limit, name, "velocity")
        if kind in {"revolute", "prismatic"}:
            if limit is None:
                what = f"no <limit>, which {kind} joints must have; it may move without end."
                self.findings.suspect(f"joint {name}", what, element.where)
            else:
                lower, upper = (
                    limit.number(key, 0.0, largest=math.inf) for key in ("lower", "upper")
                )
                if lower > upper:
                    raise InvalidInput(
                        f"joint {name}: its lower limit {lower:.6g} lies above the upper "
                        f"{upper:.6g}.",
                        where=limit.where,
                    )
        if kind == "revolute" and limit is not None:
            lower, upper = self._angles(limit, name, lower, upper)
        return lower, upper, effort, velocity

    def _angles(self, limit: Element, name: str, lower: float, upper: float) -> tuple[float, float]:
        largest = max(-lower, upper)
        if largest >= ENDLESS:
            what = f"joint {name}: limits beyond {ENDLESS:g} rad were taken for none."
            self.findings.note(f"joint {name}", what, limit.where)
            lower = lower if lower > -ENDLESS else -math.inf
            return lower, upper if upper < ENDLESS else math.inf
        if largest > WHOLE_TURN:
            raise InvalidInput(
                f"joint {name}: limits {lower:g} to {upper:g} rad; URDF angles are radians.",
                where=limit.where,
                hint=f"{math.radians(lower):.5g} and {math.radians(upper):.5g}",
            )
        return lower, upper

    def count_ignored(self) -> None:
        """Note elements that were not read, or refuse them if the options are strict."""
        ignored: Counter[str] = Counter()
        pending = [self.root]
        while pending:
            element = pending.pop()
            known = _KNOWN.get("visual" if element.tag == "collision" else element.tag)
            if known is None:
                continue
            for child in element.children:
                if child.tag in known:
                    pending.append(child)
                else:
                    ignored[child.tag] += 1
        if not ignored:
            return
        listed = ", ".join(f"{n} <{short(tag, 40)}>" for tag, n in sorted(ignored.items())[:20])
        what = f"{listed} {'was' if ignored.total() == 1 else 'were'} ignored."
        if self.options.strict:
            raise InvalidInput(what, where=self.path.name, hint="leave --strict out")
        self.findings.note(f"file {self.path.name}", what, self.path.name)


def _rgba(color: Element) -> meshes.Color:
    r, g, b, a = color.numbers("rgba", 4)
    if not all(0 <= c <= 1 for c in (r, g, b, a)):
        raise InvalidInput("<color>: rgba must be four numbers from 0 to 1.", where=color.where)
    return r, g, b, a


def _balls(link: Element) -> tuple[tuple[float, float, float, float], ...]:
    """Centres and radii of a link's collision spheres, besides those of our own export."""
    balls = []
    for collision in link.all("collision"):
        geometry = collision.find("geometry")
        sphere = geometry.find("sphere") if geometry is not None else None
        if sphere is None or collision.attributes.get("name", "").startswith(OWN_SHAPE):
            continue
        x, y, z = pose_of(collision.find("origin"))[:3, 3].tolist()
        balls.append((x, y, z, _sizes(sphere, "radius")[0]))
    return tuple(balls)


def _primitive(shape: Element) -> meshes.Mesh:
    if shape.tag == "box":
        return meshes.box(_sizes(shape, "size", 3))
    (radius,) = _sizes(shape, "radius")
    if shape.tag == "sphere":
        return meshes.sphere(radius)
    (length,) = _sizes(shape, "length")
    return (meshes.cylinder if shape.tag == "cylinder" else meshes.capsule)(radius, length)


def _sizes(shape: Element, attribute: str, count: int = 1) -> list[float]:
    values = shape.numbers(attribute, count)
    if not all(0 < value <= meshes.LARGEST_SPAN for value in values):
        raise InvalidInput(
            f"{shape.shown}: {attribute} must be greater than 0 and at most "
            f"{meshes.LARGEST_SPAN:g} m.",
            where=shape.where,
        )
    return values


def _strength(limit: Element, joint: str, key: str) -> float | None:
    if key not in limit.attributes:
        return None
    value = limit.number(key, largest=math.inf)
    if value < 0:
        raise InvalidInput(
            f"joint {joint}: {key} is {value:g}; it must be 0 or more.", where=limit.where
        )
    return value if value < UNLIMITED else None


def _dynamics(element: Element, joint: str) -> tuple[float, float, float]:
    values = []
    for tag, key in (("dynamics", "damping"), ("dynamics", "friction"), ("phasmid", "armature")):
        found = element.find(tag)
        value = found.number(key, 0.0) if found is not None else 0.0
        if value < 0:
            where = found.where if found is not None else element.where
            raise InvalidInput(
                f"joint {joint}: {key} is {value:g}; it must be 0 or more.", where=where
            )
        values.append(value)
    return values[0], values[1], values[2]
