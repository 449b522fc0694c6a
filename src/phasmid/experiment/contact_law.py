"""The contact law of one robot, in numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

ContactKind = Literal["spring-damper", "mujoco", "simscape"]
"""Name of a contact law."""


STANDING_SPEED = 0.01
"""Speed of all joint targets below which a robot stands [rad/s]. At it a foot that turns about its
joints accelerates by 1e-4 of the leg length per s², which the larger mass resists with some mN."""


@dataclass(frozen=True)
class ContactLaw:
    """Law by which the ground holds the contact points of a robot, in numbers.

    Attributes:
        kind: Name of the law.
        stiffness: Of each of a foot's contact points [N/m].
        damping: Of each of a foot's contact points [N·s/m].
        friction_damping: Tangential damping of each sticking point [N·s/m].
        impedance: The engine's d; see `ContactTable.impedance`.
        tip_width: Side of the square of a foot's contact points [m].
        point_radius: Radius of a contact point [m].
        kinetic_friction: Law ``simscape``: coefficient of friction of a sliding foot.
        friction_threshold: Law ``simscape``: speed below which a foot sticks, by creeping [m/s].
    """

    kind: ContactKind
    stiffness: float
    damping: float
    friction_damping: float
    impedance: float
    tip_width: float
    point_radius: float
    kinetic_friction: float
    friction_threshold: float

    @property
    def friction_hardness(self) -> float:
        """Hardness of friction against that of normal forces: MuJoCo's ``impratio``."""
        return 1.0 if self.kind == "mujoco" else self.friction_damping / self.damping
