"""Footholds of a scenario, on ground that the plan follows."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Le

from phasmid.tables import Angle, Length, Number, Table


class FootingTable(Table):
    """``[footing]``: adaptation of a walk to ground that the plan follows.

    The lengths and angles are assumptions, for feet of some millimetres and servos that place them
    within one or two.

    Attributes:
        search_radius: Farthest that a foothold may lie from where it would be on level ground [m].
        foothold_margin: Radius of the ground around a foothold that must be even [m].
        steepest_foothold: Slope above which ground is not stepped on [rad].
        deepest_foothold: Ground that lies deeper than this between two sides is a gap, and not
            stepped on [m].
        least_friction: Ground with a smaller coefficient is not stepped on where there is better.
        trunk_attitude: ``follow-terrain``: the trunk leans as the ground under its feet does;
            ``level``: it stays level.
        steepest_lean: Farthest that the trunk leans [rad].
    """

    search_radius: Annotated[Length, Ge(0), Le(0.5)] = 0.040
    foothold_margin: Annotated[Length, Gt(0), Le(0.1)] = 0.010
    steepest_foothold: Annotated[Angle, Gt(0), Le(np.pi / 4)] = np.radians(30)
    deepest_foothold: Annotated[Length, Gt(0)] = 0.050
    least_friction: Annotated[Number, Ge(0)] = 0.3
    trunk_attitude: Literal["follow-terrain", "level"] = "follow-terrain"
    steepest_lean: Annotated[Angle, Ge(0), Le(np.pi / 4)] = np.radians(25)
