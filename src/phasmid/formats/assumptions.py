"""Data that a robot's file may lack: servo, masses and neutral feet."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot, located
from phasmid.formats.findings import Findings
from phasmid.formats.import_options import ImportOptions
from phasmid.formats.legs import FoundLeg
from phasmid.formats.tree import TreeJoint
from phasmid.robot import JOINTS, Part
from phasmid.robot.inertial import Inertial
from phasmid.robot.link import solid_box
from phasmid.servo import Servo, load_servo
from phasmid.servo.rules import ASSUMED, OWN_FILE, UNKNOWN, complete_servo
from phasmid.servo.words import UNNAMED
from phasmid.units import plain_number

LIKE = "AX-12A"
"""Servo whose speed stands in where a format has none, such as MJCF."""

UNITS = {"friction": "N·m", "damping": "N·m·s/rad", "armature": "kg·m²"}
"""Numbers of joints of which a servo has the largest, and their units."""

OWN = {
    "strength": ("effort", "stall_torque"),
    "speed_ratio": ("velocity", "no_load_speed"),
    "armature_ratio": ("armature", "armature"),
    "friction_ratio": ("friction", "friction"),
}
"""Ratios of a leg: number of a joint that each joint keeps, and that of the servo below it."""

GAINS = {"stiffness": "stiffness", "servo_damping": "damping"}
"""Gains of joints, of which a servo has the least over its effort, and their names in a servo."""

USED = ("effort", "velocity", *UNITS, *GAINS)
"""Numbers of joints that make a servo."""

SAME = 1e-9
"""Part by which gains of one servo differ, by the round-off of digits that were written."""

NAMES = {"damping": "viscous_friction"}
"""Numbers of joints that have another name in a servo."""

DATA_SHEET = "--servo-model AX-12A, to take all from a data sheet"
"""Hint where numbers of a servo are assumed or unlikely."""


def servo_of(
    joints: Sequence[TreeJoint], option: str, own: Servo | None, findings: Findings
) -> Servo:
    """Return the servo of every joint: that of the option, the file's own, or of its numbers.

    Raises:
        InvalidInput: There is no servo of this name.
        InvalidRobot: The file has no effort of its joints.
    """
    if option:
        with located("option --servo-model"):
            chosen = load_servo(option)
        used = [name for name in USED if any(getattr(joint, name) for joint in joints)]
        if used:
            listed = ", ".join(name.replace("_", " ") for name in used)
            what = f"the numbers of {chosen.name} take the place of the file's: {listed}."
            findings.note("servo", what, hint="no --servo-model, to use those of the file")
        return chosen
    if own is not None:
        return own
    efforts = [j.effort for j in joints if j.effort and math.isfinite(j.effort)]
    speeds = [j.velocity for j in joints if j.velocity and math.isfinite(j.velocity)]
    if not efforts:
        raise InvalidRobot(
            "the joints have no effort, so their servos are not known.",
            hint='servo_model = "AX-12A"',
        )
    like = load_servo(LIKE)
    torque, speed = min(efforts), min(speeds, default=like.no_load_speed)
    merged = {name: [getattr(joint, name) for joint in joints] for name in UNITS}
    given = {name: max(values) for name, values in merged.items()}
    _note_merged({"effort": efforts, "speed": speeds} | merged, findings)
    gains = _gains(joints, torque, findings)
    servo = complete_servo(
        {
            "name": UNNAMED,
            "stall_torque": torque,
            "no_load_speed": speed,
            # A file's damping is the friction of its joints.
            **{NAMES.get(name, name): value for name, value in given.items() if value},
            **gains,
        },
        {"stall_current": UNKNOWN, "no_load_speed": OWN_FILE if speeds else ASSUMED},
    )
    stated = {
        f"{plain_number(torque)} N·m": True,
        f"{'' if speeds else 'no-load speed '}{plain_number(speed)} rad/s": bool(speeds),
        f"stiffness {plain_number(servo.stiffness, 3)} N·m/rad": "stiffness" in gains,
    }
    known = ", ".join(words for words, is_given in stated.items() if is_given)
    assumed = [words for words, is_given in stated.items() if not is_given]
    assumed += [name for name in given if not given[name]]
    rest = f"; assumed: {', '.join(assumed)}." if assumed else "."
    findings.note("servo", f"the file gives {known}{rest}", hint=DATA_SHEET)
    return servo


def _gains(joints: Sequence[TreeJoint], torque: float, findings: Findings) -> dict[str, float]:
    """Return the gains of a servo of a stall torque [N·m]; a joint's own follow its effort."""
    gains = {}
    for name, own in GAINS.items():
        values = [
            getattr(joint, name) * torque / (joint.effort or torque)
            for joint in joints
            if getattr(joint, name)
        ]
        if not values:
            continue
        gains[own] = min(values)
        if max(values) > (1 + SAME) * min(values):
            low, high = (plain_number(value, 3) for value in (min(values), max(values)))
            what = f"the joints differ: {own} {low} to {high} (every joint has the least)."
            findings.note("servo", what)
    return gains


def _note_merged(numbers: Mapping[str, Sequence[float]], findings: Findings) -> None:
    """Note which numbers differ from joint to joint, and which one the servo has."""
    units = {"effort": "N·m", "speed": "rad/s"} | UNITS
    taken = {"damping": "every joint has the largest"}
    differ = [
        f"{name} {plain_number(min(values), 3)} to {plain_number(max(values), 3)} {units[name]} "
        f"({taken.get(name, 'each joint keeps its own')})"
        for name, values in numbers.items()
        if values and max(values) > min(values)
    ]
    if differ:
        findings.note("servo", f"the joints differ: {', '.join(differ)}.")


def ratios_of(leg: FoundLeg, servo: Servo) -> dict[str, Float[np.ndarray, "3"]]:
    """Return the numbers of a leg's joints over those of the servo, by the fields of `Leg`."""
    ratios = {}
    for ratio, (name, below) in OWN.items():
        common = getattr(servo, below)
        # Where any joint of a file has friction or a rotor, those without have none.
        is_given = name in UNITS and not servo.is_assumed(name)
        own = [getattr(joint, name) for joint in leg.chain.joints]
        known = [x if is_given or (x and math.isfinite(x)) else common for x in own]
        ratios[ratio] = np.array(known) / common
    return ratios


SLENDER = 0.25
"""Width of a link without a mesh, of its length; that of the PhantomX's femur."""

THINNEST = 0.005
"""Least side of the box of a link [m]: a mesh may be flat, a link is not."""

THINNEST_TRUNK = 0.05
"""Least side of the box of a trunk of which only the hips are known [m], about that of a servo."""

NO_MASS = "--masses geometry with --total-mass-g"
"""Hint where a link has no mass."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A link in its frame of Table 1, or the trunk in the body's, with unchecked masses.

    Attributes:
        subject: Of messages, such as ``link tibia_rf``.
        joint: ``coxa``, ``femur``, ``tibia``, or ``body``.
        leg: Its leg; None for the trunk.
        hips: All hips in the body frame [m], shape (L, 3).
        parts: Its look, in this frame.
    """

    subject: str
    where: str
    joint: str
    leg: FoundLeg | None
    hips: Float[np.ndarray, "legs 3"]
    inertial: Inertial | None
    parts: tuple[Part, ...]

    @property
    def name(self) -> str:
        """Name of an appearance's link: ``body``, or ``LEG.coxa``."""
        return f"{self.leg.name}.{self.joint}" if self.leg else self.joint

    @property
    def length(self) -> float:
        """Length from joint to joint [m]; 0 for the trunk."""
        return float(self.leg.lengths[JOINTS.index(self.joint)]) if self.leg else 0.0

    @property
    def mass(self) -> float:
        """Mass [kg]; 0 without one."""
        return self.inertial.mass if self.inertial else 0.0

    @property
    def box(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of its meshes, or of a rod or the hips in their place [m]."""
        half, least = SLENDER * self.length / 2, THINNEST
        if self.parts:
            corners = np.concatenate([part.vertices for part in self.parts])
        elif self.leg is None:
            # Hips of one height do not show that of the trunk.
            corners, least = self.hips, THINNEST_TRUNK
        else:
            corners = np.array([[0.0, -half, -half], [self.length, half, half]])
        low, high = corners.min(axis=0), corners.max(axis=0)
        thin = np.maximum(0.0, least - (high - low)) / 2
        return np.array([low - thin, high + thin])

    def spread(self, mass: float) -> Piece:
        """Return the link as a solid box of a mass [kg]."""
        low, high = self.box
        inertia = solid_box(high - low, mass)
        return replace(self, inertial=Inertial(mass, (low + high) / 2, inertia))


ROUNDED, ROUND_OFF = 1e-3, 1e-10
"""Part by which the largest moment of a plate may exceed the sum of the others when it was written
with four digits, and when it was only computed."""


def possible_inertia(inertial: Inertial) -> Inertial:
    """Return a body's mass and a realisable inertia, with a thin plate's digits rounded up.

    In a plate the largest moment is the sum of the others, and rounded numbers may exceed it.
    """
    if not np.isfinite(inertial.inertia).all():
        return inertial
    moments = np.linalg.eigvalsh(inertial.inertia)
    excess = float(moments[2] - moments[0] - moments[1])
    if not ROUND_OFF * moments[2] < excess <= ROUNDED * moments[2]:
        return inertial
    return replace(inertial, inertia=inertial.inertia + excess * np.eye(3))


def weighed(links: Sequence[Piece], options: ImportOptions, findings: Findings) -> list[Piece]:
    """Apply the options ``masses`` and ``total_mass`` to all links of a robot."""
    chosen, total_mass = list(links), options.total_mass
    bare = sum(not link.mass for link in links)
    if options.masses == "geometry" and bare and total_mass is not None:
        volumes = [float(np.prod(np.diff(link.box, axis=0))) for link in links]
        density = total_mass / sum(volumes)
        findings.note(
            "masses",
            f"{bare} of {len(links)} links have no mass in the file; {plain_number(total_mass)} kg "
            "were shared among all links by the volume of their boxes.",
        )
        return [link.spread(density * v) for link, v in zip(links, volumes, strict=True)]
    if options.masses == "geometry":
        what = "every link keeps its mass, spread over its box; the file's inertias are not used."
        findings.note("masses", what)
        chosen = [link.spread(link.mass) if link.inertial else link for link in links]
    total = sum(link.mass for link in chosen)
    if total_mass is None or math.isclose(total, total_mass, rel_tol=1e-12):
        return chosen
    if not total > 0:
        raise InvalidRobot("no link has a mass that could be scaled.", hint='masses = "geometry"')
    factor = total_mass / total
    findings.note(
        "masses",
        f"were scaled by {plain_number(factor)}, from {plain_number(total)} kg to "
        f"{plain_number(total_mass)} kg.",
    )
    return [
        replace(link, inertial=link.inertial and link.inertial.scaled(factor)) for link in chosen
    ]
