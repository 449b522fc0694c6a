"""Share of the load of a foot about touchdown and lift-off."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from phasmid.errors import InvalidInput
from phasmid.gait import Gait
from phasmid.gait.gait import PHASE_TOLERANCE
from phasmid.kinematics.shared_kernels import quintic
from phasmid.units import rounded_down


def load_share(
    gait: Gait, time: Float[np.ndarray, "*batch"], *, period: float, window: float
) -> Float[np.ndarray, "*batch legs"]:
    """Return each foot's share of its full load.

    The share rises from 0 to 1 in a window centred on touchdown, and falls to 0 in one centred on
    lift-off, by a quintic with vanishing first and second derivatives at its ends.

    Args:
        gait: The gait.
        time: Time since a cycle began [s], shape (...).
        period: Cycle time [s], above 0.
        window: Length of a window [s]; 0 transfers the load at once.

    Returns:
        Shares from 0 to 1, shape (..., L).

    Raises:
        InvalidInput: The window is longer than half the stance or half the swing.
    """
    stance, swing = gait.duty_factor * period, gait.swing_fraction * period
    longest = min(stance, swing) / 2
    if not 0 <= window <= longest * (1 + PHASE_TOLERANCE):
        raise InvalidInput(
            f"the load transfer takes {window:.4g} s; it must take between 0 and {longest:.4g} s, "
            f"half of the shorter of stance ({stance:.4g} s) and swing ({swing:.4g} s).",
            hint=f"load_transfer = {rounded_down(longest)}",
        )
    phase = np.asarray(time / period)
    share = gait.stance(phase).astype(float)
    if window <= PHASE_TOLERANCE * period:
        return share
    for event, rises in ((gait.swing_fraction, True), (0.0, False)):
        # Time since the event over the window, with the event at 1/2; lift-off may cross the cycle.
        x = ((gait.leg_phase(phase) - event + 0.5) % 1.0 - 0.5) * period / window + 0.5
        ramp = quintic(np.clip(x, 0.0, 1.0))[0]
        share = np.where((x >= 0) & (x <= 1), ramp if rises else 1.0 - ramp, share)
    return share
