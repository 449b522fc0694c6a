"""A leg: three links, their mount on the body, and the neutral foot."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float

from phasmid import units
from phasmid.arguments import check_fields
from phasmid.errors import InvalidRobot
from phasmid.robot.link import LONGEST_LENGTH, Link, frozen_array

JOINTS = ("coxa", "femur", "tibia")
"""The joints of a leg, hip first; each is named for the link that it moves."""

NEAREST_FOOT = 0.001
"""Least distance of a neutral foot from its coxa axis, outwards [m]."""


WIDEST_LIMIT = 4 * math.pi
"""Farthest limit of a joint [rad]: a turn, and as much between two ways to count its angle."""

RATIOS = ("strength", "speed_ratio", "armature_ratio", "friction_ratio")
"""Fields of `Leg` with numbers of each joint over those of the robot's servo."""


@dataclass(frozen=True, eq=False)
class Leg:
    """Leg of three links: a coxa, and a femur and a tibia that move in the coxa's plane.

    With lateral offsets of its links, femur, tibia or foot are beside that plane.

    The hip frame (the paper's frame 0) has its origin on the coxa axis, z along that axis and x
    along the leg's neutral direction. It is turned in the body by Rz(yaw) Ry(pitch) Rx(roll): first
    the yaw about the body's z; a pitch above 0 then lowers x, so that the coxa axis leans outwards
    at its top; a roll above 0 raises the leg's left side. Without pitch and roll the coxa axis
    is vertical. Joint angles are those of Table 1 everywhere: the femur's is the
    elevation of the straight line from femur axis to tibia axis, positive upwards; the tibia's
    is measured from that line, negative when the knee bends down.

    Attributes:
        name: Such as ``right_front``.
        coxa: First link.
        femur: Second link.
        tibia: Third link; its length ends at the foot.
        mount_position: Hip in the body frame [m], shape (3,).
        mount_yaw: Direction of the hip frame's x in the body frame, seen from above [rad].
        neutral_foot: Where the foot stands at rest, in the hip frame [m], shape (3,).
        joint_limits: Lowest and highest angle of each joint [rad], shape (3, 2).
        femur_bend: Angle of the femur's straight line above the zero line of its servo [rad].
        tibia_bend: Angle of the tibia's straight line above the zero line of its servo [rad].
        mount_pitch: Angle by which the hip frame's x points below the horizontal [rad].
        mount_roll: Turn of the hip about its own x, its left side upwards [rad].
        strength: Torque of each joint over that of the robot's servo, of robots whose joints
            differ; also its stiffness and damping, shape (3,).
        speed_ratio: No-load speed of each joint over that of the servo, shape (3,).
        armature_ratio: Inertia of each joint's rotor over that of the servo, shape (3,).
        friction_ratio: Dry friction of each joint over that of the servo, shape (3,).

    Raises:
        InvalidRobot: A measure is impossible, or the neutral foot cannot be reached.
    """

    name: str
    coxa: Link
    femur: Link
    tibia: Link
    mount_position: Float[np.ndarray, "3"]
    mount_yaw: float
    neutral_foot: Float[np.ndarray, "3"]
    joint_limits: Float[np.ndarray, "3 2"]
    femur_bend: float = 0.0
    tibia_bend: float = 0.0
    mount_pitch: float = 0.0
    mount_roll: float = 0.0
    strength: Float[np.ndarray, "3"] = field(default_factory=lambda: np.ones(3))
    speed_ratio: Float[np.ndarray, "3"] = field(default_factory=lambda: np.ones(3))
    armature_ratio: Float[np.ndarray, "3"] = field(default_factory=lambda: np.ones(3))
    friction_ratio: Float[np.ndarray, "3"] = field(default_factory=lambda: np.ones(3))

    def __post_init__(self) -> None:
        what = f"leg {self.name}"
        check_fields(self, f"{what}: ", InvalidRobot)
        shapes = {"mount_position": (3,), "neutral_foot": (3,)} | dict.fromkeys(RATIOS, (3,))
        for name, shape in (shapes | {"joint_limits": (3, 2)}).items():
            array = frozen_array(getattr(self, name), shape, f"{what}: {name}")
            object.__setattr__(self, name, array)
        for place in ("mount_position", "neutral_foot"):
            array, key = getattr(self, place), place.removesuffix("_position")
            if np.abs(array).max() > LONGEST_LENGTH:
                raise InvalidRobot(
                    f"{what}: {place} reaches {np.abs(array).max():.4g} m; "
                    f"lengths above {LONGEST_LENGTH:g} m are refused.",
                    hint=f"{key}_mm = [{', '.join(f'{x:.6g}' for x in array)}]",
                )
        for name in RATIOS:
            may_be_zero, least = name in RATIOS[2:], getattr(self, name).min()
            if least < 0 or (least == 0 and not may_be_zero):
                must = "0 or more" if may_be_zero else "above 0"
                raise InvalidRobot(f"{what}: {name} is {least:.4g}; it must be {must}.")
        for angle in ("mount_yaw", "femur_bend", "tibia_bend", "mount_pitch", "mount_roll"):
            value, key = getattr(self, angle), angle.removeprefix("mount_")
            if not math.isfinite(value) or abs(value) > 2 * math.pi:
                raise InvalidRobot(
                    f"{what}: {angle} is {value:.4g} rad; it must be a finite angle "
                    "of at most one turn.",
                    hint=f"{key}_deg = {value:.6g}, if these are degrees"
                    if math.isfinite(value)
                    else "",
                )
        for joint, (lower, upper) in zip(JOINTS, self.joint_limits, strict=True):
            if lower >= upper:
                raise InvalidRobot(
                    f"joint {self.name}.{joint}: lower limit {math.degrees(lower):.4g}° is above "
                    f"upper limit {math.degrees(upper):.4g}°.",
                    hint=f"{joint}_deg = [{math.degrees(upper):.6g}, {math.degrees(lower):.6g}]",
                )
            widest = max(-lower, upper)
            if widest > WIDEST_LIMIT:
                raise InvalidRobot(
                    f"joint {self.name}.{joint}: its limits reach {widest:.4g} rad, "
                    f"{widest / (2 * math.pi):.1f} turns; they must be within two turns.",
                    hint=f"{joint}_deg = [{lower:.4g}, {upper:.4g}], if these are degrees",
                )
        # Behind the hip the coxa angle jumps by a turn.
        if self.neutral_foot[0] < NEAREST_FOOT:
            raise InvalidRobot(
                f"{what}: neutral foot lies {units.text(self.neutral_foot[0], 'mm')} along its "
                f"hip's x axis; it must stand at least {units.text(NEAREST_FOOT, 'mm')} out.",
                hint="turn the leg's yaw, which is the direction in which it points",
            )

    @property
    def links(self) -> tuple[Link, Link, Link]:
        """Coxa, femur and tibia."""
        return self.coxa, self.femur, self.tibia

    @cached_property
    def lengths(self) -> Float[np.ndarray, "3"]:
        """Lengths of coxa, femur and tibia [m], shape (3,)."""
        return frozen_array([link.length for link in self.links], (3,), f"leg {self.name}")

    @cached_property
    def lateral_offsets(self) -> Float[np.ndarray, "3"]:
        """Lateral offsets of coxa, femur and tibia [m], shape (3,)."""
        offsets = [link.lateral_offset for link in self.links]
        return frozen_array(offsets, (3,), f"leg {self.name}")

    @property
    def is_tilted(self) -> bool:
        """The hip has a pitch or a roll."""
        return bool(self.mount_pitch or self.mount_roll)

    @cached_property
    def R_level_hip(self) -> Float[np.ndarray, "3 3"]:
        """Tilt of the hip, Ry(pitch) Rx(roll), relative to a level frame of equal yaw."""
        cp, sp = math.cos(self.mount_pitch), math.sin(self.mount_pitch)
        cr, sr = math.cos(self.mount_roll), math.sin(self.mount_roll)
        rows = [[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]]
        return frozen_array(rows, (3, 3), f"leg {self.name}")

    @cached_property
    def X_body_hip(self) -> Float[np.ndarray, "4 4"]:
        """Pose of the hip frame in the body frame, a homogeneous transform, shape (4, 4)."""
        c, s = math.cos(self.mount_yaw), math.sin(self.mount_yaw)
        X = np.eye(4)
        X[:3, :3] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ self.R_level_hip
        X[:3, 3] = self.mount_position
        X.flags.writeable = False
        return X
