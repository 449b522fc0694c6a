"""Periodic gaits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from phasmid.arguments import check_fields
from phasmid.errors import InvalidGait

PHASE_TOLERANCE = 1e-9
"""Phases closer than this are one instant; it is round-off of a cycle's fractions."""

LARGEST_SWAY = 0.5
"""A larger sway moves the body beyond the feet of any gait."""

STANDS, LIFTED = "█", "·"
"""A foot on the ground, and in the air."""

COLUMNS = 48
"""Parts of a cycle: the fractions of the gaits of six and eight legs divide it."""

FEWEST_FEET = 3
"""Smallest number of standing feet that is statically stable."""


@dataclass(frozen=True)
class Gait:
    """Periodic gait: the phase at which each leg lifts, and the duty factor.

    Attributes:
        name: Such as ``tripod``.
        duty_factor: Fraction of the cycle for which each foot stands, in (0, 1).
        offsets: For each leg the fraction of the cycle at which it lifts, in [0, 1).
        sway: Largest displacement of the body away from a swinging foot, as a share of the foot's
            distance from the centroid of all feet, in [0, 0.5].

    Raises:
        InvalidGait: A number is out of range, or fewer than three feet stand at some phase.
    """

    name: str
    duty_factor: float
    offsets: tuple[float, ...]
    sway: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self, "gait.", InvalidGait)
        object.__setattr__(self, "offsets", tuple(float(offset) for offset in self.offsets))
        if not 0 < self.duty_factor < 1:
            raise InvalidGait(
                f"gait.duty_factor is {self.duty_factor:g}; it must be greater than 0 and less "
                "than 1.",
                hint="duty_factor = 0.5, as the tripod gait of the paper",
            )
        for i, offset in enumerate(self.offsets):
            if not 0 <= offset < 1:
                raise InvalidGait(f"gait.offsets[{i}] is {offset:g}; offsets are phases in [0, 1).")
        if not 0 <= self.sway <= LARGEST_SWAY:
            raise InvalidGait(
                f"gait.sway is {self.sway:g}; it must be at least 0 and at most {LARGEST_SWAY:g}."
            )
        self._check_support()

    def _check_support(self) -> None:
        middles = self.events + np.diff([*self.events, 1.0]) / 2
        standing = self.stance(middles).sum(axis=1)
        if standing.min() < FEWEST_FEET:
            phase = float(middles[np.argmin(standing)])
            # With the lifts as they are, a foot may not be up while more than n - 3 others are.
            count = len(self.offsets)
            least = math.ceil(1000 * (1 - self._longest_swing(count))) / 1000
            even = [round(leg / count, 3) for leg in range(count)]
            raise InvalidGait(
                f'gait "{self.name}" leaves {standing.min()} to {standing.max()} feet on the '
                f"ground, {standing.min()} at phase {phase:.2f}; "
                f"at least {FEWEST_FEET} are needed.",
                hint=f"duty_factor = {least:g} or more" if least < 1 else f"offsets = {even}",
            )

    def _longest_swing(self, count: int) -> float:
        """Longest swing, in cycles, that never lifts more than n - 3 legs at once."""
        allowed = count - FEWEST_FEET
        if allowed < 1:
            return 0.0
        lifts = sorted(self.offsets)
        # The leg that lifts `allowed` places later may lift only once this one is down.
        gaps = [(lifts[(i + allowed) % count] - lifts[i]) % 1.0 for i in range(count)]
        return min(gap if gap > PHASE_TOLERANCE else 0.0 for gap in gaps)

    @property
    def swing_fraction(self) -> float:
        """Fraction of the cycle for which each foot is in the air."""
        return 1.0 - self.duty_factor

    @property
    def events(self) -> Float[np.ndarray, " events"]:
        """Phases at which a foot lifts or lands, sorted, from 0, shape (E,)."""
        lifts = np.asarray(self.offsets, dtype=float)
        phases = np.concatenate([[0.0], lifts, lifts + self.swing_fraction]) % 1.0
        phases[phases > 1 - PHASE_TOLERANCE] = 0.0
        phases.sort()
        return phases[np.concatenate([[True], np.diff(phases) > PHASE_TOLERANCE])]

    def leg_phase(self, phase: Float[np.ndarray, "*batch"]) -> Float[np.ndarray, "*batch legs"]:
        """Return each leg's phase: 0 at lift-off, 1 - duty factor at touchdown.

        Args:
            phase: Phase of the cycle; whole numbers are full cycles.

        Returns:
            Phase in [0, 1), shape (..., L).
        """
        own = (np.asarray(phase, dtype=float)[..., None] - self.offsets) % 1.0
        own[own > 1 - PHASE_TOLERANCE] = 0.0
        return own

    def stance(self, phase: Float[np.ndarray, "*batch"]) -> Bool[np.ndarray, "*batch legs"]:
        """Return the standing legs at a phase of the cycle, shape (..., L)."""
        return self.leg_phase(phase) >= self.swing_fraction - PHASE_TOLERANCE


def gait_diagram(gait: Gait, columns: int = COLUMNS) -> tuple[str, ...]:
    """Return one line per leg, a cycle from left to right.

    Args:
        gait: The gait.
        columns: Characters of a line.
    """
    stance = gait.stance((np.arange(columns) + 0.5) / columns)
    return tuple("".join(STANDS if stands else LIFTED for stands in leg) for leg in stance.T)
