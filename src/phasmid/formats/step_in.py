"""STEP files in: solids and a sidecar become a kinematic tree with computed inertias.

The sidecar ``NAME.step.toml`` assigns the drawing's parts to links, and names joints and masses.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import numpy as np
from annotated_types import Ge, Gt, Le, Len
from jaxtyping import Float

from phasmid.errors import InvalidInput, located, nearest
from phasmid.formats.findings import Findings
from phasmid.formats.solids.drawing import Cylinder, DrawnPart, read_drawing
from phasmid.formats.tree import Tree, TreeJoint, TreeLink, inverse
from phasmid.robot import Part
from phasmid.robot.inertial import Inertial, merged
from phasmid.robot.table import Limits, Tensor, Vector
from phasmid.servo import Servo
from phasmid.servo.catalogue import ServoTable
from phasmid.tables import Angle, Density, Length, Mass, Name, Number, Table, in_file, validate
from phasmid.toml import read_toml

LONGEST_PATTERN = 400
"""Patterns of more characters than this are refused."""

LONGEST_LINK = 200
"""Links and joints of longer names are refused; such names hold that of a leg and more."""

MOST_LINKS = 400
"""More links or joints than this are refused."""

COAXIAL = 1e-6
"""Axes closer than this are one [m]."""

Direction = Annotated[list[Number], Len(3, 3)]
LinkName = Annotated[str, Len(1, LONGEST_LINK)]
Pattern = Annotated[str, Len(1, LONGEST_PATTERN)]


class FrameTable(Table):
    """``[frame]``: the robot in the drawing; without it the drawing has x forward and z up."""

    origin: Vector = [0.0, 0.0, 0.0]
    forward: Direction = [1.0, 0.0, 0.0]
    up: Direction = [0.0, 0.0, 1.0]


class PartTable(Table):
    """``[parts."PATTERN"]``: mass or density of each of these parts."""

    mass: Annotated[Mass, Gt(0)] | None = None
    density: Annotated[Density, Gt(0), Le(30_000)] | None = None


class StepLinkTable(Table):
    """``[links.NAME]``: the parts that move as one, and their total mass.

    Where a centre of mass and an inertia about it are known too, they stand in the drawing's frame.
    """

    parts: Annotated[list[Pattern], Len(1)]
    mass: Annotated[Mass, Gt(0)] | None = None
    com: Vector | None = None
    inertia: Tensor | None = None


class StepJointTable(Table):
    """``[joints.NAME]``: a hinge. Its axis is that of a part's round face, or given."""

    parent: str
    child: str
    axis_of: Pattern | None = None
    point: Vector | None = None
    direction: Direction | None = None
    drawn_at: Angle = 0.0
    limits: Limits = [-math.inf, math.inf]


class FootTable(Table):
    """``[feet.NAME]``: a foot, at a point of the drawing, and the radius of the ball about it."""

    link: str
    point: Vector
    radius: Annotated[Length, Ge(0)] = 0.0


class Sidecar(Table):
    """``NAME.step.toml``."""

    name: Name
    servo: ServoTable | None = None
    density: Annotated[Density, Gt(0), Le(30_000)] | None = None
    frame: FrameTable = FrameTable()
    parts: dict[Pattern, PartTable] = {}
    links: Annotated[dict[LinkName, StepLinkTable], Len(1, MOST_LINKS)]
    joints: Annotated[dict[LinkName, StepJointTable], Len(0, MOST_LINKS)] = {}
    feet: Annotated[dict[LinkName, FootTable], Len(0, MOST_LINKS)] = {}


def sidecar_of(path: Path) -> Path:
    """Return the path of a STEP file's sidecar."""
    return path.with_name(f"{path.name}.toml")


def read_step(path: Path) -> Tree:
    """Read the kinematic tree of a STEP file and the sidecar ``NAME.step.toml`` beside it.

    Masses, centres of mass and inertias are those of the solids, at the sidecar's densities or
    scaled to its weighed masses. Each child's frame lies on its joint's axis, which is its z.

    Raises:
        InvalidInput: A file cannot be read, or the sidecar does not fit the drawing.
        InvalidRobot: The links and joints form no tree.
        PhasmidError: build123d is not installed.
    """
    return SidecarReader(path).tree(read_drawing(path))


class SidecarReader:
    """The sidecar of a STEP file, which makes a tree of the drawing's parts."""

    def __init__(self, path: Path) -> None:
        file = sidecar_of(path)
        if not file.exists():
            raise InvalidInput(
                f"{path.name} has no {file.name} beside it; it must assign parts to links and give "
                "the joints' axes, the feet and masses or densities.",
                hint="docs/cad.md shows one; phasmid export writes one with every robot",
            )
        raw, content = read_toml(file)
        self.path = path
        self.locate = in_file(file, content)
        self.sidecar = validate(Sidecar, raw, self.locate)
        table = self.sidecar.servo
        self.servo: Servo | None = table.servo() if table else None
        self.findings = Findings()

    def tree(self, parts: Sequence[DrawnPart]) -> Tree:
        """Return the tree of a drawing's parts."""
        sidecar = self.sidecar
        groups = self._groups(parts)
        poses = self._frames(parts)
        links = {}
        for name in sidecar.links:
            where, X_link_drawing = self._where("links", name), inverse(poses[name])
            with located(where):
                mass = self._mass(name, groups[name], X_link_drawing)
            looks = tuple(
                _look(part, X_link_drawing) for part in groups[name] if part.look is not None
            )
            links[name] = TreeLink(name, mass, looks, where)
        joints = [self._joint(name, poses) for name in sidecar.joints]
        for name, foot in sidecar.feet.items():
            where = self._where("feet", name)
            self._check_link(f"feet.{name}.link", foot.link, where)
            if name in links:
                raise InvalidInput(f"feet.{name} is called as a link is.", where=where)
            balls = ((0.0, 0.0, 0.0, foot.radius),) if foot.radius else ()
            links[name] = TreeLink(name, where=where, balls=balls)
            X = np.eye(4)
            X[:3, 3] = (inverse(poses[foot.link]) @ np.array([*foot.point, 1.0]))[:3]
            joints.append(TreeJoint(f"{name}_joint", "fixed", foot.link, name, X, where=where))
        findings = tuple(self.findings)
        return Tree(sidecar.name, links, tuple(joints), self.path.name, findings, self.servo)

    def _where(self, *keys: str) -> str:
        return self.locate(keys)[1]

    def _check_link(self, what: str, name: str, where: str) -> None:
        """Refuse a name that is no link's."""
        links = self.sidecar.links
        if name not in links:
            guess = nearest(name, tuple(links))
            raise InvalidInput(
                f'{what} names "{name}", which is no link.',
                where=where,
                hint=f'"{guess}"' if guess else f"links are {', '.join(list(links)[:6])}",
            )

    def _groups(self, parts: Sequence[DrawnPart]) -> dict[str, list[DrawnPart]]:
        """Return the parts by link; a part belongs to the first link with a pattern for it."""
        patterns = {name: table.parts for name, table in self.sidecar.links.items()}
        groups: dict[str, list[DrawnPart]] = {name: [] for name in patterns}
        lost = []
        for part in parts:
            fitting = (n for n, own in patterns.items() if any(_fits(part, p) for p in own))
            name = next(fitting, None)
            if name is None:
                lost.append(part.path)
            else:
                groups[name].append(part)
        for name, group in groups.items():
            if not group:
                raise InvalidInput(
                    f'links.{name}: no part of the drawing is called "{patterns[name][0]}".',
                    where=self._where("links", name, "parts"),
                    hint=_nearest_path(patterns[name][0], parts),
                )
        if lost:
            shown = ", ".join(lost[:4]) + (", …" if len(lost) > 4 else "")
            what = (
                f"{len(lost)} of {len(parts)} parts belong to no link and were left out: {shown}."
            )
            self.findings.suspect("parts", what, hint='parts = ["*"] in a link')
        return groups

    def _mass(
        self, name: str, parts: list[DrawnPart], X_link_drawing: Float[np.ndarray, "4 4"]
    ) -> Inertial | None:
        """Return the mass of a link's parts in its frame; None where they enclose nothing."""
        table = self.sidecar.links[name]
        if table.com is not None or table.inertia is not None:
            if table.mass is None or table.com is None or table.inertia is None:
                raise InvalidInput(
                    f"links.{name} must have all of mass, com and inertia, or mass alone."
                )
            given = Inertial(table.mass, np.array(table.com), np.array(table.inertia))
            return given.at(X_link_drawing)
        masses = []
        for part in parts:
            if part.solid is None:
                what = "is a surface that encloses nothing; it has no mass."
                self.findings.suspect(f"part {part.path}", what)
                continue
            density = self._density(part, part.solid.mass, known=table.mass is not None)
            masses.append(part.solid.scaled(density).at(X_link_drawing))
        whole = merged(masses)
        if whole is None or table.mass is None:
            return whole
        return whole.scaled(table.mass / whole.mass)

    def _density(self, part: DrawnPart, volume: float, *, known: bool) -> float:
        """Return the density of a part [kg/m³]; the first pattern that fits it counts.

        Where the link as a whole was weighed, parts without a density all have the same.
        """
        for pattern, table in self.sidecar.parts.items():
            if not (_fits(part, pattern) or fnmatchcase(part.product, pattern)):
                continue
            if table.mass is not None and table.density is None:
                return table.mass / volume
            if table.density is not None and table.mass is None:
                return table.density
            raise InvalidInput(f'parts."{pattern}" must have either mass_g or density_kg_m3.')
        if self.sidecar.density is not None:
            return self.sidecar.density
        if known:
            return 1000.0
        raise InvalidInput(
            f"part {part.path} has neither a mass nor a density.",
            hint=f'[parts."{part.product or part.path}"] with mass_g or density_kg_m3, '
            "or density_kg_m3 for all parts",
        )

    def _frames(self, parts: Sequence[DrawnPart]) -> dict[str, np.ndarray]:
        """Return the pose of each link's frame in the drawing."""
        frame = self.sidecar.frame
        up, forward = np.array(frame.up, dtype=float), np.array(frame.forward, dtype=float)
        if np.linalg.norm(np.cross(up, forward)) < 1e-9:
            what = "frame: forward and up must be two directions across each other."
            raise InvalidInput(what, where=self._where("frame"))
        poses = dict.fromkeys(self.sidecar.links, _frame(np.array(frame.origin), up, forward))
        for name, joint in self.sidecar.joints.items():
            where = self._where("joints", name)
            for end in ("parent", "child"):
                self._check_link(f"joints.{name}.{end}", getattr(joint, end), where)
            with located(where):
                point, direction = _axis_of(name, joint, parts)
            level = np.cross([0.0, 0.0, 1.0], direction)
            if np.linalg.norm(level) < 1e-6:
                level = np.array([1.0, 0.0, 0.0])
            poses[joint.child] = _frame(point, direction, level)
        return poses

    def _joint(self, name: str, poses: dict[str, np.ndarray]) -> TreeJoint:
        table, where = self.sidecar.joints[name], self._where("joints", name)
        c, s = math.cos(table.drawn_at), math.sin(table.drawn_at)
        back = np.eye(4)
        back[:2, :2] = [[c, s], [-s, c]]
        lower, upper = table.limits
        return TreeJoint(
            name,
            "revolute" if math.isfinite(upper - lower) else "continuous",
            table.parent,
            table.child,
            inverse(poses[table.parent]) @ poses[table.child] @ back,
            lower=lower,
            upper=upper,
            where=where,
        )


def _fits(part: DrawnPart, pattern: str) -> bool:
    return fnmatchcase(part.path, pattern)


def _nearest_path(pattern: str, parts: Iterable[DrawnPart]) -> str:
    paths = [part.path for part in parts]
    return nearest(pattern, paths) or f"such as {paths[0]}"


def _axis_of(
    name: str, joint: StepJointTable, parts: Iterable[DrawnPart]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return a point of a joint's axis and its direction, in the drawing [m]."""
    sense = None
    if joint.direction is not None:
        sense = np.array(joint.direction, dtype=float)
        length = float(np.linalg.norm(sense))
        if not 1e-9 < length < 1e9:
            raise InvalidInput(f"joints.{name}: direction must be a vector of some length.")
        sense /= length
    if joint.axis_of is None:
        if joint.point is None or sense is None:
            raise InvalidInput(
                f"joints.{name} must have axis_of, or point_mm and direction.",
                hint='axis_of = "body/servo" takes the axis of that part\'s largest round face',
            )
        return np.array(joint.point), sense
    if joint.point is not None:
        raise InvalidInput(f"joints.{name} has both axis_of and point; one must go.")
    found = [part for part in parts if _fits(part, joint.axis_of)]
    if len(found) != 1:
        raise InvalidInput(
            f'joints.{name}: axis_of names {len(found)} parts of the drawing, "{joint.axis_of}"; '
            "it must name one.",
            hint=_nearest_path(joint.axis_of, parts),
        )
    part, faces = found[0], found[0].cylinders
    if not faces:
        raise InvalidInput(
            f"joints.{name}: {part.path} has no round face.", hint="point_mm and direction"
        )
    # The largest of all round faces about one axis.
    cylinder = max(faces, key=lambda face: sum(f.area for f in faces if _coaxial(f, face)))
    point, direction = cylinder.point, cylinder.direction / np.linalg.norm(cylinder.direction)
    if sense is not None:
        if abs(sense @ direction) < math.cos(math.radians(45)):
            raise InvalidInput(
                f"joints.{name}: direction lies across the axis of {part.path}; "
                "it gives the sense of the axis."
            )
        direction = direction * np.sign(sense @ direction)
    # The point of the axis nearest to the part's middle.
    middle = point if part.solid is None else part.solid.com
    return point + ((middle - point) @ direction) * direction, direction


def _coaxial(one: Cylinder, other: Cylinder) -> bool:
    """Return whether two round faces of one part have the same axis."""
    across = other.point - one.point
    return bool(
        np.linalg.norm(np.cross(one.direction, other.direction)) < COAXIAL
        and np.linalg.norm(np.cross(across, one.direction)) < COAXIAL
    )


def _frame(origin: np.ndarray, z: np.ndarray, x: np.ndarray) -> Float[np.ndarray, "4 4"]:
    """Return a frame with this z, and x in the plane of z and the given one."""
    z = z / np.linalg.norm(z)
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = np.stack([x, np.cross(z, x), z], axis=1), origin
    return X


def _look(part: DrawnPart, X_link_drawing: np.ndarray) -> Part:
    assert part.look is not None
    return replace(part.look.at(X_link_drawing), name=part.path.rpartition("/")[2])
