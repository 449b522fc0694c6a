"""The robot: trunk, legs and servos."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np
from jaxtyping import Float

from phasmid import units
from phasmid.arguments import check_fields
from phasmid.errors import InvalidRobot, nearest
from phasmid.robot.appearance import Appearance
from phasmid.robot.leg import RATIOS, Leg
from phasmid.robot.link import check_inertia, check_length, check_mass, frozen_array
from phasmid.servo.servo import Servo
from phasmid.units import plain_number

HEXAPOD_LEGS = (
    "right_front",
    "right_middle",
    "right_rear",
    "left_rear",
    "left_middle",
    "left_front",
)
"""Names of a hexapod's legs, in the paper's order: legs 1 to 6."""


@dataclass(frozen=True, eq=False)
class Body:
    """Trunk; its frame has x forward, y left, z up, and its origin amid the coxa axes.

    Attributes:
        mass: Mass [kg].
        com: Centre of mass in the body frame [m], shape (3,).
        inertia: About the centre of mass, in body axes [kg·m²], shape (3, 3).
        size: Length, width and height of the box that bounds it [m], shape (3,).
        box_centre: Centre of that box in the body frame [m], shape (3,).

    Raises:
        InvalidRobot: No body can have these numbers.
    """

    mass: float
    com: Float[np.ndarray, "3"]
    inertia: Float[np.ndarray, "3 3"]
    size: Float[np.ndarray, "3"]
    box_centre: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        check_fields(self, "body: ", InvalidRobot)
        check_mass(self.mass, "body: mass")
        shapes = {"com": (3,), "inertia": (3, 3), "size": (3,), "box_centre": (3,)}
        for name, shape in shapes.items():
            array = frozen_array(getattr(self, name), shape, f"body: {name}")
            object.__setattr__(self, name, array)
        for measure, name in zip(self.size, ("length", "width", "height"), strict=True):
            check_length(float(measure), f"body: {name}", "size")
        size = float(self.size.max())
        # Unlike a norm of NumPy, dist does not overflow.
        offset = math.dist(self.com, self.box_centre)
        if offset > size:
            raise InvalidRobot(
                f"body: centre of mass lies {offset:.2g} m from the centre of a {size:.2g} m box.",
                hint="check the unit: com_mm or com_m, box_centre_mm or box_centre_m",
            )
        check_inertia(
            self.inertia, self.mass, size, "body", f"{plain_number(1000 * size, 3)} mm body"
        )

    @property
    def box(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner of the box in the body frame [m], shape (2, 3)."""
        return self.box_points(np.outer([-1.0, 1.0], np.ones(3)))

    def box_points(self, places: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """Return points of the box in the body frame [m].

        Args:
            places: In halves of its size from its centre: -1 and 1 are its sides.
        """
        return np.asarray(self.box_centre + places * self.size / 2)


@dataclass(frozen=True, eq=False)
class LegArrays:
    """Parameters of all legs in arrays; L legs, 3 links each.

    Attributes:
        lengths: Link lengths [m], shape (L, 3).
        lateral_offsets: Lateral offsets of the links [m], shape (L, 3).
        mass: Link masses [kg], shape (L, 3).
        com: Centres of mass in the links' frames [m], shape (L, 3, 3).
        inertia: About the centres of mass [kg·m²], shape (L, 3, 3, 3).
        R_body_hip: Rotations of the hip frames, shape (L, 3, 3).
        p_body_hip: Hips in the body frame [m], shape (L, 3).
        neutral_foot: Neutral feet in the hip frames [m], shape (L, 3).
        joint_limits: Lowest and highest angles [rad], shape (L, 3, 2).
        strength: Torques of the joints over that of the servo, shape (L, 3).
        stall_torque: Stall torques of the joints, as supplied [N·m], shape (L, 3).
        no_load_speed: No-load speeds of the joints, as supplied [rad/s], shape (L, 3).
        armature: Inertias of the joints' rotors [kg·m²], shape (L, 3).
        friction: Dry friction of the joints [N·m], shape (L, 3).
    """

    lengths: Float[np.ndarray, "legs 3"]
    lateral_offsets: Float[np.ndarray, "legs 3"]
    mass: Float[np.ndarray, "legs 3"]
    com: Float[np.ndarray, "legs 3 3"]
    inertia: Float[np.ndarray, "legs 3 3 3"]
    R_body_hip: Float[np.ndarray, "legs 3 3"]
    p_body_hip: Float[np.ndarray, "legs 3"]
    neutral_foot: Float[np.ndarray, "legs 3"]
    joint_limits: Float[np.ndarray, "legs 3 2"]
    strength: Float[np.ndarray, "legs 3"]
    stall_torque: Float[np.ndarray, "legs 3"]
    no_load_speed: Float[np.ndarray, "legs 3"]
    armature: Float[np.ndarray, "legs 3"]
    friction: Float[np.ndarray, "legs 3"]


@dataclass(frozen=True, eq=False)
class Robot:
    """Legged robot with four or more legs of three joints each.

    Attributes:
        name: Short name, also of its result folder.
        body: The trunk.
        legs: The legs; leg number i of the paper is ``legs[i - 1]``.
        servo: Servo of every joint; where joints differ, legs have their ratios to it.
        description: One or two sentences, with the source of the numbers.
        appearance: Meshes of the links, or None.
        foot_radius: Radius of the ball at the end of each leg [m]; its centre is the foot of the
            kinematics. 0: each foot is a point.

    Raises:
        InvalidRobot: Fewer than four legs, two legs of one name or one hip, or a ball that is not
            smaller than its tibia.
    """

    name: str
    body: Body
    legs: tuple[Leg, ...]
    servo: Servo
    description: str = ""
    appearance: Appearance | None = None
    foot_radius: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self, "robot: ", InvalidRobot)
        if len(self.legs) < 4:
            raise InvalidRobot(f"robot: {len(self.legs)} legs given; at least 4 are needed.")
        for a, b in combinations(self.legs, 2):
            if a.name == b.name:
                raise InvalidRobot(f"robot: two legs are called {a.name}.")
            if np.linalg.norm(a.mount_position - b.mount_position) < 1e-3:
                x, y, z = a.mount_position
                raise InvalidRobot(
                    f"legs {a.name} and {b.name} share the hip position "
                    f"({x:.4g}, {y:.4g}, {z:.4g}) m."
                )
        check_length(self.foot_radius, "robot: foot radius", "foot_radius", may_be_zero=True)
        shortest = min(self.legs, key=lambda leg: leg.tibia.length)
        if self.foot_radius >= shortest.tibia.length:
            raise InvalidRobot(
                f"robot: foot radius is {units.text(self.foot_radius, 'mm')}; it must be smaller "
                f"than the tibia of leg {shortest.name}, "
                f"{units.text(shortest.tibia.length, 'mm')}.",
                hint="foot_radius_mm, the radius of the ball at the end of each leg",
            )

    @property
    def leg_names(self) -> tuple[str, ...]:
        """Names of the legs, in order."""
        return tuple(leg.name for leg in self.legs)

    @property
    def mass(self) -> float:
        """Mass of the body and all links [kg]."""
        return self.body.mass + float(self.arrays.mass.sum())

    @property
    def has_equal_servos(self) -> bool:
        """All joints have the servo's own numbers."""
        return all((getattr(leg, name) == 1).all() for leg in self.legs for name in RATIOS)

    def leg(self, name: str | int) -> Leg:
        """Return the leg of a name, or of a number from 1.

        Raises:
            InvalidRobot: There is no such leg.
        """
        if not isinstance(name, str):
            if 1 <= name <= len(self.legs):
                return self.legs[name - 1]
            raise InvalidRobot(f"there is no leg {name}; legs are 1 to {len(self.legs)}.")
        for leg in self.legs:
            if leg.name == name:
                return leg
        guess = nearest(name, self.leg_names)
        raise InvalidRobot(
            f'there is no leg "{name}"; legs are {", ".join(self.leg_names)}.',
            hint=f'"{guess}"' if guess else "",
        )

    @cached_property
    def arrays(self) -> LegArrays:
        """Parameters of all legs."""
        legs, servo = self.legs, self.servo
        rows = {
            "lengths": [leg.lengths for leg in legs],
            "lateral_offsets": [leg.lateral_offsets for leg in legs],
            "mass": [[link.mass for link in leg.links] for leg in legs],
            "com": [[link.com for link in leg.links] for leg in legs],
            "inertia": [[link.inertia for link in leg.links] for leg in legs],
            "R_body_hip": [leg.X_body_hip[:3, :3] for leg in legs],
            "p_body_hip": [leg.mount_position for leg in legs],
            "neutral_foot": [leg.neutral_foot for leg in legs],
            "joint_limits": [leg.joint_limits for leg in legs],
            "strength": [leg.strength for leg in legs],
            "stall_torque": [leg.strength * servo.stall_torque for leg in legs],
            "no_load_speed": [leg.speed_ratio * servo.no_load_speed for leg in legs],
            "armature": [leg.armature_ratio * servo.armature for leg in legs],
            "friction": [leg.friction_ratio * servo.friction for leg in legs],
        }
        arrays = {name: np.array(row, dtype=float) for name, row in rows.items()}
        for array in arrays.values():
            array.flags.writeable = False
        return LegArrays(**arrays)
