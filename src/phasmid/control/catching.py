"""Feet in the air that come down at once, where one that stands may not hold any more."""

from __future__ import annotations

import numpy as np

from phasmid.control.elsewhere import HERE, set_search
from phasmid.control.state import PROBING, SWING, Order, State

SPEED = 0.4
"""Largest speed at which feet come down [m/s]."""

SHORTEST = 0.08
"""Time that they take at least [s]."""

COASTING = 0.3
"""Share of that time for which a foot goes on at the speed that it has along the ground."""


def come_down(state: State, order: Order, depth: float) -> None:
    """Let all feet that swing come down from where they are, without a jump.

    Args:
        state: Where the engine is, changed.
        order: Who feels the ground has told there what is under each foot.
        depth: How far a foot that is felt goes on below the ground that is believed [m].
    """
    g = state.ground[3]
    for leg in np.flatnonzero(state.leg == SWING):
        foot, motion = state.foot[leg], state.motion[:, leg]
        way = max(float(foot[2] - g[0] - g[1:] @ foot[:2]), 0.0)
        way += depth if order.touch[leg] >= 0 else 0.0
        time = max(1.875 * way / SPEED, SHORTEST)
        state.line[0, leg], state.line[1:, leg] = foot, motion
        state.landing[leg] = foot + COASTING * time * motion[0]
        state.landing[leg, 2] = foot[2] - way
        state.swing[leg] = 0.0, time, 0.0
        state.leg[leg] = PROBING
    for leg in np.flatnonzero(state.leg == PROBING):
        # A foot that looked for ground elsewhere would hold nothing meanwhile.
        set_search(state, leg, HERE)
