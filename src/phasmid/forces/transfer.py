"""How a foot's share of the load comes and goes when it lands and lifts."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.forces.arguments import finite, number
from phasmid.gait import Gait
from phasmid.gait.gait import PHASE_TOLERANCE


def load_share(
    gait: Gait, time: Float[np.ndarray, "*batch"], *, period: float, window: float
) -> Float[np.ndarray, "*batch legs"]:
    """Each foot's part of its full share of the load.

    It rises from 0 to 1 in a window about the foot's landing, and falls to 0 in one about its
    lift, each centred on the event, by a curve whose first two derivatives vanish at its ends.
    Half a window before it lands a foot counts as near the ground, and half a window after it
    lifts it still does.

    Args:
        gait: Which legs stand, when.
        time: Time since a cycle began [s], shape (...).
        period: Time of one cycle [s].
        window: Length of a window [s]; with 0 the load moves at once.

    Returns:
        Shares from 0 to 1, shape (..., L).

    Raises:
        InvalidInput: The period is not above 0, the window is longer than half the stance or half
            the swing, or a time is not finite.
    """
    period, window = number(period, "period"), number(window, "window")
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
        """How much of the window about an event is over, -1/2 to 1/2 of it being inside."""
        since = (own - event + 0.5) % 1.0 - 0.5
        x = np.clip(since * period / window + 0.5, 0.0, 1.0)
        return np.clip(x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 0.0, 1.0)

    # A lift's window may lie across the cycle's end; half a cycle away either curve is flat.
    lands, lifts = passed(gait.swing_fraction), 1.0 - passed(0.0)
    half = window / period / 2
    near_lift = np.abs((own + 0.5) % 1.0 - 0.5) <= half
    near_landing = np.abs(own - gait.swing_fraction) <= half
    rest = gait.stance(phase).astype(float)
    return np.where(near_lift, lifts, np.where(near_landing, lands, rest))
