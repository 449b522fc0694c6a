"""MJCF files as kinematic trees: compiled by MuJoCo, without parts that are not the robot's."""

from __future__ import annotations

import re
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, InvalidRobot, located
from phasmid.formats import meshes
from phasmid.formats.feet import names_a_foot
from phasmid.formats.files import named_file
from phasmid.formats.findings import Findings
from phasmid.formats.import_options import ImportOptions
from phasmid.formats.tree import Tree, TreeJoint, TreeLink, ended, root_error
from phasmid.formats.urdf_in import OWN_SHAPE
from phasmid.formats.xml import LARGEST_FILE, Element, read_xml, short
from phasmid.kinematics import quaternion_rotation
from phasmid.robot import Part
from phasmid.robot.inertial import Inertial
from phasmid.toml import read_bytes

MOST_ELEMENTS = 2000
"""Largest number of bodies, joints, geoms and sites; no robot has more."""

MASSLESS = 1e-14
"""Mass of bodies without one, which the engine would refuse [kg]."""

INVISIBLE = 3
"""Geoms of this group and above are hidden by the engine's viewers."""

STANCES = ("home", "stand", "standing", "stance", "plant", "neutral", "default")
"""Names of the key that is the stance, the first that there is; else the first key."""

NO_LOAD_SPEED = "phasmid_no_load_speed"
"""Name of the number that has the servos' speed, for which MJCF has no word [rad/s]. A joint of
another speed has a number of this name, a colon and its own name."""

_OWN_FILES = {"attach", "composite", "flexcomp", "model", "replicate"}
"""Elements that load other models or multiply bodies."""

MOST_INCLUDED = 20
"""Files that one file may include."""

_GREY = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)
"""Colour of a geom that takes the colour of its material."""

_ONE_ROBOT = "a robot is one body of the world, which carries bodies with hinges"


def read_mjcf(path: Path, options: ImportOptions | None = None) -> Tree:
    """Read the kinematic tree of the robot in an MJCF file.

    Numbers are those of the compiled model, in SI and radians. Where a joint does not turn about
    its body's origin, the link's frame is moved there. A site on a last link whose name is that of
    a foot becomes a massless link, fixed to it. Joint angles are the file's, ``ref`` included.

    Raises:
        InvalidInput: The file cannot be read, or MuJoCo refuses it.
        InvalidRobot: It holds no robot, or more than one.
    """
    source = _Source(path, options or ImportOptions())
    with source.engine_errors():
        spec = mujoco.MjSpec.from_string(source.text, source.included)
        _strip(spec, source)
        _name_elements(spec, source)
        _load_meshes(spec, source)
        model = _compiled(spec)
    # The engine's name for models without one.
    unnamed = spec.modelname == "MuJoCo Model"
    return _Reader(model, source).tree(path.stem if unnamed else spec.modelname)


class _Source:
    """An MJCF file with the files that it includes; it needs no others than meshes.

    Attributes:
        included: Content of included files, by their names as written.
        keys: Name and ``qpos`` of each key.
        followers: Joints whose angle another one gives, and the other one's names.
        no_load_speeds: Speeds of servos by joint [rad/s], and of the others by an empty name; only
            files of phasmid have them.
    """

    def __init__(self, path: Path, options: ImportOptions) -> None:
        self.path = path
        self.options = options
        self.findings = Findings()
        self.keys: list[tuple[str, Float[np.ndarray, " positions"]]] = []
        self.followers: dict[str, str] = {}
        self.no_load_speeds: dict[str, float] = {}
        raw = read_bytes(path, LARGEST_FILE)
        self.text = raw.decode("utf-8", "replace")
        root = read_xml(raw, path.name)
        if root.tag != "mujoco":
            raise InvalidInput(
                f"{root.file} line {root.line}: the file holds a <{short(root.tag)}>; robots are "
                "read from URDF, a <robot>, and MJCF, a <mujoco>.",
                hint="export the robot as URDF, MJCF or STEP",
            )
        self._places: dict[tuple[str, str], str] = {}
        self.included: dict[str, bytes] = {}
        self._walk(root)

    def _walk(self, root: Element) -> None:
        """Keep the places of elements, and read the files that they include."""
        for element in root.walk():
            if element.tag == "include":
                self._include(element)
            if element.tag in _OWN_FILES:
                raise InvalidInput(
                    f"<{element.tag}> is not read.",
                    where=element.where,
                    hint="open the file in MuJoCo and save it there, which writes it out",
                )
            file = Path(element.attributes.get("file", ""))
            name = element.attributes.get("name") or file.stem
            self._places.setdefault((element.tag, name), element.where)

    def _include(self, element: Element) -> None:
        name = element.need_text("file")
        if name in self.included:
            return
        if len(self.included) == MOST_INCLUDED:
            raise InvalidInput(
                f"{self.path.name} includes more than {MOST_INCLUDED} files; such models are "
                "refused."
            )
        with located(element.where):
            path = named_file(self.path, name, "file", self.options.packages)
            self.included[name] = read_bytes(path, LARGEST_FILE)
        self._walk(read_xml(self.included[name], path.name))

    def where(self, tag: str, name: str) -> str:
        """Return file and line of an element, or the file alone where its line is unknown."""
        return self._places.get((tag, name), self.path.name)

    @contextmanager
    def engine_errors(self) -> Iterator[None]:
        """Turn the engine's errors into one sentence with a place, and silence its warnings."""
        before = mujoco.get_mju_user_warning()
        # It would else print warnings and write them to a file.
        mujoco.set_mju_user_warning(lambda _: None)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                yield
        except (ValueError, RuntimeError, mujoco.FatalError, UnicodeError) as error:
            message, file = str(error), self.path.name
            line = re.search(r"\bline ([1-9]\d*)", message)
            first = message.strip().partition("\n")[0]
            sentence = short(re.sub(r"^(XML |XML parse )?[Ee]rror:\s*", "", first)).rstrip(".;, ")
            raise InvalidInput(
                f"MuJoCo cannot use {file}: {sentence}.",
                where=f"{file}, line {line.group(1)}" if line else file,
            ) from None
        finally:
            mujoco.set_mju_user_warning(before)


def _strip(spec: mujoco.MjSpec, source: _Source) -> None:
    """Delete all but bodies, joints, geoms, sites, and actuators of joints."""
    joints = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    fields = (mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF)
    scenery = [geom for geom in spec.geoms if geom.parent == spec.worldbody]
    noted = {
        "actuator": [each for each in spec.actuators if each.trntype not in joints],
        "contact": [*spec.pairs, *spec.excludes],
        "deformable": [*spec.flexes, *spec.skins],
        "equality": [each for each in spec.equalities if not _follows(each)],
        "geom": [each for each in spec.geoms if each.type in fields and each not in scenery],
        "tendon": list(spec.tendons),
    }
    for equality in noted["equality"]:
        if equality.active and equality.type in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            what = "ties parts to each other, as a linkage does; it was left open."
            where = source.where(equality.type.name[5:].lower(), equality.name)
            source.findings.suspect(f"equality {short(equality.name)}", what, where)
    ignored = Counter({tag: len(elements) for tag, elements in noted.items()})
    ignored["spring"] = sum(bool(np.any(joint.stiffness)) for joint in spec.joints)
    source.findings.note_ignored(+ignored, source.path.name)
    # Stances, linkages and the servos' speed are no part of the compiled model.
    followers = [each for each in spec.equalities if _follows(each)]
    source.followers = {each.name1: each.name2 for each in followers}
    source.keys = [(key.name, np.array(key.qpos, dtype=float)) for key in spec.keys]
    for numeric in spec.numerics:
        name, _, joint = numeric.name.partition(":")
        if name == NO_LOAD_SPEED and numeric.data[0] > 0:
            source.no_load_speeds[joint] = float(numeric.data[0])
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    silent = [*scenery, *spec.keys, *spec.sensors, *spec.textures, *spec.cameras, *spec.lights]
    silent += [*spec.numerics, *spec.tuples, *spec.hfields, *followers]
    for element in [*chain.from_iterable(noted.values()), *silent]:
        spec.delete(element)
    left = [*spec.bodies, *spec.joints, *spec.geoms, *spec.sites, *spec.actuators]
    if len(left) > MOST_ELEMENTS:
        raise InvalidInput(
            f"{source.path.name} describes more than {MOST_ELEMENTS} bodies, shapes and "
            "other things; such models are refused."
        )


def _follows(equality: Any) -> bool:
    """Return whether an equality gives a joint the angle of another one."""
    return equality.type == mujoco.mjtEq.mjEQ_JOINT and bool(equality.name2 and equality.active)


def _name_elements(spec: mujoco.MjSpec, source: _Source) -> None:
    """Name bodies and joints without a name; refuse reversed limits, which the engine takes."""
    for noun, elements in (("body", spec.bodies), ("joint", spec.joints)):
        taken = {element.name for element in elements}
        names = (f"{noun}_{n}" for n in count(1) if f"{noun}_{n}" not in taken)
        for element in elements:
            element.name = element.name or next(names)
    for joint in spec.joints:
        lower, upper = joint.range
        if lower > upper:
            raise InvalidInput(
                f"joint {joint.name}: its lower limit {lower:.6g} lies above the upper "
                f"{upper:.6g}.",
                where=source.where("joint", joint.name),
                hint="swap them",
            )


def _load_meshes(spec: mujoco.MjSpec, source: _Source) -> None:
    """Read the meshes that are shown; delete those that are not there, and their geoms."""
    files = meshes.MeshFiles(source.path, source.options)
    shown = {geom.meshname for geom in spec.geoms if geom.meshname}
    for mesh in list(spec.meshes):
        where = source.where("mesh", mesh.name)
        try:
            if mesh.name in shown:
                with located(where):
                    _load_mesh(spec, mesh, files)
                continue
        except meshes.UnreadMesh as error:
            source.findings.suspect(f"mesh {short(mesh.name)}", error.what, where, error.hint)
        for geom in [geom for geom in spec.geoms if geom.meshname == mesh.name]:
            spec.delete(geom)
        spec.delete(mesh)


def _load_mesh(spec: mujoco.MjSpec, mesh: Any, files: meshes.MeshFiles) -> None:
    """Read a mesh's file into the specification."""
    # The engine makes one slash of two.
    name = re.sub(r"^(\w+):/+", r"\1://", mesh.file)
    if not name:
        raise meshes.UnreadMesh(f"mesh {short(mesh.name)} names no file; it was left out.")
    folder = spec.compiler.meshdir
    named = name if "://" in name or not folder else f"{folder}/{name}"
    parts = files.meshes(named, mesh.scale)
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
    mesh.file, mesh.scale, mesh.content_type = "", [1.0, 1.0, 1.0], ""
    mesh.uservert = np.concatenate([part.vertices for part in parts]).ravel()
    mesh.userface = np.concatenate(faces).ravel()


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a specification, every body with a mass."""
    compiler = spec.compiler
    if not (compiler.boundmass or compiler.boundinertia):
        compiler.boundmass = compiler.boundinertia = MASSLESS
    compiler.fusestatic = compiler.discardvisual = False
    # Muscles' ranges would be found by simulation.
    compiler.LRopt.mode = mujoco.mjtLRMode.mjLRMODE_NONE
    for size in ("memory", "nstack", "njmax", "nconmax"):
        setattr(spec, size, -1)
    spec.nuserdata = 0
    return spec.compile()


class _Reader:
    """Conversion of a compiled model to a tree."""

    def __init__(self, model: mujoco.MjModel, source: _Source) -> None:
        self.model, self.file, self.where = model, source.path.name, source.where
        self.findings = source.findings
        self.links: dict[str, TreeLink] = {}
        self.joints: list[TreeJoint] = []
        self.shifts: dict[int, np.ndarray] = {}
        self.source, self.home = source, _home(model, source)
        self.names = [model.body(body).name for body in range(model.nbody)]
        self.parents = model.body_parentid.tolist()
        hinges = model.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE)
        self.carrying: set[int] = set()
        for hinged in model.jnt_bodyid[hinges].tolist():
            body = self.parents[hinged]
            while body and body not in self.carrying:
                self.carrying.add(body)
                body = self.parents[body]

    def tree(self, name: str) -> Tree:
        model = self.model
        bodies = (model.body_mass, model.body_inertia, model.body_pos, model.body_quat)
        joints = (model.jnt_pos, model.jnt_range)
        numbers = (*bodies, *joints, model.body_ipos, model.geom_pos, model.site_pos)
        if not all(np.isfinite(array).all() for array in numbers):
            raise InvalidInput(f"MuJoCo finds numbers in {self.file} that are not finite.")
        root = self._root()
        # Bodies come after those that carry them.
        for body in np.flatnonzero(model.body_rootid == root).tolist():
            self._read_body(body, root)
            if body not in self.carrying:
                self._add_feet(body)
        findings = tuple(self.findings)
        return Tree(name, self.links, tuple(self.joints), file=self.file, findings=findings)

    def _root(self) -> int:
        """Return the one body under the world that carries hinges."""
        tops = [body for body in range(1, self.model.nbody) if self.parents[body] == 0]
        carrying = [top for top in tops if top in self.carrying]
        if len(carrying) != 1:
            raise root_error(self.file, [self.names[top] for top in carrying], _ONE_ROBOT)
        others = [self.names[top] for top in tops if top != carrying[0]]
        if others:
            verb = "was" if len(others) == 1 else "were"
            what = f"{', '.join(others[:6])} beside the robot {verb} ignored."
            self.findings.note(f"link {others[0]}", what, self.where("body", others[0]))
        return carrying[0]

    def _read_body(self, body: int, root: int) -> None:
        model, name = self.model, self.names[body]
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        if body != root:
            self._add_joints(body, range(first, first + count))
        shift = self.shifts.setdefault(body, np.zeros(3))
        inertial, mass = None, float(model.body_mass[body])
        if mass > 2 * MASSLESS:
            X = _pose(model.body_iquat[body], model.body_ipos[body] - shift)
            inertial = Inertial(mass, np.zeros(3), np.diag(model.body_inertia[body])).at(X)
        parts, balls = self._shapes(body, shift)
        self._add_link(TreeLink(name, inertial, parts, self.where("body", name), balls))

    def _add_link(self, link: TreeLink) -> None:
        if link.name in self.links:
            raise InvalidRobot(f"two links are called {short(link.name)}.", where=link.where)
        self.links[link.name] = link

    def _add_joints(self, body: int, joints: range) -> None:
        model, name, parent = self.model, self.names[body], self.parents[body]
        X = _pose(model.body_quat[body], model.body_pos[body] - self.shifts[parent])
        above, where = self.names[parent], self.where("body", name)
        if not joints:
            self.joints.append(TreeJoint(f"{name}_joint", "fixed", above, name, X, where=where))
            return
        before = np.zeros(3)
        for joint in joints:
            here = model.jnt_pos[joint].copy()
            step = np.eye(4)
            step[:3, 3] = here - before
            # Joints of one body turn it one after the other, each about its own point.
            child = name if joint == joints[-1] else f"{name}_{model.joint(joint).name}"
            self.joints.append(self._joint(joint, above, child, X @ step))
            if child != name:
                self._add_link(TreeLink(child, where=where))
            above, before, X = child, here, np.eye(4)
        self.shifts[body] = before

    def _joint(self, joint: int, parent: str, child: str, X: Float[np.ndarray, "4 4"]) -> TreeJoint:
        model, name = self.model, self.model.joint(joint).name
        where = self.where("joint", name)
        kind = mujoco.mjtJoint(int(model.jnt_type[joint]))
        axis = model.jnt_axis[joint].copy()
        if kind != mujoco.mjtJoint.mjJNT_HINGE:
            word = "prismatic" if kind == mujoco.mjtJoint.mjJNT_SLIDE else "ball"
            return TreeJoint(name, word, parent, child, X, axis, where=where)
        # The file shows the body at the angle ref.
        half = -float(model.qpos0[model.jnt_qposadr[joint]]) / 2
        turn = _pose(np.array([np.cos(half), *(np.sin(half) * axis)]), np.zeros(3))
        limited = bool(model.jnt_limited[joint])
        lower, upper = map(float, model.jnt_range[joint] if limited else (-np.inf, np.inf))
        dof, speeds = int(model.jnt_dofadr[joint]), self.source.no_load_speeds
        return TreeJoint(
            name,
            "revolute" if limited else "continuous",
            parent,
            child,
            X @ turn,
            axis,
            *ended(lower, upper),
            self._effort(joint),
            speeds.get(name, speeds.get("")),
            damping=float(model.dof_damping[dof].flat[0]),
            friction=float(model.dof_frictionloss[dof]),
            armature=float(model.dof_armature[dof]),
            stiffness=self._gain(joint, 1),
            servo_damping=self._gain(joint, 2),
            home=None if self.home is None else float(self.home[model.jnt_qposadr[joint]]),
            follows=self.source.followers.get(name, ""),
            where=where,
        )

    def _gain(self, joint: int, order: int) -> float:
        """Return the gain of a joint's actuators by its angle (1) or speed (2), or 0."""
        model = self.model
        gains = [
            -float(model.actuator_biasprm[i, order]) * float(model.actuator_gear[i, 0]) ** 2
            for i in np.flatnonzero(model.actuator_trnid[:, 0] == joint)
        ]
        return max(0.0, sum(gains))

    def _effort(self, joint: int) -> float | None:
        """Return the largest torque of a joint's actuators; None where none has a limit."""
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

    def _shapes(
        self, body: int, shift: Float[np.ndarray, "3"]
    ) -> tuple[tuple[Part, ...], tuple[tuple[float, float, float, float], ...]]:
        """Return the shapes that the engine shows, and the balls that touch others.

        Shown ones without contact have precedence. Balls are spheres and ends of capsules, besides
        those of our own export.
        """
        model = self.model
        first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
        geoms = range(first, first + count)
        touching = [g for g in geoms if model.geom_contype[g] or model.geom_conaffinity[g]]
        balls = [
            (*centre.tolist(), float(model.geom_size[geom, 0]))
            for geom in touching
            if not model.geom(geom).name.startswith(OWN_SHAPE)
            for centre in self._centres(geom) - shift
        ]
        shown = [g for g in geoms if model.geom_group[g] < INVISIBLE]
        parts = []
        for geom in [g for g in shown if g not in touching] or shown:
            rgba = self._color(geom)
            mesh = self._mesh(geom) if rgba[3] > 0 else None
            if mesh is None:
                continue
            X = _pose(model.geom_quat[geom], model.geom_pos[geom] - shift)
            name = re.sub(r"^[^/]*/\d+/", "", model.geom(geom).name)
            name = name if name.isprintable() else ""
            parts.append(replace(mesh, color=rgba, name=name).at(X))
        return tuple(parts), tuple(balls)

    def _centres(self, geom: int) -> Float[np.ndarray, "balls 3"]:
        """Return the centre of a sphere, or those of a capsule's ends, in the body's frame [m]."""
        model, kind = self.model, int(self.model.geom_type[geom])
        position = model.geom_pos[geom]
        if kind == int(mujoco.mjtGeom.mjGEOM_SPHERE):
            return position[None]
        if kind != int(mujoco.mjtGeom.mjGEOM_CAPSULE):
            return np.empty((0, 3))
        axis = quaternion_rotation(model.geom_quat[geom])[:, 2]
        return position + np.outer([1.0, -1.0], model.geom_size[geom, 1] * axis)

    def _color(self, geom: int) -> meshes.Color:
        model = self.model
        rgba, material = model.geom_rgba[geom], int(model.geom_matid[geom])
        if material >= 0 and np.array_equal(rgba, _GREY):
            rgba = model.mat_rgba[material]
        # Single precision: 0.3 is to be 0.3 again.
        r, g, b, a = (round(float(c), 7) for c in np.nan_to_num(np.clip(rgba, 0.0, 1.0)))
        return r, g, b, a

    def _mesh(self, geom: int) -> Part | None:
        """Return a geom's triangles in its own frame; None for other shapes and huge ones."""
        model, kinds = self.model, mujoco.mjtGeom
        kind = mujoco.mjtGeom(int(model.geom_type[geom]))
        a, b, c = (float(size) for size in model.geom_size[geom])
        if kind == kinds.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            vertex, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
            return Part(
                model.mesh_vert[vertex : vertex + int(model.mesh_vertnum[mesh])],
                model.mesh_face[face : face + int(model.mesh_facenum[mesh])],
            )
        if not 0 < a <= meshes.LARGEST_SPAN or max(b, c) > meshes.LARGEST_SPAN:
            return None
        match kind:
            case kinds.mjGEOM_SPHERE:
                return meshes.primitive("icosphere", radius=a)
            case kinds.mjGEOM_CAPSULE:
                return meshes.primitive("capsule", radius=a, height=2 * b)
            case kinds.mjGEOM_CYLINDER:
                return meshes.primitive("cylinder", radius=a, height=2 * b)
            case kinds.mjGEOM_BOX:
                return meshes.primitive("box", extents=(2 * a, 2 * b, 2 * c))
            case kinds.mjGEOM_ELLIPSOID:
                return meshes.scaled(meshes.primitive("icosphere", radius=1.0), (a, b, c))
        return None

    def _add_feet(self, body: int) -> None:
        """Add sites of a last link that sound like feet, as massless links."""
        model, name = self.model, self.names[body]
        hinges = {model.joint(i).name for i in range(model.njnt)}
        for site in np.flatnonzero(model.site_bodyid == body):
            label = model.site(site).name
            if not names_a_foot(label):
                continue
            where = self.where("site", label)
            foot = f"{label}_site" if label in self.names else label
            X = _pose(model.site_quat[site], model.site_pos[site] - self.shifts[body])
            self._add_link(TreeLink(foot, where=where))
            joint = f"{foot}_{'fixed' if f'{foot}_joint' in hinges else 'joint'}"
            self.joints.append(TreeJoint(joint, "fixed", name, foot, X, where=where))


def _home(model: mujoco.MjModel, source: _Source) -> Float[np.ndarray, " positions"] | None:
    """Return ``qpos`` of the key that is the stance; None without one."""
    fit = [len(qpos) == model.nq and bool(np.isfinite(qpos).all()) for _, qpos in source.keys]
    if not all(fit):
        what = f"{fit.count(False)} keys without {model.nq} finite positions were ignored."
        source.findings.note(f"file {source.path.name}", what, source.path.name)
    keys = [
        (name or f"number {n}", qpos)
        for n, ((name, qpos), fits) in enumerate(zip(source.keys, fit, strict=True), 1)
        if fits
    ]
    if not keys:
        return None
    ranks = [
        STANCES.index(name.lower()) if name.lower() in STANCES else len(STANCES) for name, _ in keys
    ]
    name, home = keys.pop(ranks.index(min(ranks)))
    others = ", ".join(short(other) for other, _ in keys)
    what = "is the stance" + (f"; other keys were not used: {others}." if others else ".")
    source.findings.note(f"key {short(name)}", what, source.where("key", name))
    return home


def _pose(
    quaternion: Float[np.ndarray, "4"], position: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "4 4"]:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = quaternion_rotation(quaternion), position
    return X
