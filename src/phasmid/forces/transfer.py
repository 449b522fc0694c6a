"""Share of the load of a foot about touchdown and lift-off."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.forces.arguments import finite
from phasmid.gait import Gait
from phasmid.gait.gait import PHASE_TOLERANCE


def load_share(
    gait: Gait, time: Float[np.ndarray, "*batch"], *, period: float, window: float
) -> Float[np.ndarray, "*batch legs"]:
    """Return each foot's share of its full load.

    The share rises from 0 to 1 in a window centred on touchdown, and falls to 0 in one centred on
    lift-off, by a quintic with vanishing first and second derivatives at its ends.

    Args:
        gait: The gait.
        time: Time since a cycle began [s], shape (...).
        period: Cycle time [s].
        window: Length of a window [s]; 0 transfers the load at once.

    Returns:
        Shares from 0 to 1, shape (..., L).

    Raises:
        InvalidInput: The period is not above 0, the window is longer than half the stance or half
            the swing, or a time is not finite.
    """
    if not 0 < period < np.inf:
        raise InvalidInput(f"period is {period:g} s; it must be a finite number greater than 0.")
    stance, swing = gait.duty_factor * period, gait.swing_fraction * period
    longest = min(stance, swing) / 2
    if not 0 <= window <= longest * (1 + PHASE_TOLERANCE):
        raise InvalidInput(
            f"the load transfer takes {window:.4g} s; it must take between 0 and {longest:.4g} s, "
            f"half of the shorter of stance ({stance:.4g} s) and swing ({swing:.4g} s).",
            hint=f"load_transfer = {longest / 2:.4g}",
        )
    phase = np.asarray(finite(time, "time") / period)
    if window == 0:
        return gait.stance(phase).astype(float)
    own = gait.leg_phase(phase)

    def passed(event: float) -> np.ndarray:
        """Return the progress of the window about an event, 0 to 1."""
        since = (own - event + 0.5) % 1.0 - 0.5
        x = np.clip(since * period / window + 0.5, 0.0, 1.0)
        return np.clip(x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 0.0, 1.0)

    # The window of lift-off may cross the end of the cycle.
    lands, lifts = passed(gait.swing_fraction), 1.0 - passed(0.0)
    half = window / period / 2
    near_lift = np.abs((own + 0.5) % 1.0 - 0.5) <= half
    near_landing = np.abs(own - gait.swing_fraction) <= half
    rest = gait.stance(phase).astype(float)
    return np.where(near_lift, lifts, np.where(near_landing, lands, rest))
