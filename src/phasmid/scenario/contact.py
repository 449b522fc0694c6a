"""Contact of a scenario."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le, Lt

from phasmid.tables import Length, Number, Of, Table

LAW_DAMPING = {"spring-damper": 30.0, "mujoco": 30.0, "simscape": 100.0}
"""Damping of each law where the scenario gives none [N·s/m]; the engine's own law has none."""


class ContactTable(Table):
    """``[contact]``: four points on each foot, and the law by which the ground holds them.

    Attributes:
        contact_law: ``spring-damper``: a linear spring and damper per point; ``mujoco``: the
            engine's own soft contact with its own numbers; ``simscape``: the law of the paper's
            library, a one-sided damper and stick-slip friction, in a simulator of its own, of
            prescribed joints on level ground.
        stiffness: Of each of a foot's four contact points [N/m].
        damping: Of each of a foot's four contact points [N·s/m]; absent: the law's own, 30 for
            ``spring-damper``, 100 for ``simscape``, whose points damp only while they sink in.
            With 50 and more of ``spring-damper``, feet that slide for long chatter.
        friction_damping: Of ``spring-damper``, sideways, of each point that sticks [N·s/m]. A
            pushed foot creeps by its force over it. More creeps less and keeps more internal
            force between the feet.
        kinetic_friction: Of ``simscape``: coefficient of a foot that slides, at most the
            ground's own, which is the static one.
        friction_threshold: Of ``simscape``: speed up to which a foot sticks, by creeping [m/s].
        impedance: Of ``spring-damper``, the engine's d: a point's force also resists its
            acceleration, with a mass of d/(1 - d) times that with which the foot resists a push.
        tip_width: Side of the square on which the four points of a foot lie [m].
    """

    contact_law: Literal["spring-damper", "mujoco", "simscape"] = "spring-damper"
    stiffness: Annotated[Number, Gt(0), Of("spring-damper", "simscape")] = 1e4
    damping: Annotated[Annotated[Number, Gt(0)] | None, Of("spring-damper", "simscape")] = None
    friction_damping: Annotated[Number, Gt(0), Of("spring-damper")] = 500.0
    kinetic_friction: Annotated[Number, Ge(0), Le(10), Of("simscape")] = 0.5
    friction_threshold: Annotated[Number, Gt(0), Of("simscape")] = 1e-3
    impedance: Annotated[Number, Gt(0.01), Lt(0.99), Of("spring-damper")] = 0.2
    tip_width: Annotated[Length, Gt(0), Le(0.1)] = 0.004

    @property
    def law_damping(self) -> float:
        """The damping, or the law's own where none is given [N·s/m]."""
        return LAW_DAMPING[self.contact_law] if self.damping is None else self.damping
