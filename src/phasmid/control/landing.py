"""Landing of all swing legs at once, where a stance foot may lose its hold."""

from __future__ import annotations

import numpy as np

from phasmid.control.foothold_search import set_search
from phasmid.control.types import Contact, LegPhase, Reference, SearchStage, State

SPEED = 0.4
"""Largest speed of a landing foot [m/s]."""

SHORTEST = 0.08
"""Shortest time of the landing [s]."""

COASTING = 0.3
"""Part of that time for which a foot keeps its horizontal velocity."""


def land_swing_legs(state: State, reference: Reference, depth: float) -> None:
    """Let all swinging feet land from where they are, without a jump of position or velocity.

    Args:
        state: State of the engine, changed.
        reference: Contacts of the feet.
        depth: Depth below the ground plane at which feet with contact sensing stop [m].
    """
    height, slope = state.ground_filter[3, 0], state.ground_filter[3, 1:]
    for leg in np.flatnonzero(state.leg_phase == LegPhase.SWING):
        foot, velocity = state.foot[leg], state.foot_velocity[leg]
        drop = max(float(foot[2] - height - slope @ foot[:2]), 0.0)
        drop += depth if reference.contact[leg] != Contact.UNKNOWN else 0.0
        time = max(1.875 * drop / SPEED, SHORTEST)
        state.line_position[leg], state.line_velocity[leg] = foot, velocity
        state.line_acceleration[leg] = state.foot_acceleration[leg]
        state.touchdown[leg] = foot + COASTING * time * velocity
        state.touchdown[leg, 2] = foot[2] - drop
        state.swing_elapsed[leg], state.swing_duration[leg] = 0.0, time
        state.swing_height[leg] = state.time_without_contact[leg] = 0.0
        state.leg_phase[leg] = LegPhase.PROBING
    for leg in np.flatnonzero(state.leg_phase == LegPhase.PROBING):
        # A foot that searched for ground would bear no load meanwhile.
        set_search(state, leg, SearchStage.LAND_HERE)
