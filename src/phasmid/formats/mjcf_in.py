"""MJCF files as kinematic trees: compiled by MuJoCo, without parts that are not the robot's."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput, InvalidRobot, located
from phasmid.formats import meshes
from phasmid.formats.feet import names_a_foot
from phasmid.formats.files import named_file
from phasmid.formats.findings import Findings
from phasmid.formats.options import ImportOptions
from phasmid.formats.tree import ENDLESS, Tree, TreeJoint, TreeLink
from phasmid.formats.urdf_in import GREY
from phasmid.formats.xml import LARGEST_FILE, Element, read_xml, short
from phasmid.kinematics import quaternion_rotation
from phasmid.robot import Part
from phasmid.robot.inertial import Inertial
from phasmid.toml import read_bytes

if TYPE_CHECKING:
    import mujoco

MOST_FILES = 100
"""Largest number of files that a model may include, directly or not."""

MOST_ELEMENTS = 2000
"""Largest number of bodies, joints, geoms and sites; no robot has more."""

MASSLESS = 1e-14
"""Mass of bodies without one, which the engine would refuse [kg]."""

INVISIBLE = 3
"""Geoms of this group and above are hidden by the engine's viewers."""

_OWN_FILES = {"attach", "model", "replicate"}
"""Elements that multiply bodies or load models beyond this file and its includes."""

_GREY = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)
"""Colour of a geom that takes the colour of its material."""


def read_mjcf(path: Path, options: ImportOptions | None = None) -> Tree:
    """Read the kinematic tree of the robot in an MJCF file.

    Numbers are those of the compiled model, in SI and radians. Where a joint does not turn about
    its body's origin, the link's frame is moved there. A site on a last link whose name is that of
    a foot becomes a massless link, fixed to it. Joint angles are the file's, ``ref`` included.

    Args:
        path: The file.
        options: Folders of packages, unit of meshes, and whether ignored elements are errors.

    Raises:
        InvalidInput: The file cannot be read, or MuJoCo refuses it.
        InvalidRobot: It holds no robot, or more than one.
    """
    options = options or ImportOptions()
    source = _Source(path, options)
    with source.engine_errors():
        import mujoco

        main = source.texts.pop("")
        spec = mujoco.MjSpec.from_string(main.decode("utf-8", "replace"), include=source.texts)
        robot = _RobotSpec(source, spec)
        robot.strip()
        robot.name_elements()
        robot.check_ranges()
        robot.load_meshes()
        model = robot.compile()
    return _Reader(model, robot).tree()


class _Source:
    """An MJCF file and its includes, none of them from outside the model's folder.

    Attributes:
        path: The file.
        texts: Contents of the includes by the name as written; of the file itself at ``""``.
        places: File and line by tag and name of an element.
        has_includes: Whether lines that the engine names may be those of an include.
    """

    def __init__(self, path: Path, options: ImportOptions) -> None:
        self.path = path
        self.options = options
        self.texts: dict[str, bytes] = {}
        self.places: dict[tuple[str, str], str] = {}
        raw = read_bytes(path, LARGEST_FILE)
        root = read_xml(raw, path.name)
        if root.tag != "mujoco":
            raise InvalidInput(
                f"{root.file} line {root.line}: the file holds a <{short(root.tag)}>; robots are "
                "read from URDF, a <robot>, and MJCF, a <mujoco>.",
                hint="export the robot as URDF, MJCF or STEP",
            )
        self.texts[""] = raw
        self._scan(root, (path.absolute(),))
        self.has_includes = len(self.texts) > 1

    def _scan(self, root: Element, chain: tuple[Path, ...]) -> None:
        """Note the places of elements, and read the files that they include."""
        for element in root.walk():
            if element.tag in _OWN_FILES:
                raise InvalidInput(
                    f"<{element.tag}> is not read.",
                    where=element.where,
                    hint="open the file in MuJoCo and save it there, which writes it out",
                )
            if element.tag == "include":
                self._include(element, chain)
            elif "name" in element.attributes or "file" in element.attributes:
                name = element.attributes.get("name") or Path(element.attributes["file"]).stem
                self.places.setdefault((element.tag, name), element.where)

    def _include(self, element: Element, chain: tuple[Path, ...]) -> None:
        name = element.need_text("file")
        with located(element.where):
            path = named_file(self.path, name, "include", self.options.packages)
            if not path.is_file():
                # Some writers count from the file that includes.
                beside = named_file(chain[-1], name, "include", self.options.packages)
                path = beside if beside.is_file() else path
            if path in chain:
                circle = [*chain[chain.index(path) :], path]
                raise InvalidInput(" includes ".join(file.name for file in circle) + ".")
            if len(self.texts) > MOST_FILES:
                raise InvalidInput(
                    f"{self.path.name} includes more than {MOST_FILES} files; "
                    "such models are refused."
                )
            if not path.is_file():
                raise InvalidInput(f'include "{short(name)}" is not there.')
            if name in self.texts:
                raise InvalidInput(f'include "{short(name)}" is there twice.')
            raw = read_bytes(path, LARGEST_FILE)
        self.texts[name] = raw
        self._scan(read_xml(raw, path.name), (*chain, path))

    def where(self, tag: str, name: str) -> str:
        """Return file and line of an element, or the file alone where its line is unknown."""
        return self.places.get((tag, name), self.path.name)

    @contextmanager
    def engine_errors(self) -> Iterator[None]:
        """Turn the engine's errors into one sentence with a place, and silence its warnings."""
        import mujoco

        before = mujoco.get_mju_user_warning()
        # It would else print warnings and write them to a file.
        mujoco.set_mju_user_warning(lambda _: None)
        try:
            yield
        except (ValueError, RuntimeError, mujoco.FatalError, UnicodeError) as error:
            raise self._spoken(str(error)) from None
        finally:
            mujoco.set_mju_user_warning(before)

    def _spoken(self, said: str) -> InvalidInput:
        where = self.path.name
        line, name = re.search(r"\bline (\d+)", said), re.search(r"Element name '(.+?)'", said)
        if line and int(line.group(1)) > 0 and not self.has_includes:
            where = f"{where}, line {line.group(1)}"
        elif name:
            places = (place for (_, own), place in self.places.items() if own == name.group(1))
            where = next(places, where)
        said = re.sub(r"^(XML Error|Error|XML parse error):?\s*", "", said)
        said = re.sub(r"\n?Element name '', id -?\d+", "", said)
        said = re.sub(r"(Element name '[^']*'), id -?\d+", r"\1", said)
        said = re.sub(r",? *(column )?-?\d*,? *\(?\bline -?\d+\)?(, column -?\d+)?", "", said)
        sentence = short("; ".join(line.strip() for line in said.splitlines() if line.strip()))
        return InvalidInput(
            f"MuJoCo cannot use {self.path.name}: {sentence.rstrip('.;, ')}.", where=where
        )


@dataclass
class _RobotSpec:
    """A model's specification on its way to that of a robot alone.

    Attributes:
        source: Its files.
        spec: The specification, which is changed.
        findings: Receives omissions.
        incomplete: Names of bodies without one of their meshes.
    """

    source: _Source
    spec: mujoco.MjSpec
    findings: Findings = field(default_factory=Findings)
    incomplete: set[str] = field(default_factory=set)

    def strip(self) -> None:
        """Delete all but bodies, joints, geoms, sites, and actuators of joints.

        Raises:
            InvalidInput: Too much is left, or something was ignored and options are strict.
        """
        import mujoco

        spec = self.spec
        joints = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
        fields = (mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF)
        scenery = [geom for geom in spec.geoms if geom.parent == spec.worldbody]
        counted = {
            "actuator": [each for each in spec.actuators if each.trntype not in joints],
            "contact": [*spec.pairs, *spec.excludes],
            "deformable": [*spec.flexes, *spec.skins],
            "equality": list(spec.equalities),
            "geom": [each for each in spec.geoms if each.type in fields and each not in scenery],
            "tendon": list(spec.tendons),
        }
        ignored = Counter({tag: len(elements) for tag, elements in counted.items()})
        self._note_ignored(+ignored)
        for material in spec.materials:
            material.textures = [""] * len(material.textures)
        silent = (
            scenery,
            spec.keys,
            spec.sensors,
            spec.textures,
            spec.cameras,
            spec.lights,
            spec.numerics,
            spec.tuples,
        )
        for elements in (*counted.values(), *silent, spec.hfields):
            for element in list(elements):
                spec.delete(element)
        left = [*spec.bodies, *spec.joints, *spec.geoms, *spec.sites, *spec.actuators]
        if len(left) > MOST_ELEMENTS:
            raise InvalidInput(
                f"{self.source.path.name} describes more than {MOST_ELEMENTS} bodies, shapes and "
                "other things; such models are refused."
            )

    def check_ranges(self) -> None:
        """Refuse limits the wrong way round, which the engine accepts."""
        for joint in self.spec.joints:
            lower, upper = joint.range
            if lower > upper:
                raise InvalidInput(
                    f"joint {joint.name}: its lower limit {lower:.6g} lies above the upper "
                    f"{upper:.6g}.",
                    where=self.source.where("joint", joint.name),
                    hint="swap them",
                )

    def _note_ignored(self, ignored: Counter[str]) -> None:
        if not ignored:
            return
        file = self.source.path.name
        listed = ", ".join(f"{n} <{tag}>" for tag, n in sorted(ignored.items()))
        what = f"{listed} {'was' if ignored.total() == 1 else 'were'} ignored."
        if self.source.options.strict:
            raise InvalidInput(what, where=file, hint="leave --strict out")
        self.findings.note(f"file {file}", what, file)

    def name_elements(self) -> None:
        """Give names to bodies and joints without one."""
        for noun, elements in (("body", self.spec.bodies), ("joint", self.spec.joints)):
            taken = {element.name for element in elements}
            number = 0
            for element in elements:
                while not element.name:
                    number += 1
                    if f"{noun}_{number}" not in taken:
                        element.name = f"{noun}_{number}"
                        if not self.source.has_includes:
                            place = f"{self.source.path.name}, {element.info.strip()}"
                            self.source.places[noun, element.name] = place

    def load_meshes(self) -> None:
        """Read the meshes that are shown; delete those that are not there, and their geoms."""
        spec, reader = self.spec, meshes.MeshFiles(self.source.options.mesh_unit)
        shown = {geom.meshname for geom in spec.geoms if geom.meshname}
        for mesh in list(spec.meshes):
            where = self.source.where("mesh", mesh.name)
            try:
                if mesh.name in shown:
                    with located(where):
                        self._load_mesh(mesh, reader)
                    continue
            except meshes.UnreadMesh as error:
                self.findings.suspect(f"mesh {short(mesh.name)}", error.what, where, error.hint)
            for geom in [geom for geom in spec.geoms if geom.meshname == mesh.name]:
                self.incomplete.add(geom.parent.name)
                spec.delete(geom)
            spec.delete(mesh)

    def _load_mesh(self, mesh: Any, reader: meshes.MeshFiles) -> None:
        """Read a mesh's file into the specification."""
        # The engine makes one slash of two.
        written = re.sub(r"^(\w+):/+", r"\1://", mesh.file)
        if not written:
            raise meshes.UnreadMesh(f"mesh {short(mesh.name)} names no file; it was left out.")
        if not np.all(mesh.scale):
            raise InvalidInput("<mesh>: a scale of 0 leaves nothing.")
        folder = self.spec.compiler.meshdir
        named = written if "://" in written or not folder else f"{folder}/{written}"
        path = named_file(self.source.path, named, "mesh", self.source.options.packages)
        if not path.is_file():
            raise meshes.UnreadMesh(f'mesh "{short(written)}" is not there; it was left out.')
        found = reader.meshes(path, mesh.scale)
        starts = np.cumsum([0, *(len(each.vertices) for each in found)])
        faces = [each.faces + start for each, start in zip(found, starts, strict=False)]
        mesh.file, mesh.scale, mesh.content_type = "", [1.0, 1.0, 1.0], ""
        mesh.uservert = np.concatenate([each.vertices for each in found]).ravel()
        mesh.userface = np.concatenate(faces).ravel()

    def compile(self) -> mujoco.MjModel:
        """Compile the remaining model, every body with a mass."""
        import mujoco

        compiler = self.spec.compiler
        if not (compiler.boundmass or compiler.boundinertia):
            compiler.boundmass = compiler.boundinertia = MASSLESS
        compiler.fusestatic = compiler.discardvisual = False
        # Muscles' ranges would be found by simulation.
        compiler.LRopt.mode = mujoco.mjtLRMode.mjLRMODE_NONE
        for size in ("memory", "nstack", "njmax", "nconmax"):
            setattr(self.spec, size, -1)
        self.spec.nuserdata = self.spec.nkey = 0
        return self.spec.compile()


@dataclass
class _Reader:
    """Conversion of a compiled model to a tree."""

    model: mujoco.MjModel
    robot: _RobotSpec
    links: dict[str, TreeLink] = field(default_factory=dict)
    joints: list[TreeJoint] = field(default_factory=list)
    shifts: dict[int, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        import mujoco

        model = self.model
        self.file = self.robot.source.path.name
        self.where = self.robot.source.where
        self.bodies = {model.body(i).name for i in range(model.nbody)}
        self.hinges = {model.joint(i).name for i in range(model.njnt)}
        self.findings = self.robot.findings
        self.parents = model.body_parentid.tolist()
        hinge = int(mujoco.mjtJoint.mjJNT_HINGE)
        self.hinged = set(model.jnt_bodyid[model.jnt_type == hinge].tolist())
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
        bodies = (model.body_mass, model.body_inertia, model.body_pos, model.body_quat)
        numbers = (*bodies, model.body_ipos, model.jnt_pos, model.geom_pos, model.site_pos)
        if not all(np.isfinite(array).all() for array in numbers):
            raise InvalidInput(f"MuJoCo finds numbers in {self.file} that are not finite.")
        root = self._robot()
        self._note_inferred(root)
        for body in self._below(root):
            self._read_body(body, root)
        name = self.robot.spec.modelname
        return Tree(
            # The engine's name for models without one.
            self.robot.source.path.stem if name == "MuJoCo Model" else name,
            self.links,
            tuple(self.joints),
            file=self.file,
            findings=tuple(self.findings),
        )

    def _body(self, body: int) -> str:
        return str(self.model.body(body).name)

    def _note(self, subject: str, what: str) -> None:
        noun, _, name = subject.partition(" ")
        where = self.where("body" if noun == "link" else noun, name)
        self.findings.note(subject, what, where)

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
            names = [self._body(top) for top in carrying]
            named = f" ({', '.join(names[:6])}{', …' if len(names) > 6 else ''})" if names else ""
            raise InvalidRobot(
                f"{self.file} has {len(carrying)} root links{named}; exactly 1 is needed.",
                hint="a robot is one body of the world, which carries bodies with hinges",
            )
        others = [self._body(top) for top in tops if top != carrying[0]]
        if others:
            listed = ", ".join(others[:6])
            what = f"{listed} beside the robot {'was' if len(others) == 1 else 'were'} ignored."
            self._note(f"link {others[0]}", what)
        return carrying[0]

    def _note_inferred(self, root: int) -> None:
        import mujoco

        always = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
        inferred = self.robot.spec.compiler.inertiafromgeom == always
        shaped = [
            self._body(body)
            for body in self._below(root)
            if self.model.body_mass[body] > 2 * MASSLESS
            and (inferred or not self.robot.spec.body(self._body(body)).explicitinertial)
        ]
        if shaped:
            what = f"links without <inertial>: {len(shaped)}; masses were computed from shapes."
            self._note(f"link {shaped[0]}", what)

    def _read_body(self, body: int, root: int) -> None:
        name = self._body(body)
        where = self.where("body", name)
        joints = self._joints(body)
        if body == root:
            if len(joints) > 1 or body in self.hinged:
                what = f"joints between the world and {name} were ignored; the robot floats."
                self._note(f"link {name}", what)
        else:
            self._add_joints(body, joints)
        shift = self.shifts.setdefault(body, np.zeros(3))
        inertial, parts = self._inertial(body, shift), self._parts(body, shift)
        complete = name not in self.robot.incomplete
        self._add_link(name, inertial, parts, where, self._balls(body, shift), complete)
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
        model, name = self.model, self._body(body)
        parent = self.parents[body]
        X = np.eye(4)
        X[:3, :3] = _rotation(model.body_quat[body])
        X[:3, 3] = model.body_pos[body] - self.shifts[parent]
        above = self._body(parent)
        where = self.where("body", name)
        if not joints:
            self.joints.append(TreeJoint(f"{name}_joint", "fixed", above, name, X, where=where))
            return
        before = np.zeros(3)
        for joint in joints:
            label = self.model.joint(joint).name
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

        model, name = self.model, self.model.joint(joint).name
        where = self.where("joint", name)
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
        """Return the shapes that the engine shows: those without contact, or else all."""
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
            name = re.sub(r"^[^/]*/\d+/", "", self.model.geom(geom).name)
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
        model, name = self.model, self._body(body)
        if body == root or body in self.carrying or body not in self.moved:
            return
        for site in np.flatnonzero(model.site_bodyid == body):
            label = self.model.site(site).name
            if not names_a_foot(label):
                continue
            where = self.where("site", label)
            foot = f"{label}_site" if label in self.bodies else label
            X = np.eye(4)
            X[:3, :3] = _rotation(model.site_quat[site])
            X[:3, 3] = model.site_pos[site] - self.shifts[body]
            self._add_link(foot, where=where)
            joint = f"{foot}_{'fixed' if f'{foot}_joint' in self.hinges else 'joint'}"
            self.joints.append(TreeJoint(joint, "fixed", name, foot, X, where=where))


def _rotation(quaternion: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3 3"]:
    return quaternion_rotation(np.asarray(quaternion, dtype=float))


def _turned(axis: Float[np.ndarray, "3"], angle: float) -> Float[np.ndarray, "3 3"]:
    half = angle / 2
    return _rotation(np.array([np.cos(half), *(np.sin(half) * axis)]))
