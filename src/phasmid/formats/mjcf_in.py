"""MJCF files in: MuJoCo's own reading of a checked file, as a kinematic tree."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, InvalidRobot
from phasmid.formats import meshes
from phasmid.formats.findings import Finding, Severity
from phasmid.formats.foot import names_a_foot
from phasmid.formats.mjcf_text import Checked, check_mjcf
from phasmid.formats.options import ImportOptions
from phasmid.formats.origins import ENDLESS
from phasmid.formats.tree import Inertial, Tree, TreeJoint, TreeLink
from phasmid.formats.urdf_in import GREY
from phasmid.formats.xml import Element, short
from phasmid.kinematics import quaternion_rotation
from phasmid.robot import Part

if TYPE_CHECKING:
    import mujoco

MASSLESS = 1e-14
"""What the engine gives to bodies without a mass, so that it takes them [kg]."""

INVISIBLE = 3
"""Geoms of this group and above are not shown by the engine's own viewers."""

_NAMED = {"body", "joint", "site"}

_GREY = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)
"""What a geom has whose colour is its material's."""


def read_mjcf(path: Path, options: ImportOptions | None = None) -> Tree:
    """The kinematic tree of the robot in an MJCF file.

    Numbers are those of the compiled model, in SI and radians: classes, includes, frames and
    shapes without a mass are MuJoCo's own to understand. Where a joint does not turn about its
    body's origin, the link's frame is put there. A site on a last link whose name sounds like a
    foot becomes a massless link, fixed to it. Joint angles are the file's, ``ref`` included.

    Args:
        path: The file.
        options: Where packages lie, the unit of meshes, and whether anything may be ignored.

    Raises:
        InvalidInput: The file cannot be read, or MuJoCo does not understand it.
        InvalidRobot: There is no robot in it, or more than one.
    """
    checked = check_mjcf(path, options or ImportOptions())
    model = _compiled(checked, path.name)
    return _Reader(model, checked, path).tree()


def _compiled(checked: Checked, file: str) -> mujoco.MjModel:
    import mujoco

    given = {key for each in checked.root.all("compiler") for key in each.attributes}
    bounds = f' boundmass="{MASSLESS}" boundinertia="{MASSLESS}"'
    if {"boundmass", "boundinertia"} & given:
        bounds = ""
    # Muscles' ranges would be found by simulation. On the first line, so that lines stay in place.
    ours = f'<compiler{bounds}><lengthrange mode="none"/></compiler>'
    first, line, rest = checked.text.partition("\n")
    text = first + (ours if line else "") + line + rest
    before = mujoco.get_mju_user_warning()
    # It would else print warnings and write them to a file.
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        return mujoco.MjModel.from_xml_string(text, checked.files)
    except (ValueError, RuntimeError, mujoco.FatalError, UnicodeError) as error:
        raise _spoken(error, checked, file) from None
    finally:
        mujoco.set_mju_user_warning(before)


def _spoken(error: Exception, checked: Checked, file: str) -> InvalidInput:
    """What the engine complains of, in one sentence, and where."""
    said = str(error)
    found = re.search(r"\bline (\d+)", said)
    where = (checked.where(int(found.group(1))) if found else "") or file
    said = re.sub(r"^(XML Error|Error|XML parse error):?\s*", "", said)
    said = re.sub(r"\n?Element name '', id -?\d+", "", said)
    said = re.sub(r"(Element name '[^']*'), id -?\d+", r"\1", said)
    said = re.sub(r",? *(column )?-?\d*,? *\(?\bline \d+\)?(, column -?\d+)?", "", said)
    sentence = short("; ".join(line.strip() for line in said.splitlines() if line.strip()))
    return InvalidInput(f"MuJoCo cannot use {file}: {sentence.rstrip('.;, ')}.", where=where)


class _Names:
    """Names of what a model holds, by number."""

    def __init__(self, model: mujoco.MjModel) -> None:
        import mujoco

        def names(kind: mujoco.mjtObj, count: int) -> list[str]:
            return [mujoco.mj_id2name(model, int(kind), i) or "" for i in range(count)]

        self.body = names(mujoco.mjtObj.mjOBJ_BODY, model.nbody)
        self.joint = names(mujoco.mjtObj.mjOBJ_JOINT, model.njnt)
        self.geom = names(mujoco.mjtObj.mjOBJ_GEOM, model.ngeom)
        self.site = names(mujoco.mjtObj.mjOBJ_SITE, model.nsite)


@dataclass
class _Reader:
    """One compiled model being understood."""

    model: mujoco.MjModel
    checked: Checked
    path: Path
    links: dict[str, TreeLink] = field(default_factory=dict)
    joints: list[TreeJoint] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    shifts: dict[int, np.ndarray] = field(default_factory=dict)
    elements: dict[str, Element] = field(default_factory=dict)

    def __post_init__(self) -> None:
        import mujoco

        model = self.model
        self.names = _Names(model)
        self.parents = model.body_parentid.tolist()
        hinge = int(mujoco.mjtJoint.mjJNT_HINGE)
        owners = model.jnt_bodyid[model.jnt_type == hinge].tolist()
        self.hinged = set(owners)
        # Bodies come after those that carry them.
        self.carrying: set[int] = set()
        for body in range(model.nbody - 1, 0, -1):
            if body in self.hinged or body in self.carrying:
                self.carrying.add(self.parents[body])
        self.moved: set[int] = set()
        for body in range(1, model.nbody):
            if body in self.hinged or self.parents[body] in self.moved:
                self.moved.add(body)

    def tree(self) -> Tree:
        model = self.model
        self.findings += self.checked.findings
        for section in self.checked.root.all("worldbody"):
            for element in section.walk():
                if element.tag in _NAMED and "name" in element.attributes:
                    self.elements[f"{element.tag} {element.attributes['name']}"] = element
        numbers = (model.body_mass, model.body_inertia, model.body_pos, model.body_quat)
        if not all(np.isfinite(array).all() for array in (*numbers, model.body_ipos)):
            raise InvalidInput(f"MuJoCo finds numbers in {self.path.name} that are not finite.")
        root = self._robot()
        self._note_inferred(root)
        for body in self._below(root):
            self._read_body(body, root)
        return Tree(
            self.checked.name or self.path.stem,
            self.links,
            tuple(self.joints),
            file=self.path.name,
            extension=self.checked.extension,
            findings=tuple(self.findings),
        )

    def _note(self, subject: str, what: str, severity: Severity = Severity.NOTE) -> None:
        element = self.elements.get(subject.replace("link ", "body "))
        where = element.where if element is not None else self.path.name
        self.findings.append(Finding(severity, subject, what, where))

    def _below(self, body: int) -> list[int]:
        """A body and all that hang on it, in the file's order."""
        below = {body}
        for other in range(body + 1, self.model.nbody):
            if self.parents[other] in below:
                below.add(other)
        return sorted(below)

    def _joints(self, body: int) -> list[int]:
        first = int(self.model.body_jntadr[body])
        return list(range(first, first + int(self.model.body_jntnum[body]))) if first >= 0 else []

    def _robot(self) -> int:
        """The one body under the world that carries hinges."""
        tops = [body for body in range(1, self.model.nbody) if self.parents[body] == 0]
        carrying = [top for top in tops if top in self.carrying]
        if len(carrying) != 1:
            names = [self.names.body[top] for top in carrying]
            named = f" ({', '.join(names[:6])}{', …' if len(names) > 6 else ''})" if names else ""
            raise InvalidRobot(
                f"{self.path.name} has {len(carrying)} root links{named}; exactly 1 is needed.",
                hint="a robot is one body of the world, which carries bodies with hinges",
            )
        others = [self.names.body[top] for top in tops if top != carrying[0]]
        if others:
            listed = ", ".join(others[:6])
            what = f"{listed} beside the robot {'was' if len(others) == 1 else 'were'} ignored."
            self._note(f"link {others[0]}", what)
        return carrying[0]

    def _note_inferred(self, root: int) -> None:
        always = any(
            compiler.attributes.get("inertiafromgeom") == "true"
            for compiler in self.checked.root.all("compiler")
        )
        shaped = [
            self.names.body[body]
            for body in self._below(root)
            if self.model.body_mass[body] > 2 * MASSLESS
            and (always or self.elements[f"body {self.names.body[body]}"].find("inertial") is None)
        ]
        if shaped:
            one = len(shaped) == 1
            what = (
                f"{len(shaped)} link{'' if one else 's'} had no <inertial>; "
                f"{'its mass was' if one else 'their masses were'} computed from shapes."
            )
            self._note(f"link {shaped[0]}", what)

    def _read_body(self, body: int, root: int) -> None:
        name = self.names.body[body]
        element = self.elements[f"body {name}"]
        joints = self._joints(body)
        if body == root:
            if len(joints) > 1 or body in self.hinged:
                what = f"joints between the world and {name} were ignored; the robot floats."
                self._note(f"link {name}", what)
        else:
            self._add_joints(body, joints)
        shift = self.shifts.setdefault(body, np.zeros(3))
        inertial, parts = self._inertial(body, shift), self._parts(body, shift)
        complete = name not in self.checked.incomplete
        self._add_link(name, inertial, parts, element.where, self._balls(body, shift), complete)
        self._add_feet(body, root)

    def _add_link(
        self,
        name: str,
        inertial: Inertial | None = None,
        parts: tuple[Part, ...] = (),
        where: str = "",
        balls: tuple[tuple[float, float, float, float], ...] = (),
        complete: bool = True,
    ) -> None:
        if name in self.links:
            raise InvalidRobot(f"two links are called {short(name)}.", where=where)
        self.links[name] = TreeLink(name, inertial, parts, where, balls, complete)

    def _inertial(self, body: int, shift: Float[np.ndarray, "3"]) -> Inertial | None:
        model = self.model
        mass = float(model.body_mass[body])
        if mass <= 2 * MASSLESS:
            return None
        R = _rotation(model.body_iquat[body])
        tensor = R @ np.diag(model.body_inertia[body]) @ R.T
        return Inertial(mass, model.body_ipos[body] - shift, (tensor + tensor.T) / 2)

    def _add_joints(self, body: int, joints: list[int]) -> None:
        model, name = self.model, self.names.body[body]
        parent = self.parents[body]
        X = np.eye(4)
        X[:3, :3] = _rotation(model.body_quat[body])
        X[:3, 3] = model.body_pos[body] - self.shifts[parent]
        above = self.names.body[parent]
        where = self.elements[f"body {name}"].where
        if not joints:
            self.joints.append(TreeJoint(f"{name}_joint", "fixed", above, name, X, where=where))
            return
        before = np.zeros(3)
        for joint in joints:
            label = self.names.joint[joint]
            here = model.jnt_pos[joint].copy()
            step = np.eye(4)
            step[:3, 3] = here - before
            # Joints of one body turn it one after the other, each about its own point.
            child = name if joint == joints[-1] else f"{name}_{label}"
            self.joints.append(self._joint(joint, above, child, X @ step))
            if child != name:
                self._add_link(child, where=where)
            above, before, X = child, here, np.eye(4)
        self.shifts[body] = before

    def _joint(self, joint: int, parent: str, child: str, X: Float[np.ndarray, "4 4"]) -> TreeJoint:
        import mujoco

        model, name = self.model, self.names.joint[joint]
        where = self.elements[f"joint {name}"].where
        kind = mujoco.mjtJoint(int(model.jnt_type[joint]))
        axis = model.jnt_axis[joint].copy()
        if kind != mujoco.mjtJoint.mjJNT_HINGE:
            slide = kind == mujoco.mjtJoint.mjJNT_SLIDE
            return TreeJoint(
                name, "prismatic" if slide else "ball", parent, child, X, axis, where=where
            )
        turn = np.eye(4)
        # The file shows the body at the angle ref.
        turn[:3, :3] = _turned(axis, -float(model.qpos0[model.jnt_qposadr[joint]]))
        limited = bool(model.jnt_limited[joint])
        lower, upper = model.jnt_range[joint] if limited else (-np.inf, np.inf)
        lower, upper = (
            lower if lower > -ENDLESS else -np.inf,
            upper if upper < ENDLESS else np.inf,
        )
        if float(np.ravel(model.jnt_stiffness)[joint]):
            self._note(f"joint {name}", f"joint {name} has a spring, which was ignored.")
        dof = int(model.jnt_dofadr[joint])
        return TreeJoint(
            name,
            "revolute" if limited else "continuous",
            parent,
            child,
            X @ turn,
            axis,
            float(lower),
            float(upper),
            self._effort(joint),
            damping=float(model.dof_damping[dof].flat[0]),
            friction=float(model.dof_frictionloss[dof]),
            armature=float(model.dof_armature[dof]),
            where=where,
        )

    def _effort(self, joint: int) -> float | None:
        """The largest torque of a joint's actuators; None where none has a limit."""
        model, torques = self.model, []
        # Actuators of anything but joints were not read.
        for i in np.flatnonzero(model.actuator_trnid[:, 0] == joint):
            gear = abs(float(model.actuator_gear[i, 0]))
            plain = not model.actuator_biasprm[i].any() and not model.actuator_dyntype[i]
            if model.actuator_forcelimited[i]:
                torques.append(gear * float(np.abs(model.actuator_forcerange[i]).max()))
            elif model.actuator_ctrllimited[i] and plain:
                gain = abs(float(model.actuator_gainprm[i, 0]))
                torques.append(gear * gain * float(np.abs(model.actuator_ctrlrange[i]).max()))
        if model.jnt_actfrclimited[joint]:
            most = float(np.abs(model.jnt_actfrcrange[joint]).max())
            return min([*torques, most])
        return max(torques, default=None)

    def _parts(self, body: int, shift: Float[np.ndarray, "3"]) -> tuple[Part, ...]:
        """What the engine shows of a body: shapes that touch nothing, or else all."""
        model = self.model
        first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
        shown = [g for g in range(first, first + count) if model.geom_group[g] < INVISIBLE]
        bare = [g for g in shown if not (model.geom_contype[g] or model.geom_conaffinity[g])]
        parts = []
        for geom in bare or shown:
            rgba = self._color(geom)
            mesh = self._mesh(geom) if rgba[3] > 0 else None
            if mesh is None:
                continue
            X = np.eye(4)
            X[:3, :3] = _rotation(model.geom_quat[geom])
            X[:3, 3] = model.geom_pos[geom] - shift
            name = re.sub(r"^[^/]*/\d+/", "", self.names.geom[geom])
            name = name if name.isprintable() else ""
            parts.append(Part(mesh.vertices, mesh.faces, rgba, name).at(X))
        return tuple(parts)

    def _balls(
        self, body: int, shift: Float[np.ndarray, "3"]
    ) -> tuple[tuple[float, float, float, float], ...]:
        """Centres and radii of the spheres with which a body touches others."""
        import mujoco

        model = self.model
        first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
        balls = []
        for geom in range(first, first + count):
            touches = model.geom_contype[geom] or model.geom_conaffinity[geom]
            if model.geom_type[geom] == int(mujoco.mjtGeom.mjGEOM_SPHERE) and touches:
                x, y, z = (model.geom_pos[geom] - shift).tolist()
                balls.append((x, y, z, float(model.geom_size[geom, 0])))
        return tuple(balls)

    def _color(self, geom: int) -> meshes.Color:
        model = self.model
        rgba, material = model.geom_rgba[geom], int(model.geom_matid[geom])
        if material >= 0 and np.array_equal(rgba, _GREY):
            rgba = model.mat_rgba[material]
        if not np.isfinite(rgba).all():
            return GREY
        # Single precision: 0.3 is to be 0.3 again.
        r, g, b, a = (round(float(min(max(c, 0.0), 1.0)), 7) for c in rgba)
        return r, g, b, a

    def _mesh(self, geom: int) -> meshes.Mesh | None:
        """A geom's triangles in its own frame."""
        import mujoco

        model, kinds = self.model, mujoco.mjtGeom
        kind = mujoco.mjtGeom(int(model.geom_type[geom]))
        a, b, c = (float(size) for size in model.geom_size[geom])
        if kind == kinds.mjGEOM_MESH:
            number = int(model.geom_dataid[geom])
            vertex, face = int(model.mesh_vertadr[number]), int(model.mesh_faceadr[number])
            return meshes.Mesh(
                model.mesh_vert[vertex : vertex + int(model.mesh_vertnum[number])].astype(float),
                model.mesh_face[face : face + int(model.mesh_facenum[number])].astype(np.int64),
            )
        if not 0 < a <= meshes.LARGEST_SPAN or max(b, c) > meshes.LARGEST_SPAN:
            return None
        made: dict[Any, Any] = {
            kinds.mjGEOM_SPHERE: lambda: meshes.sphere(a),
            kinds.mjGEOM_CAPSULE: lambda: meshes.capsule(a, 2 * b),
            kinds.mjGEOM_CYLINDER: lambda: meshes.cylinder(a, 2 * b),
            kinds.mjGEOM_BOX: lambda: meshes.box((2 * a, 2 * b, 2 * c)),
            kinds.mjGEOM_ELLIPSOID: lambda: meshes.sphere(1.0).scaled((a, b, c)),
        }
        return made[kind]() if kind in made else None

    def _add_feet(self, body: int, root: int) -> None:
        """Sites of a last link that sound like feet, as massless links."""
        model, name = self.model, self.names.body[body]
        if body == root or body in self.carrying or body not in self.moved:
            return
        for site in np.flatnonzero(model.site_bodyid == body):
            label = self.names.site[site]
            if not names_a_foot(label):
                continue
            where = self.elements[f"site {label}"].where
            foot = f"{label}_site" if label in self.names.body else label
            X = np.eye(4)
            X[:3, :3] = _rotation(model.site_quat[site])
            X[:3, 3] = model.site_pos[site] - self.shifts[body]
            self._add_link(foot, where=where)
            joint = f"{foot}_{'fixed' if f'{foot}_joint' in self.names.joint else 'joint'}"
            self.joints.append(TreeJoint(joint, "fixed", name, foot, X, where=where))


def _rotation(quaternion: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3 3"]:
    return quaternion_rotation(np.asarray(quaternion, dtype=float))


def _turned(axis: Float[np.ndarray, "3"], angle: float) -> Float[np.ndarray, "3 3"]:
    half = angle / 2
    return _rotation(np.array([np.cos(half), *(np.sin(half) * axis)]))
