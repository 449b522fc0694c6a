"""Feet on the ground."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Gt, Le, Lt

from phasmid.tables import Length, Number, Table


class ContactTable(Table):
    """``[contact]``: four points on each foot, each a linear spring and damper.

    Attributes:
        stiffness: Of each of a foot's four contact points [N/m].
        damping: Of each of a foot's four contact points [N·s/m]. With 50 and more, feet that slide
            for long chatter.
        friction_damping: Sideways, of each point that sticks [N·s/m]. A pushed foot creeps by its
            force over it. More creeps less and keeps more internal force between the feet.
        impedance: The engine's d: a point's force also resists its acceleration, with a mass of
            d/(1 - d) times that with which the foot resists a push.
        tip_width: Side of the square on which the four points of a foot lie [m].
    """

    stiffness: Annotated[Number, Gt(0)] = 1e4
    damping: Annotated[Number, Gt(0)] = 30.0
    friction_damping: Annotated[Number, Gt(0)] = 300.0
    impedance: Annotated[Number, Gt(0.01), Lt(0.99)] = 0.5
    tip_width: Annotated[Length, Gt(0), Le(0.1)] = 0.004
