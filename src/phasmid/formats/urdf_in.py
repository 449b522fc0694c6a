"""URDF files in: links, joints and meshes as a kinematic tree, with notes on omissions."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, located, nearest
from phasmid.formats import meshes
from phasmid.formats.findings import Findings
from phasmid.formats.import_options import ImportOptions
from phasmid.formats.tree import WHOLE_TURN, Tree, TreeJoint, TreeLink, ended
from phasmid.formats.xml import LARGEST_FILE, Element, read_xml, short
from phasmid.kinematics import rotation_rpy
from phasmid.robot import Part
from phasmid.robot.inertial import Inertial
from phasmid.toml import read_bytes

KINDS = ("revolute", "continuous", "fixed", "prismatic", "floating", "planar")
"""Joints of URDF."""

_KNOWN = {
    "robot": {"link", "joint", "material", "mujoco"},
    "link": {"inertial", "visual", "collision"},
    "inertial": {"origin", "mass", "inertia"},
    "visual": {"origin", "geometry", "material"},
    "collision": {"origin", "geometry", "material"},
    "geometry": {"box", "cylinder", "sphere", "capsule", "mesh"},
    "material": {"color"},
    "joint": {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "phasmid"},
}
"""Elements that are read, by their parent; others are counted."""

OWN_SHAPE = "phasmid_"
"""So begin the names of shapes that our export adds; they are no part of the robot."""

_SMALLEST_SIZE = 1e-9
"""Shapes have a size greater than 0 [m]."""

UNLIMITED = 1e9
"""Efforts and speeds from here on mean no limit [N·m, rad/s]."""


def read_urdf(path: Path, options: ImportOptions | None = None) -> Tree:
    """Read the kinematic tree of a URDF file.

    Raises:
        InvalidInput: The file cannot be read, or a number in it cannot be used.
        InvalidRobot: Its links and joints form no tree.
    """
    root = read_xml(read_bytes(path, LARGEST_FILE), path.name)
    for element in root.walk():
        if element.tag.startswith("xacro:"):
            raise InvalidInput(
                f"{element.file} line {element.line}: <{short(element.tag)}> is not expanded.",
                hint="run xacro first: xacro robot.urdf.xacro > robot.urdf",
            )
    if root.tag != "robot":
        raise InvalidInput(
            f"{root.file} line {root.line}: the file holds a <{short(root.tag)}>; "
            "a URDF file holds a <robot>."
        )
    reader = _Reader(path, root, options or ImportOptions())
    links: dict[str, TreeLink] = {}
    for link in map(reader.link, root.all("link")):
        if link.name in links:
            raise InvalidInput(f"two links are called {link.name}.", where=link.where)
        links[link.name] = link
    joints = tuple(map(reader.joint, root.all("joint")))
    reader.count_ignored()
    name = root.need_name() if "name" in root.attributes else path.stem
    return Tree(name, links, joints, file=path.name, findings=tuple(reader.findings))


@dataclass
class _Reader:
    """File being read: its materials, meshes and findings."""

    path: Path
    root: Element
    options: ImportOptions
    findings: Findings = field(default_factory=Findings)
    colors: dict[str, meshes.Color] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.files = meshes.MeshFiles(self.path, self.options)
        # A material may be defined in one link and named in another; the robot's own count first.
        looks = [visual for link in self.root.all("link") for visual in link.all("visual")]
        for owner in (self.root, *looks):
            for material in owner.all("material"):
                color = material.find("color")
                if color is not None and "name" in material.attributes:
                    self.colors.setdefault(material.attributes["name"], self._rgba(color))

    def link(self, element: Element) -> TreeLink:
        name = element.need_name()
        inertial = element.find("inertial")
        parts = self._parts(element, "visual")
        own = any(
            look.attributes.get("name", "").startswith(OWN_SHAPE) for look in element.all("visual")
        )
        if not parts and not own and element.find("collision") is not None:
            parts = self._parts(element, "collision")
            if parts:
                what = "shows its collision shape, as no visual one was read."
                self.findings.note(f"link {name}", what, element.where)
        return TreeLink(
            name,
            None if inertial is None else self._inertial(inertial, name),
            parts,
            element.where,
            self._balls(element),
        )

    def _inertial(self, element: Element, link: str) -> Inertial:
        mass, moments = element.find("mass"), element.find("inertia")
        I = np.zeros((3, 3))
        if moments is not None:
            for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"):
                i, j = ("xyz".index(axis) for axis in key[1:])
                I[i, j] = I[j, i] = moments.number(key)
        for part, tag in ((mass, "mass"), (moments, "inertia")):
            if part is None:
                what = f"link {link} has an <inertial> without <{tag}>; 0 was taken."
                hint = 'masses = "geometry"' if tag == "inertia" else ""
                self.findings.suspect(f"link {link}", what, element.where, hint)
        X = _pose(element.get("origin"))
        R = X[:3, :3]
        if not np.array_equal(R, np.eye(3)):
            I = R @ I @ R.T
            I = (I + I.T) / 2
        return Inertial(mass.number("value") if mass is not None else 0.0, X[:3, 3].copy(), I)

    def _parts(self, link: Element, tag: str) -> tuple[Part, ...]:
        parts: list[Part] = []
        for look in link.all(tag):
            geometry = look.find("geometry")
            name = look.attributes.get("name", "")
            if geometry is None or not geometry.children or name.startswith(OWN_SHAPE):
                continue
            # Our export puts the link and a number before the name of a part.
            name = re.sub(rf"^{re.escape(link.need_name())}/\d+/", "", name)
            name = name if name.isprintable() else ""
            X = _pose(look.get("origin"))
            color = self._color(look.find("material"))
            with located(look.where):
                parts += [
                    replace(part, color=color or part.color, name=name).at(X)
                    for part in self._shapes(geometry.children[0], link)
                ]
        return tuple(parts)

    def _balls(self, link: Element) -> tuple[tuple[float, float, float, float], ...]:
        """Return the balls of a link's collision shapes; of its visual ones where it has none."""
        balls = _balls(link, "collision")
        if balls or link.find("collision") is not None:
            return balls
        balls = _balls(link, "visual")
        if balls:
            subject = f"link {link.need_name()}"
            what = "has no collision shape; its visual spheres and capsules count as such."
            self.findings.note(subject, what, link.where)
        return balls

    def _color(self, material: Element | None) -> meshes.Color | None:
        if material is None:
            return None
        color = material.find("color")
        if color is not None:
            return self._rgba(color)
        return self.colors.get(material.attributes.get("name", ""))

    def _rgba(self, color: Element) -> meshes.Color:
        """Return a colour, with numbers beyond 0 to 1 clipped; grey where it has no four numbers.

        Materials repeat in every link, so that a note is made once.
        """
        try:
            written = color.numbers("rgba", 4)
        except InvalidInput as error:
            written, what = list(Part.color), f"{error.what.rstrip('.')}; grey was taken."
        else:
            what = f'<color>: rgba is "{color.attributes["rgba"]}"; it was clipped to 0 to 1.'
        r, g, b, a = (min(max(part, 0.0), 1.0) for part in written)
        told = {finding.what for finding in self.findings}
        if what not in told and ([r, g, b, a] != written or "grey" in what):
            self.findings.note("material", what, color.where)
        return r, g, b, a

    def _shapes(self, shape: Element, link: Element) -> tuple[Part, ...]:
        if shape.tag in {"box", "sphere", "cylinder", "capsule"}:
            made = (_primitive(shape),)
            self.files.count(made)
            return made
        if shape.tag != "mesh":
            return ()
        with located(shape.where):
            try:
                scale = shape.numbers("scale", 3, (1.0, 1.0, 1.0))
                return self.files.meshes(shape.need_text("filename"), scale)
            except meshes.UnreadMesh as error:
                subject = f"link {link.need_name()}"
                self.findings.suspect(subject, error.what, shape.where, error.hint)
                return ()

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
        lower, upper = self._limits(element, name, kind)
        limit, dynamics = element.get("limit"), element.get("dynamics")
        effort, velocity = (self._most(limit, key, name) for key in ("effort", "velocity"))
        mimic, own = element.find("mimic"), element.get("phasmid")
        return TreeJoint(
            name,
            kind,
            element.need("parent").need_name("link"),
            element.need("child").need_name("link"),
            _pose(element.get("origin")),
            self._axis(element.get("axis"), name, kind),
            lower,
            upper,
            effort,
            velocity,
            dynamics.number("damping", 0.0, least=0.0),
            dynamics.number("friction", 0.0, least=0.0),
            own.number("armature", 0.0, least=0.0),
            home=own.number("home") if "home" in own.attributes else None,
            follows=mimic.need_name("joint") if mimic is not None else "",
            where=element.where,
        )

    def _most(self, limit: Element, key: str, name: str) -> float | None:
        """Return the effort or speed of a joint; None where the file gives none."""
        most = limit.number(key, math.inf, least=-math.inf, largest=math.inf)
        if most < 0:
            what = f"{key} {most:g} was taken for none."
            self.findings.suspect(f"joint {name}", what, limit.where)
        return most if 0 < most < UNLIMITED else None

    def _axis(self, element: Element, name: str, kind: str) -> Float[np.ndarray, "3"]:
        if kind in {"fixed", "floating"}:
            return np.array([0.0, 0.0, 1.0])
        axis = np.array(element.numbers("xyz", 3, (1.0, 0.0, 0.0)))
        length = float(np.linalg.norm(axis))
        if length < 1e-9:
            raise InvalidInput(f"joint {name}: its axis has no direction.", where=element.where)
        # A unit vector stays as it is, to the last digit.
        return axis if abs(length - 1) < 1e-15 else axis / length

    def _limits(self, element: Element, name: str, kind: str) -> tuple[float, float]:
        """Return the lowest and highest angle or place of a joint."""
        limit = element.find("limit")
        given = limit is not None and {"lower", "upper"} & set(limit.attributes)
        if kind not in {"revolute", "prismatic"}:
            if kind == "continuous" and given:
                what = "its limits in the file do not count for a continuous joint."
                hint = 'type="revolute" in the file, if they are stops'
                self.findings.note(f"joint {name}", what, element.where, hint)
            return -math.inf, math.inf
        if limit is None:
            what = f"no <limit>, which {kind} joints must have; it may move without end."
            self.findings.suspect(f"joint {name}", what, element.where)
            return -math.inf, math.inf
        if kind == "revolute" and not given:
            return -math.inf, math.inf
        lower, upper = (
            limit.number(key, 0.0, least=-math.inf, largest=math.inf) for key in ("lower", "upper")
        )
        return (lower, upper) if kind == "prismatic" else ended(lower, upper)

    def count_ignored(self) -> None:
        """Note elements that were not read."""
        ignored: Counter[str] = Counter()
        pending = [self.root]
        while pending:
            element = pending.pop()
            known = _KNOWN.get(element.tag)
            for child in element.children if known else ():
                if known and child.tag in known:
                    pending.append(child)
                else:
                    ignored[short(child.tag, 40)] += 1
        self.findings.note_ignored(ignored, self.path.name)


def _pose(element: Element) -> Float[np.ndarray, "4 4"]:
    """Return the pose of an ``<origin>``: turned by Rz(yaw) Ry(pitch) Rx(roll), then moved."""
    X = np.eye(4)
    roll, pitch, yaw = element.numbers("rpy", 3, (0.0, 0.0, 0.0))
    if max(abs(roll), abs(pitch), abs(yaw)) > WHOLE_TURN:
        turned = " ".join(f"{angle:.5g}" for angle in np.radians([roll, pitch, yaw]))
        raise InvalidInput(
            f"<origin>: rpy {roll:g} {pitch:g} {yaw:g} rad is more than a turn; "
            "URDF angles are radians.",
            where=element.where,
            hint=f'rpy="{turned}", if these are degrees',
        )
    if roll or pitch or yaw:
        X[:3, :3] = rotation_rpy(*map(np.asarray, (roll, pitch, yaw)))
    X[:3, 3] = element.numbers("xyz", 3, (0.0, 0.0, 0.0))
    return X


def _balls(link: Element, tag: str) -> tuple[tuple[float, float, float, float], ...]:
    """Return centres and radii of a link's spheres and ends of capsules, besides our export's."""
    balls = []
    for look in link.all(tag):
        geometry = look.find("geometry")
        shape = geometry.children[0] if geometry is not None and geometry.children else None
        own = look.attributes.get("name", "").startswith(OWN_SHAPE)
        if shape is None or own or shape.tag not in {"sphere", "capsule"}:
            continue
        (radius,), X = _sizes(shape, "radius"), _pose(look.get("origin"))
        # The cylinder of a capsule is as long as its length, along z.
        half = _sizes(shape, "length")[0] / 2 if shape.tag == "capsule" else 0.0
        for end in (half, -half)[: 2 if half else 1]:
            x, y, z = (X[:3, 3] + end * X[:3, 2]).tolist()
            balls.append((x, y, z, radius))
    return tuple(balls)


def _primitive(shape: Element) -> Part:
    if shape.tag == "box":
        return meshes.primitive("box", extents=_sizes(shape, "size", 3))
    (radius,) = _sizes(shape, "radius")
    if shape.tag == "sphere":
        return meshes.primitive("icosphere", radius=radius)
    (length,) = _sizes(shape, "length")
    return meshes.primitive(shape.tag, radius=radius, height=length)


def _sizes(shape: Element, attribute: str, count: int = 1) -> list[float]:
    return shape.numbers(attribute, count, least=_SMALLEST_SIZE, largest=meshes.LARGEST_SPAN)
