"""Feet in the air that come down at once, where one that stands may not hold any more."""

from __future__ import annotations

import numpy as np

from phasmid.control.foothold_search import set_search
from phasmid.control.types import LegPhase, Reference, SearchStage, State

SPEED = 0.4
"""Largest speed at which feet come down [m/s]."""

SHORTEST = 0.08
"""Time that they take at least [s]."""

COASTING = 0.3
"""Share of that time for which a foot goes on at the speed that it has along the ground."""


def come_down(state: State, reference: Reference, depth: float) -> None:
    """Let all feet that swing come down from where they are, without a jump.

    Args:
        state: Where the engine is, changed.
        reference: Who feels the ground has told there what is under each foot.
        depth: How far a foot that is felt goes on below the ground that is believed [m].
    """
    g = state.ground_filter[3]
    for leg in np.flatnonzero(state.leg_phase == LegPhase.SWING):
        foot, velocity = state.foot[leg], state.foot_velocity[leg]
        way = max(float(foot[2] - g[0] - g[1:] @ foot[:2]), 0.0)
        way += depth if reference.contact[leg] >= 0 else 0.0
        time = max(1.875 * way / SPEED, SHORTEST)
        state.line_position[leg], state.line_velocity[leg] = foot, velocity
        state.line_acceleration[leg] = state.foot_acceleration[leg]
        state.touchdown[leg] = foot + COASTING * time * velocity
        state.touchdown[leg, 2] = foot[2] - way
        state.swing_elapsed[leg], state.swing_duration[leg] = 0.0, time
        state.swing_height[leg] = state.time_without_contact[leg] = 0.0
        state.leg_phase[leg] = LegPhase.PROBING
    for leg in np.flatnonzero(state.leg_phase == LegPhase.PROBING):
        # A foot that looked for ground elsewhere would hold nothing meanwhile.
        set_search(state, leg, SearchStage.LAND_HERE)
