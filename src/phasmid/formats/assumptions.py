"""Data that a robot's file may lack: servo, masses and neutral feet."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidRobot, located
from phasmid.formats.findings import Findings
from phasmid.formats.legs import UPRIGHT, FoundLeg
from phasmid.formats.tree import TreeJoint
from phasmid.kinematics.leg import angles_and_margin
from phasmid.robot import JOINTS, Part, Servo, load_servo
from phasmid.robot.inertial import Inertial
from phasmid.robot.leg import NEAREST_FOOT
from phasmid.robot.link import solid_box
from phasmid.robot.servo_rules import ASSUMED, OWN_FILE, UNKNOWN, complete_servo
from phasmid.scenario.tables import ImportOptions
from phasmid.units import plain_number

LIKE = "AX-12A"
"""Servo whose speed stands in where a format has none, such as MJCF."""

UNITS = {"friction": "N·m", "damping": "N·m·s/rad", "armature": "kg·m²"}
"""Numbers of joints of which a servo has the largest, and their units."""

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
        InvalidRobot: The file has no numbers of a servo, or impossible ones.
    """
    if option:
        with located("option --servo-model"):
            return load_servo(option)
    if own is not None:
        return own
    efforts = [j.effort for j in joints if j.effort and math.isfinite(j.effort)]
    speeds = [j.velocity for j in joints if j.velocity and math.isfinite(j.velocity)]
    if not efforts:
        raise InvalidRobot(
            "the joints have no effort, so their servos are not known.",
            hint="--servo-model AX-12A",
        )
    like = load_servo(LIKE)
    torque, speed = min(efforts), min(speeds, default=like.no_load_speed)
    merged = {name: [getattr(joint, name) for joint in joints] for name in UNITS}
    given = {name: max(values) for name, values in merged.items()}
    _note_merged({"effort": efforts, "speed": speeds} | merged, findings)
    servo = complete_servo(
        {
            "name": "as in the file",
            "stall_torque": torque,
            "no_load_speed": speed,
            # A file's damping is the friction of its joints.
            **{NAMES.get(name, name): value for name, value in given.items() if value},
        },
        {"stall_current": UNKNOWN, "no_load_speed": OWN_FILE if speeds else ASSUMED},
    )
    assumed = [f"stiffness {plain_number(servo.stiffness, 3)} N·m/rad"]
    if not speeds:
        assumed.append(f"no-load speed {plain_number(speed)} rad/s, the {LIKE}'s")
    assumed += [name for name in given if not given[name]]
    findings.note(
        "servo",
        f"the file gives {plain_number(torque)} N·m"
        + (f" and {plain_number(speed)} rad/s" if speeds else "")
        + f"; assumed: {', '.join(assumed)}.",
        hint=DATA_SHEET,
    )
    return servo


def _note_merged(numbers: Mapping[str, Sequence[float]], findings: Findings) -> None:
    """Note which numbers differ from joint to joint, and which one the servo has."""
    units = {"effort": "N·m", "speed": "rad/s"} | UNITS
    taken = {"effort": "each joint keeps its own", "speed": "every joint has the least"}
    differ = [
        f"{name} {plain_number(min(values), 3)} to {plain_number(max(values), 3)} {units[name]} "
        f"({taken.get(name, 'every joint has the largest')})"
        for name, values in numbers.items()
        if values and max(values) > min(values)
    ]
    if differ:
        findings.note("servo", f"the joints differ: {', '.join(differ)}.")


def strength_of(leg: FoundLeg, servo: Servo) -> Float[np.ndarray, "3"]:
    """Return the efforts of a leg's joints over the servo's stall torque, shape (3,)."""
    efforts = [joint.effort or servo.stall_torque for joint in leg.chain.joints]
    finite = [each if math.isfinite(each) else servo.stall_torque for each in efforts]
    return np.array(finite) / servo.stall_torque


SLENDER = 0.25
"""Width of a link without a mesh, of its length; that of the PhantomX's femur."""

THINNEST = 0.005
"""Least side of the box of a link [m]: a mesh may be flat, a link is not."""

NO_MASS = "--masses geometry with --total-mass-g"
"""Hint where a link has no mass."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A link in its frame of Table 1, or the trunk in the body's, with unchecked masses.

    Attributes:
        subject: Of messages, such as ``link tibia_rf``.
        where: File and line.
        joint: ``coxa``, ``femur``, ``tibia``, or ``body``.
        leg: Its leg; None for the trunk.
        size: Box of the trunk [m], shape (3,).
        inertial: Mass and inertia; None where there is none.
        parts: Its look, in this frame.
    """

    subject: str
    where: str
    joint: str
    leg: FoundLeg | None
    size: Float[np.ndarray, "3"]
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
        """Lowest and highest corner of its meshes, or of a rod or box in their place [m]."""
        half = SLENDER * self.length / 2
        if self.parts:
            corners = np.concatenate([part.vertices for part in self.parts])
        elif self.leg is None:
            corners = np.array([-self.size / 2, self.size / 2])
        else:
            corners = np.array([[0.0, -half, -half], [self.length, half, half]])
        low, high = corners.min(axis=0), corners.max(axis=0)
        thin = np.maximum(0.0, THINNEST - (high - low)) / 2
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

    In a plate the largest moment is the sum of the others, and rounded numbers may exceed it, which
    no body's do; then a little is added to each moment.
    """
    if not np.isfinite(inertial.inertia).all():
        return inertial
    moments = np.linalg.eigvalsh(inertial.inertia)
    excess = float(moments[2] - moments[0] - moments[1])
    if not ROUND_OFF * moments[2] < excess <= ROUNDED * moments[2]:
        return inertial
    return replace(inertial, inertia=inertial.inertia + excess * np.eye(3))


def weighed(links: Sequence[Piece], options: ImportOptions, findings: Findings) -> list[Piece]:
    """Apply the options ``masses`` and ``total_mass`` to all links of a robot.

    Raises:
        InvalidRobot: There is no mass to scale.
    """
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
        raise InvalidRobot("no link has a mass that could be scaled.", hint="--masses geometry")
    factor = total_mass / total
    findings.note(
        "masses",
        f"were scaled by {plain_number(factor)}, from {plain_number(total)} kg to "
        f"{plain_number(total_mass)} kg.",
    )
    return [
        replace(link, inertial=link.inertial and link.inertial.scaled(factor)) for link in chosen
    ]


OUT, DOWN = 0.6, 0.4
"""A foot's distance from its coxa axis and below its hip, of the leg's length: those of the
PhantomX of this project, 150 and 100 mm with 250 mm of leg."""

BENEATH = 0.7
"""Depth of a foot below a hip whose coxa axis lies, of the leg's length."""

SPARE = math.radians(5.0)
"""Angle that a standing leg keeps from its limits, where it can."""


def standing_feet(legs: Sequence[FoundLeg]) -> Float[np.ndarray, "legs 3"]:
    """Return feet on one level ground, straight out from the hips, within the joint limits.

    All legs stand equally far out; of all stances that every leg can take, the one nearest to
    `OUT` and `DOWN`; beneath the hips, nearest to `BENEATH`, where all coxa axes lie.

    Args:
        legs: The legs, their hips in the body frame.

    Returns:
        Feet in the hip frames [m], shape (L, 3).

    Raises:
        InvalidRobot: No stance is within the limits.
    """
    length = float(np.mean([leg.lengths.sum() for leg in legs]))
    step = _round_step(length)
    # In steps that make round numbers, as far as any leg reaches.
    count = math.ceil(length / step)
    lying = all(abs(leg.R_level_hip[2, 2]) < UPRIGHT for leg in legs)
    wanted_out, wanted_down = (0.0, BENEATH) if lying else (OUT, DOWN)
    out = step * np.arange(0 if lying else 1, count + 1)
    down = step * np.arange(count + 1)
    r, h = np.meshgrid(out, down, indexing="ij")
    wish = np.hypot(
        r - round(wanted_out * length / step) * step, h - round(wanted_down * length / step) * step
    )
    order = np.argsort(wish, axis=None, kind="stable")
    r, h = r.ravel()[order], h.ravel()[order]
    for spare in (SPARE, 0.0):
        fits = np.ones(r.shape, dtype=bool)
        for leg in legs:
            fits &= _within(leg, _in_hip(leg, r, h), spare)
        if fits.any():
            best = int(np.argmax(fits))
            return np.array([_in_hip(leg, r[best], h[best]) for leg in legs])
    raise InvalidRobot(
        "no stance with knees up is within the joint limits.",
        hint="widen the limits, or check their signs",
    )


def _round_step(length: float) -> float:
    """About a twentieth of a length, a round number."""
    decade = 10.0 ** math.floor(math.log10(length / 20))
    return max(m * decade for m in (1.0, 2.0, 5.0) if m * decade <= length / 20)


def _in_hip(leg: FoundLeg, r: np.ndarray | float, h: np.ndarray | float) -> np.ndarray:
    """Return a point at a distance from the hip and a depth below the body, in the hip frame."""
    r, z = np.broadcast_arrays(np.asarray(r), -np.asarray(h) - float(leg.position[2]))
    left = np.array([0.0, leg.lateral_offsets.sum(), 0.0])
    return np.stack([r, np.zeros(r.shape), z], axis=-1) @ leg.R_level_hip + left


def _within(leg: FoundLeg, p_hip_foot: np.ndarray, spare: float) -> np.ndarray:
    angles, margin = angles_and_margin(leg, p_hip_foot)
    low, high = leg.limits.T
    # Of a narrow range a spare angle may leave nothing.
    room = np.minimum(spare, (high - low) / 4)
    inside = ((angles >= low + room) & (angles <= high - room)).all(axis=-1)
    return inside & (margin >= 0) & (p_hip_foot[:, 0] >= NEAREST_FOOT)
